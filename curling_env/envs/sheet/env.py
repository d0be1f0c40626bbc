"""`CurlingSheet-v0`: one throw a step at a task, on a sheet that may hold stones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from curling_env.envs.ices import EpisodeIces, IceOption
from curling_env.envs.options import (
    dataclass_from,
    delivery_from,
    number,
    reset_options,
    skill_from,
    whole_number,
)
from curling_env.envs.rendering import FILM_SPEED, FPS, RENDER_MODES, check_render_mode
from curling_env.envs.sheet.action import ThrowRange, widest_range
from curling_env.envs.sheet.observation import SheetObservation
from curling_env.envs.sheet.rendering import LastThrow, SheetEnvRenderer, Shown
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
from curling_env.infrastructure.keywords import knows_its_options
from curling_env.physics.engine import Engine, StoneState
from curling_env.physics.tuning import QUICK_TOLERANCE
from curling_env.sheet import Direction, to_delivery, to_sheet
from curling_env.throw import MAX_SPEED, MAX_SPIN, MIN_SPEED, Delivery, Skill, Throw
from curling_env.typing import Floats, Image, Singles


def engine_for(ice: Ice) -> Engine:
    """The engine of a single environment, as exact as that of many side by side."""
    return Engine(ice, tolerance=QUICK_TOLERANCE)


@knows_its_options("CurlingSheet-v0")
class CurlingSheetEnv(gymnasium.Env[Singles, Singles]):
    """Throw stones to do a task: a draw to the button unless another task is asked for.

    Parameters
    ----------
    ice : the ice thrown on: an `Ice`, a file or a preset. May be set between episodes
    known_ice : the ice as the agent knows it; the ice thrown on by default. With an estimated ice
        here and the true one in `ice`, an agent is tested on what it could not know
    ices : ices of which every episode draws its own, and what is known of each, instead of `ice`: a
        list, a folder, the fields of `RandomIces`, a distribution or a function; see `ices`
    ice_sigma : whether every episode is thrown on another ice, drawn from those that the standard
        errors of `ice` allow. What is known stays as it is
    skill : player whose execution error is added to the throws: a name, a `Skill`, or its fields
    task : "draw", "guard", "takeout", "hit_and_stay", "peel", "freeze", the name of a task that a
        package declares, ``module:Class``, or a `Task`; see `tasks`
    throws : number of throws in an episode; stones in play stay where they rest. A task with a
        target stone has one throw
    target : the task's goal, (x, y) in the delivery frame [m], (0, 0) being the button: where a
        draw or a guard should rest, or where the target stone lies; "random" for anywhere the task
        may be set; None for the task's own
    stones : other stones on the sheet before the first throw: positions (k, 2) in the delivery
        frame [m], or how many to lay at random
    direction : the end played to: "away", "home" or "random"
    delivery : where throws begin: "hog-line", "tee-line", "hack" or a `Delivery`
    level : difficulty of the positions, 0 to 1: goals spread from the task's easiest goal to
        anywhere, and up to that share of `stones` lie on the sheet. None for positions as asked
        for. May be set between episodes
    throw_range : the throws that actions choose from, or the fields of a `ThrowRange`; by default
        chosen for the known ice, or for those of `ices` together
    weights : weights of the parts of the reward, or those that differ; by default the task's own
    fps : samples a second of the trajectory in `info`
    render_mode : "rgb_array", "rgb_array_list" (pictures of a film of what happened), "human" (a
        window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an option that makes no sense

    Notes
    -----
    ``reset(options=…)`` takes `target`, `stones`, `direction`, `level`, `ice` and `known_ice` for
    one episode.

    ``step`` leaves in `info`: `throw` (as it left the hand), `status`, `distance_m`, `in_house`,
    `success`, `reward_parts`, `trajectory` (of the delivered stone), `outcome` (of every stone),
    `target` (sheet frame), `target_from_tee` (delivery frame, as the option) and `direction`.
    `observation.names` names every number of an observation.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": FPS}  # noqa: RUF012

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
        render_mode: str | None = None,
    ) -> None:
        check_render_mode(render_mode)
        self.throws = whole_number("throws", throws)
        if self.throws < 1:
            raise InputError(f"an episode needs at least one throw, got {throws}")
        self._fps = number("fps", fps, above=0.0, most=1000.0)
        self.task = task_named(task)
        if self.task.has_target_stone and throws > 1:
            raise InputError(f"the task {self.task.name} has one throw an episode, got {throws}")
        self.ices = EpisodeIces(ice, known_ice, ices, ice_sigma=ice_sigma)
        self.skill = skill_from("skill", skill)
        self.render_mode = render_mode
        self._options: dict[str, Any] = {
            "target": target,
            "stones": stones,
            "direction": direction,
            "level": level,
        }
        self._distribution = reset_distribution(self._options, self.ice, self.task)
        check_level_counts(self._options)
        resting = self._distribution.stone_count
        self.observation = SheetObservation(slots=resting + throws, width=self.ice.sheet.width)
        self.weights = self.task.weights
        if weights is not None:
            if isinstance(weights, Mapping):
                weights = {**asdict(self.task.weights), **weights}
            self.weights = dataclass_from(RewardWeights, "weights", weights)
        self.delivery = delivery_from(delivery)
        # Chosen for the known ice: a range chosen for the true ice would give it away.
        self.throw_range = (
            widest_range(self.ices.known, hits=resting > 0, delivery=self.delivery)
            if throw_range is None
            else dataclass_from(ThrowRange, "throw_range", throw_range)
        )
        self.observation_space = spaces.Box(
            -1.0, 1.0, (len(self.observation.names),), dtype=np.float32
        )
        self.action_space = spaces.Box(-1.0, 1.0, (3,), dtype=np.float32)
        self.engine = engine_for(self.ice)
        self._known = self.ices.known_as(self.ices.known[0])
        self._direction = Direction.AWAY
        self._target = np.zeros(2)
        self._stones: tuple[StoneState, ...] = ()
        self._clock, self._played = 0.0, 0
        self._is_on: bool | None = None
        self._last: LastThrow | None = None
        self._film: list[Shown] = []
        self._renderer = SheetEnvRenderer(self.ice)

    # --- the ice ---------------------------------------------------------------------------------

    @property
    def ice(self) -> Ice:
        """The ice of the environment; another one set here holds for episodes that begin later."""
        return self.ices.usual

    @ice.setter
    def ice(self, ice: IceOption) -> None:
        self.ices.usual = ice

    @property
    def thrown_ice(self) -> Ice:
        """The ice that is thrown on in this episode."""
        return self.engine.ice

    @property
    def known_ice(self) -> Ice:
        """The ice as the agent knows it in this episode."""
        return self._known.ice

    @property
    def ice_sigma(self) -> bool:
        """Whether every episode has an ice that the standard errors of the ice allow."""
        return self.ices.has_sigma

    @property
    def target(self) -> Floats:
        """Where the delivered stone should go in this episode, (2,) delivery frame [m]."""
        return self._target.copy()

    @property
    def direction(self) -> Direction:
        """The end played to in this episode."""
        return self._direction

    @property
    def places(self) -> Floats:
        """Where the stones lie, the task's target stone first, (k, 2) sheet frame [m]."""
        return np.array([(stone.x, stone.y) for stone in self._stones]).reshape(-1, 2)

    def ice_features(self, direction: Direction) -> Singles:
        """What the agent knows of the ice when it plays to an end; see `KnownIce.features`."""
        return self._known.features(direction)

    # --- throws and episodes ---------------------------------------------------------------------

    def throw_of(self, action: ArrayLike) -> Throw:
        """The throw an action means."""
        return self.throw_range.throw_of(action)

    def action_of(self, throw: Throw) -> Singles:
        """The action that means a throw; clipped where the throw is out of range."""
        return self.throw_range.action_of(throw)

    def thrown(self, numbers: Floats, rngs: list[np.random.Generator]) -> Floats:
        """Throws as they leave the hand, with the player's execution error.

        Parameters
        ----------
        numbers : (n, 3) speed [m/s], angle [rad] and spin [rad/s] as they were meant
        rngs : the source of each throw's error
        """
        if self.skill.is_exact:
            return numbers
        thrown = numbers + np.array([self.skill.error(rng) for rng in rngs])
        thrown[:, 0] = np.clip(thrown[:, 0], MIN_SPEED, MAX_SPEED)
        thrown[:, 2] = np.clip(thrown[:, 2], -MAX_SPIN, MAX_SPIN)
        return thrown

    @property
    def level(self) -> float | None:
        """Difficulty of the positions, 0 to 1; a new value holds from the next episode on.

        Raises
        ------
        InputError : a value that is no level
        """
        return self._distribution.level

    @level.setter
    def level(self, level: float | None) -> None:
        options = {**self._options, "level": level}
        self._distribution = reset_distribution(options, self.ice, self.task)
        self._options = options

    def reset_distribution(self, options: dict[str, Any] | None = None) -> ResetDistribution:
        """The distribution of initial states, given `reset`'s options.

        Raises
        ------
        InputError : an option that is unknown or makes no sense, or more stones than there are
            places for
        """
        if not options:
            return self._distribution
        chosen = reset_distribution({**self._options, **options}, self.ice, self.task)
        places = self._distribution.stone_count
        if chosen.stone_count > places:
            raise InputError(
                f"this environment has places for {places} stones, got {chosen.stone_count}; "
                "make it with that many"
            )
        return chosen

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Singles, dict[str, Any]]:
        """Clear the sheet, lay the stones and choose the target."""
        super().reset(seed=None if seed is None else whole_number("seed", seed, least=0))
        asked = reset_options(options, RESET_OPTIONS)
        given = self.ices.given(asked)
        distribution = self.reset_distribution(asked)
        ice, self._known = self.ices.draw(self.np_random, given)
        if ice is not self.engine.ice:
            self.engine = engine_for(ice)
            self._renderer.ice = ice
        initial = distribution.on(ice).sample(self.np_random)
        self._direction, self._target = initial.direction, initial.target
        self._stones = tuple(
            StoneState(x=x, y=y, stone=k)
            for k, (x, y) in enumerate(to_sheet(initial.places, initial.direction).tolist())
        )
        self._clock, self._played, self._last = 0.0, 0, None
        self._is_on = True
        self._show(anew=True)
        return self._observe(), self._target_info()

    def step(self, action: Singles) -> tuple[Singles, float, bool, bool, dict[str, Any]]:
        """Throw one stone.

        Raises
        ------
        InputError : before the first reset, after the end of the episode, or not three finite
            numbers
        """
        if not self._is_on:
            never = self._is_on is None
            raise InputError(
                "call reset() before the first step"
                if never
                else "the episode is over; call reset()"
            )
        throw = self.throw_of(action)
        if not self.skill.is_exact:
            meant = np.array([[throw.speed, throw.angle, throw.spin]])
            speed, angle, spin = self.thrown(meant, [self.np_random])[0].tolist()
            throw = Throw(speed=speed, angle=angle, spin=spin)
        release = throw.release(
            self._direction,
            stone=FIRST_OWN_STONE + self._played,
            clock=self._clock,
            order=self._played,
            delivery=self.delivery,
        )
        outcome = self.engine.play(release, self._stones, fps=self._fps, throw=self._played)
        self._played += 1
        self._clock += outcome.time
        before, self._stones = self._stones, outcome.in_play
        stone = outcome.delivered
        landing = Landing(
            stone=to_delivery((stone.x, stone.y), self._direction),
            in_play=np.bool_(outcome.delivered_status.in_play),
            target=self._target,
            target_stone=self._target_stone(self._stones),
            target_stone_before=self._target_stone(before),
            stone_radius=self.thrown_ice.stone.radius,
        )
        verdict = judge(landing, self.task.is_done(landing))
        self._last = LastThrow(
            throw=throw,
            before=before,
            outcome=outcome,
            distance_m=float(verdict.distance_m),
            success=bool(verdict.success),
        )
        info = {
            **self._target_info(),
            "throw": throw,
            "status": outcome.delivered_status.value,
            "distance_m": self._last.distance_m,
            "in_house": bool(verdict.in_house),
            "success": self._last.success,
            "reward_parts": {name: float(part) for name, part in verdict.parts.as_dict().items()},
            "trajectory": outcome.trajectories[-1],
            "outcome": outcome,
        }
        terminated = self._played >= self.throws
        self._is_on = not terminated
        self._show()
        reward = float(self.weights.total(verdict.parts))
        return self._observe(), reward, terminated, False, info

    def render(self) -> Any:
        """The sheet from above as an RGB picture, with the last throw's path on it.

        With the render mode ``rgb_array_list``, the pictures of a film of what has happened since
        the last call, at `metadata["render_fps"]` a second and four times as fast as it was.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() needs a render_mode: gym.make('CurlingSheet-v0', render_mode='rgb_array')"
            )
        if self.render_mode == "rgb_array_list":
            shown, self._film = self._film, []
            return [frame for one in shown for frame in self._renderer.frames(one, FILM_SPEED)]
        if self.render_mode != "rgb_array":
            return None
        return self._renderer.picture(self._shown())

    def frames(self, speed: float = 1.0) -> Iterator[Image]:
        """The last throw as a film: pictures at `metadata["render_fps"]`.

        Parameters
        ----------
        speed : how many times faster than it happened the throw is shown
        """
        yield from self._renderer.frames(self._shown(), speed)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()

    # --- the parts -----------------------------------------------------------------------------

    def _observe(self) -> Singles:
        places = np.array([(stone.x, stone.y) for stone in self._stones]).reshape(-1, 2)
        lying = [stone.stone for stone in self._stones]
        to_come = [FIRST_OWN_STONE + self._played] if self._played < self.throws else []
        return self.observation.vector(
            target=self._target,
            throws_left=1 - self._played / self.throws,
            clock=self._clock,
            known=self.ice_features(self._direction),
            next_stone=self._known.of_stones(to_come).sum(axis=0),
            stones=to_delivery(places, self._direction),
            own=[stone >= FIRST_OWN_STONE for stone in lying],
            of_stones=self._known.of_stones(lying),
        )

    def _show(self, *, anew: bool = False) -> None:
        """Show what happened in the window, or keep it for a film."""
        if self.render_mode == "human":
            self._renderer.show(self._shown())
        elif self.render_mode == "rgb_array_list":
            self._film = [*([] if anew else self._film), self._shown()]

    def _target_stone(self, stones: tuple[StoneState, ...]) -> Floats:
        """Where the task's target stone lies, (2,) delivery frame; NaN where there is none."""
        first = stones[0] if self.task.has_target_stone and stones else None
        if first is None or first.stone != 0:
            return np.full(2, np.nan)
        return to_delivery((first.x, first.y), self._direction)

    def _target_info(self) -> dict[str, Any]:
        return {
            "target": to_sheet(self._target, self._direction),
            "target_from_tee": self._target.copy(),
            "direction": self._direction,
        }

    def _shown(self) -> Shown:
        return Shown(
            task=self.task.name,
            direction=self._direction,
            target=self._target,
            stones=self._stones,
            throw_number=max(self._played, 1),
            throws=self.throws,
            last=self._last,
        )
