"""Rules of `CurlingSheet-v0`: the start of episodes, and the effect of a throw.

A throw maps a state and an action to a state, an outcome and the parts of the reward. Single and
vector environments differ only in the simulator of throws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, NamedTuple, cast

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from curling_env.envs.core import Core, Facts, Part
from curling_env.envs.ices import EpisodeIces, GivenIce, IceOption
from curling_env.envs.known_ice import KnownIce
from curling_env.envs.options import (
    dataclass_from,
    delivery_from,
    number,
    reset_options,
    skill_from,
    whole_number,
    yes_or_no,
)
from curling_env.envs.random_ice import DrawnIces, RandomIces
from curling_env.envs.sheet.action import ThrowRange, widest_range
from curling_env.envs.sheet.observation import SheetObservation
from curling_env.envs.sheet.players import (
    PlayOneByOne,
    Surface,
    ThrowPlayer,
    Throws,
    drawn_surfaces,
)
from curling_env.envs.sheet.reset import (
    FIRST_OWN_STONE,
    RESET_OPTIONS,
    DirectionOption,
    ResetDistribution,
    StonesOption,
    TargetOption,
    check_level_counts,
    reset_distribution,
)
from curling_env.envs.sheet.reward import Landing, RewardWeights, judge
from curling_env.envs.sheet.tasks import Task, task_named
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.infrastructure.keywords import rejects_unknown_keywords
from curling_env.physics.engine import Status
from curling_env.sheet import Direction, to_delivery, to_sheet
from curling_env.throw import MAX_SPEED, MAX_SPIN, MIN_SPEED, Delivery, Skill, Throw
from curling_env.typing import Flags, Floats, Indices, Integers, Singles

_DIRECTIONS = np.array([None, Direction.AWAY, Direction.HOME], dtype=object)
"""The directions by their numbers, 1 and -1."""


class Sheets(NamedTuple):
    """Episodes on n sheets at one moment, immutable.

    Parameters
    ----------
    surfaces : the ice of each sheet
    radius : (n,) radius of its stones [m]
    known : (n, m) what is known of it, seen along the direction of play
    of_stones : (n, slots + 1, k) what is known of each stone, and of none
    direction : (n,) the end played to, 1 (away) or -1 (home)
    target : (n, 2) where the next stone should end, delivery frame [m]
    stones : (n, slots, 3) place and heading of the stones, sheet frame [m, rad]; NaN for
        missing ones. A stone keeps its slot, so that its identifier follows from the slot on every
        sheet
    played : (n,) number of throws in this episode
    clock : (n,) time since the episode began [s]
    """

    surfaces: tuple[Surface, ...]
    radius: Floats
    known: Singles
    of_stones: Singles
    direction: Integers
    target: Floats
    stones: Floats
    played: Integers
    clock: Floats


class Asked(NamedTuple):
    """Options of a reset: the distribution of initial states, and the ice."""

    distribution: ResetDistribution
    ice: GivenIce = (None, None)


@rejects_unknown_keywords("CurlingSheet-v0")
class SheetCore(Core[Sheets]):
    """Options and rules of `CurlingSheet-v0`; see `CurlingSheetEnv`."""

    def __init__(
        self,
        ice: IceOption = "standard",
        *,
        known_ice: IceOption | None = None,
        ices: Any = None,
        ice_sigma: bool = False,
        skill: str | Skill | Mapping[str, Any] = "none",
        task: str | Task = "draw",
        throws: int = 1,
        target: TargetOption = None,
        stones: StonesOption = (),
        direction: DirectionOption = "away",
        delivery: str | Delivery | Mapping[str, Any] = "hog-line",
        level: float | None = None,
        throw_range: ThrowRange | Mapping[str, Any] | None = None,
        weights: RewardWeights | Mapping[str, Any] | None = None,
        fps: float = 10.0,
        details: bool = False,
        render_mode: str | None = None,
    ) -> None:
        self.details = yes_or_no("details", details)
        self.throws = whole_number("throws", throws)
        if self.throws < 1:
            raise InputError(f"an episode needs at least one throw, got {throws}")
        self.fps = number("fps", fps, above=0.0, most=1000.0)
        self.player: ThrowPlayer = PlayOneByOne(self.fps)
        """Simulator of the throws."""
        self.task = task_named(task)
        if self.task.has_target_stone and throws > 1:
            raise InputError(f"the task {self.task.name} has one throw an episode, got {throws}")
        self.ices = EpisodeIces(
            ice, known_ice, ices, ice_sigma=ice_sigma, make=self._surface, make_many=self._surfaces
        )
        self.skill = skill_from("skill", skill)
        self._options: dict[str, Any] = {
            "target": target,
            "stones": stones,
            "direction": direction,
            "level": level,
        }
        self._usual = Asked(reset_distribution(self._options, self.ice, self.task))
        # Cached initial state and observation, if nothing is random.
        self._beginning: tuple[Sheets, Singles] | None = None
        check_level_counts(self._options)
        self._resting = self._usual.distribution.stone_count
        slots = self._resting + self.throws
        self._identifiers = [*range(self._resting), *(FIRST_OWN_STONE + k for k in range(throws))]
        self._all_slots = np.arange(slots)
        self.observation = SheetObservation(slots=slots, width=self.ice.sheet.width)
        self.weights = self.task.weights
        if weights is not None:
            if isinstance(weights, Mapping):
                weights = {**asdict(self.task.weights), **weights}
            self.weights = dataclass_from(RewardWeights, "weights", weights)
        self.delivery = delivery_from(delivery)
        # Chosen for the known ice: a range chosen for the true ice would reveal it.
        self.throw_range = (
            widest_range(self.ices.known, hits=self._resting > 0, delivery=self.delivery)
            if throw_range is None
            else dataclass_from(ThrowRange, "throw_range", throw_range)
        )
        names = self.observation.names
        box: Any = spaces.Box(-1.0, 1.0, (len(names),), dtype=np.float32)
        super().__init__(box, spaces.Box(-1.0, 1.0, (3,), dtype=np.float32), render_mode)

    @property
    def ice(self) -> Ice:
        """Ice of the environment; an assigned one applies to later episodes."""
        return self.ices.usual

    @ice.setter
    def ice(self, ice: IceOption) -> None:
        self.ices.usual = ice
        self._beginning = None

    @property
    def ice_sigma(self) -> bool:
        """True if every episode draws an ice within the standard errors of the given ice."""
        return self.ices.has_sigma

    @property
    def level(self) -> float | None:
        """Difficulty of the positions, 0 to 1; a new value applies from the next episode on.

        Raises
        ------
        InputError : an invalid level
        """
        return self._usual.distribution.level

    @level.setter
    def level(self, level: float | None) -> None:
        options = {**self._options, "level": level}
        self._usual = Asked(reset_distribution(options, self.ice, self.task))
        self._options, self._beginning = options, None

    def throw_of(self, action: ArrayLike) -> Throw:
        """Return the throw of an action."""
        return self.throw_range.throw_of(action)

    def action_of(self, throw: Throw) -> Singles:
        """Return the action of a throw, clipped to its range."""
        return self.throw_range.action_of(throw)

    # --- how episodes begin ---------------------------------------------------------------------

    def blank(self, count: int) -> Sheets:
        """Return sheets without stones, with all throws played."""
        surface = self.ices.on(self.ice, self.ices.known[0])
        return Sheets(
            surfaces=(surface,) * count,
            radius=np.full(count, surface.ice.stone.radius),
            known=np.tile(surface.features(Direction.AWAY), (count, 1)),
            of_stones=np.tile(surface.of_stones, (count, 1, 1)),
            direction=np.ones(count, dtype=np.int64),
            target=np.zeros((count, 2)),
            stones=np.full((count, self.observation.slots, 3), np.nan),
            played=np.full(count, self.throws),
            clock=np.zeros(count),
        )

    def asked(self, options: Any, count: int) -> Asked:
        """Return the distribution of initial states and the ice of a reset.

        Raises
        ------
        InputError : an unknown option, or an invalid value, or more stones than there are
            places for
        """
        asked = reset_options(options, RESET_OPTIONS)
        ice = self.ices.given(asked)
        if not asked:
            return self._usual if ice == (None, None) else self._usual._replace(ice=ice)
        chosen = reset_distribution({**self._options, **asked}, self.ice, self.task)
        if chosen.stone_count > self._resting:
            raise InputError(
                f"this environment has places for {self._resting} stones, got "
                f"{chosen.stone_count}; make it with that many"
            )
        return Asked(chosen, ice)

    def begun(
        self,
        episodes: Sheets,
        rows: Indices,
        rngs: Sequence[np.random.Generator],
        asked: Asked | None = None,
    ) -> Sheets:
        """Clear some sheets, lay the stones and choose the targets.

        Raises
        ------
        InputError : there is no room for the stones
        """
        if not len(rows):
            return episodes
        distribution, given = asked = asked or self._usual
        alike = distribution.is_fixed and not self.ices.are_drawn
        recurs = alike and asked is self._usual and len(rows) == len(episodes.played)
        if recurs and self._beginning is not None:
            return self._beginning[0]
        arrays: Any = [array.copy() for array in episodes[1:]]
        new, surfaces = Sheets(episodes.surfaces, *arrays), list(episodes.surfaces)
        new.stones[rows], new.played[rows], new.clock[rows] = np.nan, 0, 0.0
        each: list[int] = rows.tolist()
        chosen = [rngs[i] for i in each]
        drawn = self.ices.draw_many(chosen[:1] if alike else chosen, given)
        if alike:
            drawn *= len(each)
        if distribution.is_fixed:
            initial = [distribution.sample(chosen[0])] * len(each)
        else:
            initial = [
                distribution.on(surface.stone_radius).sample(rng)
                for surface, rng in zip(drawn, chosen, strict=True)
            ]
        for i, surface in zip(each, drawn, strict=True):
            surfaces[i] = surface
        new.direction[rows] = [one.direction for one in initial]
        new.target[rows] = [one.target for one in initial]
        new.radius[rows] = [surface.stone_radius for surface in drawn]
        new.known[rows] = [
            surface.features(one.direction) for surface, one in zip(drawn, initial, strict=True)
        ]
        new.of_stones[rows] = [surface.of_stones for surface in drawn]
        for i, one in zip(each, initial, strict=True):
            if count := len(one.places):
                new.stones[i, :count, :2] = to_sheet(one.places, one.direction)
                new.stones[i, :count, 2] = 0.0
        sheets = new._replace(surfaces=tuple(surfaces))
        if recurs:
            self._beginning = sheets, self.observed(sheets)
        return sheets

    # --- a throw --------------------------------------------------------------------------------

    def played(
        self,
        episodes: Sheets,
        rows: Indices,
        rngs: Sequence[np.random.Generator],
        actions: Sequence[Any],
    ) -> tuple[Sheets, Floats, list[Part]]:
        """Throw a stone on some of the sheets."""
        if not len(rows):
            return episodes, np.zeros(0), []
        numbers = self.throw_range.numbers_of(actions, count=len(rows))
        if not self.skill.is_exact:
            numbers = self._with_errors(
                numbers, [rngs[i] for i in cast("list[int]", rows.tolist())]
            )
        direction, order = episodes.direction[rows], episodes.played[rows]
        slot = self._resting + order
        first_free = max(slot.tolist())
        throws = Throws(
            numbers=numbers,
            surfaces=[episodes.surfaces[i] for i in cast("list[int]", rows.tolist())],
            stones=episodes.stones[rows, :first_free],
            identifiers=self._identifiers[:first_free],
            direction=direction,
            order=order,
            clock=episodes.clock[rows],
            delivery=self.delivery,
        )
        flown = self.player(throws)
        stones, played, clock = (
            episodes.stones.copy(),
            episodes.played.copy(),
            episodes.clock.copy(),
        )
        stones[rows, :first_free] = flown.stones[:, :-1]
        stones[rows, slot] = flown.stones[:, -1]
        played[rows] += 1
        clock[rows] += flown.time
        facing = direction[:, None]
        landing = Landing(
            stone=to_delivery(flown.last, facing),
            in_play=flown.status == Status.REST.value,
            target=episodes.target[rows],
            target_stone=self._target_stones(stones[rows], facing),
            target_stone_before=self._target_stones(throws.stones, facing),
            stone_radius=episodes.radius[rows],
        )
        verdict = judge(landing, self.task.is_done(landing))
        facts: Facts = {
            "status": flown.status.astype(object),
            "distance_m": verdict.distance_m,
            "in_house": verdict.in_house,
            "success": verdict.success,
            "reward_parts": verdict.parts.as_dict(),
            **flown.records,
        }
        if self.details or self.render_mode is not None:
            facts["throw"] = throws.each
        after = episodes._replace(stones=stones, played=played, clock=clock)
        return after, np.asarray(self.weights.total(verdict.parts)), [(rows, facts)]

    def are_over(self, episodes: Sheets) -> Flags:
        """Return which sheets have all throws played."""
        return episodes.played >= self.throws

    def _with_errors(self, meant: Floats, rngs: Sequence[np.random.Generator]) -> Floats:
        """Return executed speeds, angles and spins (n, 3)."""
        thrown = meant + np.array([self.skill.error(rng) for rng in rngs])
        thrown[:, 0] = np.clip(thrown[:, 0], MIN_SPEED, MAX_SPEED)
        thrown[:, 2] = np.clip(thrown[:, 2], -MAX_SPIN, MAX_SPIN)
        return thrown

    def _target_stones(self, stones: Floats, facing: Any) -> Floats:
        """Return the places of the task's target stones, (n, 2) delivery frame; NaN if absent."""
        if not self.task.has_target_stone:
            return np.full((len(stones), 2), np.nan)
        return to_delivery(stones[:, 0, :2], facing)

    # --- what is seen ---------------------------------------------------------------------------

    def observed(self, episodes: Sheets) -> Singles:
        """Return the observations of all sheets."""
        if self._beginning is not None and episodes is self._beginning[0]:
            return self._beginning[1].copy()
        stones, played, of_stones = episodes.stones[..., :2], episodes.played, episodes.of_stones
        slots, rows = self._all_slots[None], np.arange(len(played))
        if slots.size > 1:
            # Stones in play come first, in their order.
            slots = np.argsort(np.isnan(stones[..., 0]), axis=1, kind="stable")
            stones = stones[rows[:, None], slots]
        next_stone = each_stone = None
        if of_stones.any():
            to_come = np.minimum(self._resting + played, self._all_slots.size)
            next_stone, each_stone = of_stones[rows, to_come], of_stones[rows[:, None], slots]
        return self.observation.vector(
            target=episodes.target,
            throws_left=1 - played / self.throws,
            clock=episodes.clock,
            known=episodes.known,
            next_stone=next_stone,
            stones=to_delivery(stones, episodes.direction[:, None, None]),
            own=slots >= self._resting,
            of_stones=each_stone,
        )

    def reported(self, episodes: Sheets, rows: Indices) -> Facts:
        """Return the target in both frames and the direction."""
        direction, target = episodes.direction[rows], episodes.target[rows]
        return {
            "target": to_sheet(target, direction[:, None]),
            "target_from_tee": target,
            "direction": _DIRECTIONS[direction],
        }

    def _surfaces(self, distribution: RandomIces, ices: DrawnIces) -> list[Surface]:
        return drawn_surfaces(distribution, ices, self._identifiers)

    def _surface(self, ice: Ice, known: KnownIce) -> Surface:
        return Surface(ice, known, self._identifiers)
