"""`CurlingSheet-v0`: one throw a step at a task, on a sheet that may hold stones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from curling_env.envs.rendering import FPS, RENDER_MODES, check_render_mode
from curling_env.envs.sheet.action import ThrowRange, throw_range_for
from curling_env.envs.sheet.observation import SheetObservation, ice_features
from curling_env.envs.sheet.rendering import LastThrow, SheetEnvRenderer, Shown
from curling_env.envs.sheet.reset import (
    FIRST_OWN_STONE,
    DirectionOption,
    ResetDistribution,
    StonesOption,
    TargetOption,
    reset_distribution,
)
from curling_env.envs.sheet.reward import Landing, RewardWeights, judge
from curling_env.envs.sheet.tasks import Task, task_named
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.physics.ice_uncertainty import is_uncertain, plausible_ices
from curling_env.physics.many_stones.engine import Engine, StoneState
from curling_env.physics.one_stone.tuning import QUICK_TOLERANCE
from curling_env.sheet import Direction, to_delivery, to_sheet
from curling_env.throw import Delivery, Throw, delivery_named
from curling_env.typing import Floats, Image, Singles


def engine_for(ice: Ice) -> Engine:
    """The engine of a single environment, as exact as that of many side by side."""
    return Engine(ice, tolerance=QUICK_TOLERANCE)


class CurlingSheetEnv(gymnasium.Env[Singles, Singles]):
    """Throw stones to do a task: a draw to the button unless another task is asked for.

    Parameters
    ----------
    ice : the ice thrown on: an `Ice`, a file or a preset
    known_ice : the ice as the agent knows it; the ice thrown on by default. With an estimated ice
        here and the true one in `ice`, an agent is tested on what it could not know
    ice_sigma : whether every episode is thrown on another ice, drawn from those that the standard
        errors of `ice` allow; `thrown_ice` is the present one. The known ice stays as it is
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
    delivery : where throws begin: "hog-line", "hack" or a `Delivery`
    level : difficulty of the positions, 0 to 1: goals spread from the task's easiest goal to
        anywhere, and up to that share of `stones` lie on the sheet. None for positions as asked
        for. May be set between episodes
    throw_range : the throws that actions choose from; by default chosen for the known ice
    weights : weights of the parts of the reward; by default the task's own
    fps : samples a second of the trajectory in `info`
    render_mode : "rgb_array", "human" (a window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an option that makes no sense

    Notes
    -----
    ``reset(options=…)`` takes `target`, `stones`, `direction` and `level` for one episode.

    ``step`` leaves in `info`: `throw`, `status`, `distance_m`, `in_house`, `success`,
    `reward_parts`, `trajectory` (of the delivered stone), `outcome` (of every stone), `target`
    (sheet frame) and `direction`. `observation.names` names every number of an observation.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": FPS}  # noqa: RUF012

    def __init__(
        self,
        ice: Ice | str | Path = "standard",
        *,
        known_ice: Ice | str | Path | None = None,
        ice_sigma: bool = False,
        task: str | Task = "draw",
        throws: int = 1,
        target: TargetOption = None,
        stones: StonesOption = (),
        direction: DirectionOption = "away",
        delivery: str | Delivery = "hog-line",
        level: float | None = None,
        throw_range: ThrowRange | None = None,
        weights: RewardWeights | None = None,
        fps: float = 10.0,
        render_mode: str | None = None,
    ) -> None:
        check_render_mode(render_mode)
        if throws < 1:
            raise InputError(f"an episode needs at least one throw, got {throws}")
        if not 0 < fps <= 1000:
            raise InputError(f"fps must lie above 0 and at most 1000, got {fps}")
        self.ice, self.task = load_ice(ice), task_named(task)
        if self.task.has_target_stone and throws > 1:
            raise InputError(f"the task {self.task.name} has one throw an episode, got {throws}")
        if ice_sigma and not is_uncertain(self.ice):
            raise InputError("ice_sigma draws ices from standard errors, and this ice has none")
        self.ice_sigma = ice_sigma
        self.render_mode = render_mode
        self.engine = engine_for(self.ice)
        self.throws, self._fps = throws, fps
        self._options: dict[str, Any] = {
            "target": target,
            "stones": stones,
            "direction": direction,
            "level": level,
        }
        self._distribution = reset_distribution(self._options, self.ice, self.task)
        resting = self._distribution.stone_count
        self.observation = SheetObservation(slots=resting + throws, width=self.ice.sheet.width)
        self.weights = weights or self.task.weights
        known = self.ice if known_ice is None else load_ice(known_ice)
        # Chosen for the known ice: a range chosen for the true ice would give it away.
        self.delivery = delivery_named(delivery)
        self.throw_range = throw_range or throw_range_for(
            known, Direction.AWAY, hits=resting > 0, delivery=self.delivery
        )
        self._ice_features = {end: ice_features(known, end) for end in Direction}
        self.observation_space = spaces.Box(
            -1.0, 1.0, (len(self.observation.names),), dtype=np.float32
        )
        self.action_space = spaces.Box(-1.0, 1.0, (3,), dtype=np.float32)
        self._direction = Direction.AWAY
        self._target = np.zeros(2)
        self._stones: tuple[StoneState, ...] = ()
        self._clock, self._played = 0.0, 0
        self._last: LastThrow | None = None
        self._renderer = SheetEnvRenderer(self.ice)

    def throw_of(self, action: ArrayLike) -> Throw:
        """The throw an action means."""
        return self.throw_range.throw_of(action)

    def action_of(self, throw: Throw) -> Singles:
        """The action that means a throw; clipped where the throw is out of range."""
        return self.throw_range.action_of(throw)

    def ice_features(self, direction: Direction) -> Singles:
        """What the agent knows of the ice when it plays to an end; see `ice_features`."""
        return self._ice_features[direction]

    @property
    def thrown_ice(self) -> Ice:
        """The ice that is thrown on in this episode."""
        return self.engine.ice

    def draw_ice(self, rng: np.random.Generator) -> Ice:
        """Another ice that the standard errors of the ice allow."""
        return plausible_ices(self.ice, 1, rng)[0]

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
        super().reset(seed=seed)
        initial = self.reset_distribution(options).sample(self.np_random)
        self._direction, self._target = initial.direction, initial.target
        if self.ice_sigma:
            self.engine = engine_for(self.draw_ice(self.np_random))
        self._stones = tuple(
            StoneState(x=x, y=y, stone=k)
            for k, (x, y) in enumerate(to_sheet(initial.places, initial.direction).tolist())
        )
        self._clock, self._played, self._last = 0.0, 0, None
        if self.render_mode == "human":
            self._renderer.show(self._shown())
        return self._observe(), self._target_info()

    def step(self, action: Singles) -> tuple[Singles, float, bool, bool, dict[str, Any]]:
        """Throw one stone."""
        throw = self.throw_of(action)
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
            stone_radius=self.ice.stone.radius,
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
        if self.render_mode == "human":
            self._renderer.show(self._shown())
        terminated = self._played >= self.throws
        reward = float(self.weights.total(verdict.parts))
        return self._observe(), reward, terminated, False, info

    def render(self) -> Image | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The sheet from above as an RGB picture, with the last throw's path on it."""
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() needs a render_mode: gym.make('CurlingSheet-v0', render_mode='rgb_array')"
            )
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
        return self.observation.vector(
            target=self._target,
            throws_left=1 - self._played / self.throws,
            known=self.ice_features(self._direction),
            stones=to_delivery(places, self._direction),
            own=[stone.stone >= FIRST_OWN_STONE for stone in self._stones],
        )

    def _target_stone(self, stones: tuple[StoneState, ...]) -> Floats:
        """Where the task's target stone lies, (2,) delivery frame; NaN where there is none."""
        first = stones[0] if self.task.has_target_stone and stones else None
        if first is None or first.stone != 0:
            return np.full(2, np.nan)
        return to_delivery((first.x, first.y), self._direction)

    def _target_info(self) -> dict[str, Any]:
        return {
            "target": to_sheet(self._target, self._direction),
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
