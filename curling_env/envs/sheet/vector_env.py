"""Many sheets of `CurlingSheet-v0` side by side, whose throws are simulated together."""

# Gymnasium leaves the spaces of a VectorEnv partly untyped.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from curling_env.envs.ices import GivenIce
from curling_env.envs.options import reset_options, whole_number
from curling_env.envs.sheet.env import CurlingSheetEnv, engine_for
from curling_env.envs.sheet.reset import FIRST_OWN_STONE, RESET_OPTIONS, ResetDistribution
from curling_env.envs.sheet.reward import Landing, judge
from curling_env.envs.vector import autoreset_mode_of, masked, reset_mask_of, seeds_of
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.batch import MOST_STONES, RELEASE_DTYPE, Positions, play_batch, throw_batch
from curling_env.physics.engine import Status, StoneState, is_hogged, left_by_the_side
from curling_env.physics.slides import SlideEnd, play_bounds
from curling_env.sheet import Direction, to_delivery, to_sheet
from curling_env.throw import Throw, velocity_of
from curling_env.typing import Flags, Floats, Indices, Singles

STATUSES = np.array([status.value for status in Status], dtype=object)
"""What `info` calls each status, in the order of `Status`."""
_CODE = {status: code for code, status in enumerate(Status)}


DIRECTIONS = np.array([Direction.AWAY, Direction.HOME], dtype=object)


def _bounds(ice: Ice) -> Floats:
    """The edges of play towards each end, (2, 4); see `play_bounds`."""
    return np.array([play_bounds(ice, end) for end in Direction])


def _throws(numbers: Floats) -> NDArray[Any]:
    """Throws of speeds, angles and spins (n, 3), as objects."""
    throws = np.empty(len(numbers), dtype=object)
    for row, (speed, angle, spin) in enumerate(numbers.tolist()):
        throws[row] = Throw(speed=speed, angle=angle, spin=spin)
    return throws


class _Played(NamedTuple):
    """Outcomes of throws on n sheets.

    Parameters
    ----------
    xy : (n, k + 1, 2) where the stones lie afterwards, the delivered one last, sheet frame [m];
        NaN where there is none
    last : (n, 2) where the delivered stone ended, in play or not, sheet frame [m]
    struck : (n,) whether it struck another
    time : (n,) time until all stones rest [s]
    records : outcomes and trajectories for `info`, where they were asked for
    """

    xy: Floats
    last: Floats
    struck: Flags
    time: Floats
    records: dict[str, Any]


class CurlingSheetVectorEnv(VectorEnv[Singles, Singles, NDArray[Any]]):
    """Many sheets of `CurlingSheet-v0` at once.

    With the same seeds, sheets, throws and rewards are those of `CurlingSheetEnv`, in far less
    time. `info` holds the same entries in Gymnasium's form, as arrays with a mask each; without
    `fps` it has neither `trajectory` nor `outcome`.

    Parameters
    ----------
    num_envs : number of sheets
    autoreset_mode : when an episode that is over begins anew: in the next step ("NextStep"), whose
        action is then not thrown; in the same step ("SameStep"), so that every step is a throw; or
        when `reset` asks for it with a `reset_mask` ("Disabled")
    fps : samples a second of `trajectory` in `info`; without it `info` has neither `trajectory`
        nor `outcome`. With it throws are simulated one by one, as slowly as in `CurlingSheetEnv`.
    render_mode : None; many sheets are not drawn
    settings : options of `CurlingSheetEnv`; at most sixteen stones on a sheet

    Raises
    ------
    InputError : a setting that makes no sense, or that only a single sheet can have
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        fps: float | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        num_envs = whole_number("num_envs", num_envs, least=1)
        if render_mode is not None:
            raise InputError(
                "many sheets at once are not shown: make a single environment for that"
            )
        mode = autoreset_mode_of(autoreset_mode)
        if fps is not None:
            settings["fps"] = fps
        self.single = CurlingSheetEnv(**settings)
        self.metadata = {**self.single.metadata, "render_modes": [], "autoreset_mode": mode}
        self.num_envs = num_envs
        self.single_observation_space = self.single.observation_space
        self.single_action_space = self.single.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.autoreset_mode = mode
        self._fps = fps
        slots = self.single.observation.slots
        if slots > MOST_STONES:
            raise InputError(
                f"many sheets at once hold at most {MOST_STONES} stones each, got {slots} with "
                "the throws"
            )
        self._resting = slots - self.single.throws
        # A stone keeps its slot, so that its identifier follows from the slot on every sheet.
        self._own = np.arange(slots) >= self._resting
        self._identifiers = [
            s if s < self._resting else FIRST_OWN_STONE + s - self._resting for s in range(slots)
        ]
        self._usual_bounds = _bounds(self.single.ice)
        self._rngs: list[np.random.Generator] = []
        usual = self.single.ices.known_as(self.single.ices.known[0])
        self._usual = np.array([usual.features(end) for end in Direction])
        # What is told of the stones by their slots, and of none after the last.
        told = usual.of_stones(self._identifiers)
        self._usual_stones = np.concatenate([told, np.zeros_like(told[:1])])
        self._ices = [self.single.ice] * num_envs
        self._same_ice = True
        # The edges of play for each sheet and each end, and the radius of its stones.
        self._bounds = np.repeat(self._usual_bounds[None], num_envs, axis=0)
        self._radius = np.full(num_envs, self.single.ice.stone.radius)
        self._known = np.repeat(self._usual[:1], num_envs, axis=0)
        self._of_stones = np.repeat(self._usual_stones[None], num_envs, axis=0)
        self._directions = np.ones(num_envs, dtype=np.int64)
        self._targets = np.zeros((num_envs, 2))
        self._places = np.full((num_envs, slots, 2), np.nan)
        self._played = np.zeros(num_envs, dtype=np.int64)
        self._clock = np.zeros(num_envs)
        self._over = np.zeros(num_envs, dtype=np.bool_)

    @property
    def level(self) -> float | None:
        """Difficulty of the positions, 0 to 1; a new value holds for episodes that begin later."""
        return self.single.level

    @level.setter
    def level(self, level: float | None) -> None:
        self.single.level = level

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Singles, dict[str, Any]]:
        """Begin all episodes.

        Parameters
        ----------
        seed : one for each sheet, or the first of consecutive seeds
        options : those of `CurlingSheetEnv`, and `reset_mask` (num_envs,) to begin only some

        Raises
        ------
        InputError : an option that makes no sense
        """
        n = self.num_envs
        seeds = seeds_of(seed, n)
        asked = reset_options(options, (*RESET_OPTIONS, "reset_mask"))
        mask = reset_mask_of(asked.pop("reset_mask", None), n)
        given = self.single.ices.given(asked)
        distribution = self.single.reset_distribution(asked)
        if not self._rngs:
            self._rngs = [np.random.default_rng() for _ in range(n)]
            mask = np.ones(n, dtype=np.bool_)
        rows = np.flatnonzero(mask)
        for i in rows:
            if seeds[i] is not None:
                self._rngs[i] = np.random.Generator(np.random.PCG64(seeds[i]))
        self._begin(rows, distribution, given)
        return self._observe(), masked(self._target_info(rows), mask)

    def step(self, actions: Singles) -> tuple[Singles, Floats, Flags, Flags, dict[str, Any]]:
        """Throw a stone on every sheet.

        Raises
        ------
        InputError : before the first reset, actions of another shape, or with the mode "Disabled"
            an episode that is over
        """
        if not self._rngs:
            raise InputError("call reset() before the first step")
        n = self.num_envs
        actions = np.asarray(actions)
        if actions.shape != (n, 3):
            raise InputError(f"expected actions of shape ({n}, 3), got {actions.shape}")
        everyone = np.arange(n)
        if self.autoreset_mode is AutoresetMode.DISABLED and self._over.any():
            raise InputError(
                f"the episode of environment {int(np.argmax(self._over))} is over; begin it with "
                "reset(options={'reset_mask': …})"
            )
        beginning = np.flatnonzero(self._over)
        playing = np.flatnonzero(~self._over) if len(beginning) else everyone
        self._begin(beginning, self.single.reset_distribution())
        rewards = np.zeros(n)
        facts: dict[str, Any] = {}
        if len(playing):
            rewards[playing], facts = self._throw(playing, actions[playing])
        over = self._played >= self.single.throws
        observations = self._observe()
        info: dict[str, Any] = {}
        same_step = self.autoreset_mode is AutoresetMode.SAME_STEP
        if same_step and over.any():
            final = np.empty(n, dtype=object)
            for i in np.flatnonzero(over):
                final[i] = observations[i].copy()
            ended = {**facts, **self._target_info(everyone)}
            info["final_obs"], info["_final_obs"] = final, over.copy()
            info["final_info"] = masked(ended, over, whole=True)
            info["_final_info"] = over.copy()
            self._begin(np.flatnonzero(over), self.single.reset_distribution())
            observations = self._observe()
        else:
            self._over = over.copy()  # what is returned belongs to the caller
        info |= masked(self._target_info(everyone), np.ones(n, dtype=np.bool_))
        if len(playing) and not (same_step and over.all()):
            mask = ~over if same_step else np.isin(everyone, playing)
            info |= masked(facts, mask, whole=len(playing) == n)
        return observations, rewards, over, np.zeros(n, dtype=np.bool_), info

    # --- the parts ------------------------------------------------------------------------------

    def _begin(
        self, rows: Indices, distribution: ResetDistribution, given: GivenIce = (None, None)
    ) -> None:
        """Begin an episode on some of the sheets."""
        if not len(rows):
            return
        self._played[rows], self._clock[rows], self._over[rows] = 0, 0.0, False
        self._places[rows] = np.nan
        each: list[int] = rows.tolist()
        ices = self.single.ices
        if ices.usual is not self._ices[0] or ices.are_drawn or given != (None, None):
            self._same_ice = False
        if self._same_ice:
            if distribution.is_fixed:
                self._set_state(rows, *distribution.sample(self._rngs[0]))
            else:
                for i in each:
                    self._set_state(i, *distribution.sample(self._rngs[i]))
            self._known[rows] = self._usual[(self._directions[rows] < 0).astype(np.intp)]
            return
        for i in each:
            ice, known = ices.draw(self._rngs[i], given)
            self._set_state(i, *distribution.on(ice).sample(self._rngs[i]))
            self._known[i] = known.features(Direction(int(self._directions[i])))
            self._of_stones[i, :-1] = known.of_stones(self._identifiers)
            if ice is not self._ices[i]:
                self._ices[i], self._radius[i] = ice, ice.stone.radius
                self._bounds[i] = _bounds(ice)

    def _set_state(
        self, rows: Indices | int, direction: Direction, target: Any, places: Floats
    ) -> None:
        self._directions[rows], self._targets[rows] = direction, target
        if len(places):
            self._places[rows, : len(places)] = to_sheet(places, direction)

    def _throw(self, rows: Indices, actions: Singles) -> tuple[Floats, dict[str, Any]]:
        """Throw a stone on some of the sheets; their rewards, and facts for `info`."""
        single = self.single
        meant = single.throw_range.numbers_of(actions)
        throws = single.thrown(meant, [self._rngs[i] for i in rows])
        direction, thrown = self._directions[rows], self._resting + self._played[rows]
        k = int(thrown.max())
        played = self._play_each(rows, throws, k) if self._fps else self._play(rows, throws, k)
        bounds = self._bounds[rows, (direction < 0).astype(np.intp)]
        radius: Any = self._radius[rows]
        x, y = played.last.T
        gone = np.isnan(played.xy[:, -1, 0])
        hogged = ~gone & ~played.struck & is_hogged(y, direction, radius)
        side = left_by_the_side(x, y, bounds.T)
        code = np.select(
            [hogged, ~gone, side],
            [_CODE[Status.HOGGED], _CODE[Status.REST], _CODE[Status.OUT_SIDE]],
            _CODE[Status.OUT_BACK],
        )
        in_play = ~gone & ~hogged
        before = to_delivery(self._target_stone(rows), direction[:, None])
        self._places[rows, :k] = played.xy[:, :-1]
        self._places[rows, thrown] = np.where(in_play[:, None], played.xy[:, -1], np.nan)
        self._played[rows] += 1
        self._clock[rows] += played.time
        landing = Landing(
            stone=to_delivery(played.last, direction[:, None]),
            in_play=in_play,
            target=self._targets[rows],
            target_stone=to_delivery(self._target_stone(rows), direction[:, None]),
            target_stone_before=before,
            stone_radius=radius,
        )
        verdict = judge(landing, single.task.is_done(landing))
        facts: dict[str, Any] = {
            "throw": _throws(throws),
            "status": STATUSES[code],
            "distance_m": verdict.distance_m,
            "in_house": verdict.in_house,
            "success": verdict.success,
            "reward_parts": verdict.parts.as_dict(),
            **played.records,
        }
        return np.asarray(single.weights.total(verdict.parts)), facts

    def _target_stone(self, rows: Indices) -> Floats:
        """Where the task's target stones lie, (n, 2) sheet frame [m]; NaN where there is none."""
        if not self.single.task.has_target_stone:
            return np.full((len(rows), 2), np.nan)
        return self._places[rows, 0].copy()

    def _play(self, rows: Indices, throws: Floats, k: int) -> _Played:
        """Simulate throws together, among the first k stones of each sheet."""
        direction = self._directions[rows]
        table = np.zeros(len(rows), dtype=RELEASE_DTYPE)
        table["y"] = -direction * self.single.delivery.line_y
        table["vx"], table["vy"] = velocity_of(throws[:, 0], throws[:, 1], direction)
        table["omega"] = throws[:, 2]
        table["stone"] = FIRST_OWN_STONE + self._played[rows]
        table["clock"], table["order"] = self._clock[rows], self._played[rows]
        before = self._places[rows, :k]
        xy, last = np.empty((len(rows), k + 1, 2)), np.empty((len(rows), 2))
        struck, time = np.empty(len(rows), dtype=np.bool_), np.empty(len(rows))
        for number, end in enumerate(Direction):
            to_end = direction == end
            for mine, ice in self._by_ice(rows, to_end):
                bounds = self._bounds[rows[mine][0], number]
                if k == 0:
                    after = _throw_alone(ice, table[mine], bounds)
                else:
                    after = play_batch(
                        ice,
                        before[mine],
                        table[mine],
                        identity=self._identifiers[:k],
                        bounds=bounds,
                    )
                if (after.collisions < 0).any():
                    raise InputError(
                        "a stone never stops on this ice; check its friction and slope"
                    )
                xy[mine], last[mine] = after.xy, after.last[:, -1]
                struck[mine], time[mine] = after.collisions > 0, after.time
        return _Played(xy, last, struck, time, {})

    def _by_ice(self, rows: Indices, to_end: Flags) -> list[tuple[slice | Flags | Indices, Ice]]:
        """Parts of the rows that play to one end, each on one ice."""
        if not to_end.any():
            return []
        if self._same_ice:
            return [(slice(None) if to_end.all() else to_end, self.single.ice)]
        alike: dict[int, tuple[list[int], Ice]] = {}
        for row in np.flatnonzero(to_end).tolist():
            ice = self._ices[int(rows[row])]
            alike.setdefault(id(ice), ([], ice))[0].append(row)
        return [(np.array(some), ice) for some, ice in alike.values()]

    def _play_each(self, rows: Indices, throws: Floats, k: int) -> _Played:
        """Simulate throws one by one through the engine, which keeps trajectories."""
        xy, last = np.full((len(rows), k + 1, 2), np.nan), np.empty((len(rows), 2))
        outcomes, trajectories = (np.empty(len(rows), dtype=object) for _ in range(2))
        struck, time = np.zeros(len(rows), dtype=np.bool_), np.empty(len(rows))
        for row, (i, (speed, angle, spin)) in enumerate(zip(rows, throws.tolist(), strict=True)):
            slots = np.flatnonzero(~np.isnan(self._places[i, :k, 0]))
            number = int(self._played[i])
            engine = self.single.engine if self._same_ice else engine_for(self._ices[int(i)])
            outcome = engine.play(
                Throw(speed=speed, angle=angle, spin=spin).release(
                    Direction(self._directions[i]),
                    stone=FIRST_OWN_STONE + number,
                    clock=float(self._clock[i]),
                    order=number,
                    delivery=self.single.delivery,
                ),
                [
                    StoneState(x=x, y=y, stone=self._identifiers[s])
                    for s, (x, y) in zip(slots, self._places[i, slots].tolist(), strict=True)
                ],
                fps=self._fps,
                throw=number,
            )
            ends = np.array([(stone.x, stone.y) for stone in outcome.stones])
            lying = np.array([status in (Status.REST, Status.HOGGED) for status in outcome.status])
            slots = np.append(slots, k)
            xy[row, slots[lying]], last[row] = ends[lying], ends[-1]
            struck[row] = any(len(slots) - 1 in (c.first, c.second) for c in outcome.contacts)
            time[row] = outcome.time
            outcomes[row], trajectories[row] = outcome, outcome.trajectories[-1]
        return _Played(xy, last, struck, time, {"outcome": outcomes, "trajectory": trajectories})

    def _observe(self) -> Singles:
        places, own, of_stones = self._places, self._own, self._of_stones[:, :-1]
        if places.shape[1] > 1:
            # Stones in play come first, in their order, as in the single environment.
            order = np.argsort(np.isnan(places[..., 0]), axis=1, kind="stable")
            places, own = np.take_along_axis(places, order[..., None], axis=1), own[order]
            of_stones = np.take_along_axis(of_stones, order[..., None], axis=1)
        to_come = np.where(self._played < self.single.throws, self._resting + self._played, -1)
        return self.single.observation.vector(
            target=self._targets,
            throws_left=1 - self._played / self.single.throws,
            clock=self._clock,
            known=self._known,
            next_stone=self._of_stones[np.arange(self.num_envs), to_come],
            stones=to_delivery(places, self._directions[:, None, None]),
            own=own,
            of_stones=of_stones,
        )

    def _target_info(self, rows: Indices) -> dict[str, Any]:
        """Target in both frames and direction of some sheets, for `info`."""
        direction = self._directions[rows]
        return {
            "target": to_sheet(self._targets[rows], direction[:, None]),
            "target_from_tee": self._targets[rows],
            "direction": DIRECTIONS[(direction < 0).astype(np.intp)],
        }


def _throw_alone(ice: Ice, releases: NDArray[Any], bounds: Floats) -> Positions:
    """What `play_batch` makes of throws on empty ice, without what happens among stones.

    So an environment of single throws need not compile that.
    """
    alone = throw_batch(ice, releases, bounds=bounds)
    last = np.stack([alone.x, alone.y], axis=-1)[:, None]
    gone = (alone.end == SlideEnd.LEFT_BOUNDS)[:, None]
    return Positions(
        xy=np.where(gone[..., None], np.nan, last),
        last=last,
        theta=np.where(gone, np.nan, alone.theta[:, None]),
        time=alone.time,
        collisions=np.where(alone.end == SlideEnd.NEVER_STOPS, -1, 0).astype(np.int32),
    )
