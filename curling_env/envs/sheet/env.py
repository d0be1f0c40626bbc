"""`CurlingSheet-v0`: one throw a step at a task, on a sheet that may hold stones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from curling_env.envs.sheet.action import ThrowRange, throw_range_for
from curling_env.envs.sheet.observation import SheetObservation, ice_features
from curling_env.envs.sheet.reset import Aim, End, ResetDistribution, Stones, reset_distribution
from curling_env.envs.sheet.reward import Landing, RewardWeights, judge
from curling_env.envs.sheet.tasks import Task, task_named
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.physics.engine import Engine, Outcome, Status, StoneState
from curling_env.physics.one_stone.step import QUICK
from curling_env.sheet import Direction, to_delivery, to_sheet
from curling_env.throw import Throw

if TYPE_CHECKING:
    from curling_env.render import DrawnScene, SheetRenderer
    from curling_env.render.window import PictureWindow

FIRST_OWN_STONE = 100
"""Identifiers of the agent's stones start here; stones that lay there before count from 0."""
HASTE = 8.0
"""Times as fast as it happens that a throw is shown in a window: a draw takes 25 s."""
AT_THE_END = 1e6
"""A time by which everything rests [s]."""
RESULT = {
    Status.REST: "at rest",
    Status.OUT_SIDE: "out, side line",
    Status.OUT_BACK: "out, back line",
    Status.HOGGED: "hogged",
}
"""Statuses in the words of a picture."""
WORD = {True: "made", False: "missed"}
"""Of a task, in the words of a picture."""
RENDER_MODES = ("rgb_array", "human")


class CurlingSheetEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Throw stones to do a task: a draw to a target unless another is asked for.

    Parameters
    ----------
    ice : the ice thrown on: an `Ice`, a file or a preset
    known_ice : the ice the agent is told of; the ice thrown on by default. With an estimated ice
        here and the true one in `ice`, an agent is tested on what it could not know
    task : "draw", "guard", "takeout", "hit_and_stay", "peel" or "freeze", or a `Task`; see `tasks`
    throws : throws in an episode; stones in play stay where they rest. A task with a given stone
        has one
    target : the task's mark, (x, y) in the delivery frame [m], (0, 0) the button: where a draw or
        a guard is to rest, or where the stone to take out or freeze to lies; "random", anywhere the
        task may be asked for; None, the task's own
    stones : others on the sheet before the first throw: positions (k, 2) in the delivery frame [m],
        or how many to lay at random
    level : None, or how hard positions are, 0 to 1: marks spread from the task's easiest to
        anywhere, and none to that share of `stones` lie about; may be set between episodes
    direction : the end played to: "away", "home" or "random"
    throw_range : throws that actions choose from; chosen for the known ice by default
    weights : of the parts of the reward
    fps : samples a second of the trajectory in `info`
    render_mode : "rgb_array", "human" (a window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : any of these that makes no sense

    Notes
    -----
    ``reset(options=…)`` takes `target`, `stones`, `direction` and `level` for one episode.

    ``step`` leaves in `info`: `throw`, `status`, `distance_m`, `in_house`, `success`,
    `reward_parts`,
    `trajectory` (of the delivered stone), `outcome` (of every stone), `target` (sheet frame),
    `direction`. A number of each part of the observation is named in `observation.names`.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 30}  # noqa: RUF012

    def __init__(
        self,
        ice: Ice | str | Path = "standard",
        *,
        known_ice: Ice | str | Path | None = None,
        task: str | Task = "draw",
        throws: int = 1,
        target: Aim = None,
        stones: Stones = (),
        direction: End = "away",
        level: float | None = None,
        throw_range: ThrowRange | None = None,
        weights: RewardWeights | None = None,
        fps: float = 10.0,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *RENDER_MODES):
            raise InputError(
                f"render_mode must be {', '.join(RENDER_MODES)} or None, got {render_mode!r}"
            )
        if throws < 1:
            raise InputError(f"an episode needs at least one throw, got {throws}")
        if not 0 < fps <= 1000:
            raise InputError(f"fps must lie above 0 and at most 1000, got {fps}")
        self.ice, self.task = load_ice(ice), task_named(task)
        if self.task.has_target_stone and throws > 1:
            raise InputError(f"the task {self.task.name} has one throw an episode, got {throws}")
        self.render_mode = render_mode
        self.engine = Engine(self.ice, tolerance=QUICK)  # as many sheets at once
        self.throws, self._fps = throws, fps
        self._choices: dict[str, Any] = {
            "target": target,
            "stones": stones,
            "direction": direction,
            "level": level,
        }
        self._reset_distribution = reset_distribution(self._choices, self.ice, self.task)
        resting = self._reset_distribution.stone_count
        self.observation = SheetObservation(slots=resting + throws, width=self.ice.sheet.width)
        self.weights = weights or self.task.weights
        known = self.ice if known_ice is None else load_ice(known_ice)
        # Chosen by what is known: the range itself would tell of the true ice.
        self.throw_range = throw_range or throw_range_for(known, Direction.AWAY, hits=resting > 0)
        self._known = {end: ice_features(known, end) for end in Direction}
        self.observation_space = spaces.Box(
            -1.0, 1.0, (len(self.observation.names),), dtype=np.float32
        )
        self.action_space = spaces.Box(-1.0, 1.0, (3,), dtype=np.float32)
        self._direction = Direction.AWAY
        self._target = np.zeros(2)
        self._stones: tuple[StoneState, ...] = ()
        self._clock, self._played = 0.0, 0
        self._before: tuple[StoneState, ...] = ()
        self._last: Outcome | None = None
        self._thrown: Throw | None = None
        self._distance_m, self._success = float("nan"), False
        self._pictures: dict[Direction, SheetRenderer] = {}
        self._viewer: PictureWindow | None = None

    def throw_of(self, action: ArrayLike) -> Throw:
        """The throw an action means."""
        return self.throw_range.throw_of(action)

    def action_of(self, throw: Throw) -> NDArray[np.float32]:
        """The action that means a throw; clipped where the throw is out of range."""
        return self.throw_range.action_of(throw)

    def known(self, direction: Direction) -> NDArray[np.float32]:
        """What the agent is told of the ice when playing to an end; see `knowledge`."""
        return self._known[direction]

    @property
    def level(self) -> float | None:
        """How hard positions are, 0 to 1; set, it holds from the next episode on.

        Raises
        ------
        InputError : set to what is no level
        """
        return self._reset_distribution.level

    @level.setter
    def level(self, level: float | None) -> None:
        choices = {**self._choices, "level": level}
        self._reset_distribution = reset_distribution(choices, self.ice, self.task)
        self._choices = choices

    def reset_distribution(self, options: dict[str, Any] | None = None) -> ResetDistribution:
        """What episodes begin with, given `reset`'s options.

        Raises
        ------
        InputError : an option that is none or makes no sense, more stones than there are places for
        """
        if not options:
            return self._reset_distribution
        chosen = reset_distribution({**self._choices, **options}, self.ice, self.task)
        if chosen.stone_count > self._reset_distribution.stone_count:
            raise InputError(
                f"this environment has places for {self._reset_distribution.stone_count} stones, "
                f"got {chosen.stone_count}; make it with that many"
            )
        return chosen

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Clear the sheet, lay the stones and choose the target."""
        super().reset(seed=seed)
        begin = self.reset_distribution(options).sample(self.np_random)
        self._direction, self._target = begin.direction, begin.target
        self._stones = tuple(
            StoneState(x=x, y=y, stone=k)
            for k, (x, y) in enumerate(to_sheet(begin.places, begin.direction).tolist())
        )
        self._clock, self._played, self._last = 0.0, 0, None
        if self.render_mode == "human":
            self._show()
        return self._observe(), self._place()

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Throw one stone."""
        throw = self.throw_of(action)
        release = throw.release(
            self._direction,
            stone=FIRST_OWN_STONE + self._played,
            clock=self._clock,
            order=self._played,
        )
        outcome = self.engine.play(release, self._stones, fps=self._fps, throw=self._played)
        self._played += 1
        self._clock += outcome.time
        self._before, self._stones = self._stones, outcome.in_play
        self._last, self._thrown = outcome, throw
        stone = outcome.delivered
        landing = Landing(
            stone=to_delivery((stone.x, stone.y), self._direction),
            in_play=np.bool_(outcome.delivered_status.in_play),
            target=self._target,
            target_stone=self._target_stone(self._stones),
            target_stone_before=self._target_stone(self._before),
            stone_radius=self.ice.stone.radius,
        )
        verdict = judge(landing, self.task.is_done(landing))
        self._distance_m, self._success = float(verdict.distance_m), bool(verdict.success)
        info = {
            **self._place(),
            "throw": throw,
            "status": outcome.delivered_status.value,
            "distance_m": self._distance_m,
            "in_house": bool(verdict.in_house),
            "success": self._success,
            "reward_parts": {name: float(part) for name, part in verdict.parts.as_dict().items()},
            "trajectory": outcome.trajectories[-1],
            "outcome": outcome,
        }
        if self.render_mode == "human":
            self._show()
        over = self._played >= self.throws
        return self._observe(), float(self.weights.total(verdict.parts)), over, False, info

    def render(self) -> NDArray[np.uint8] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The sheet from above as an RGB picture, with the last throw's path on it."""
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() needs a render_mode: gym.make('CurlingSheet-v0', render_mode='rgb_array')"
            )
            return None
        if self.render_mode == "human":
            return None
        from curling_env.render import scene_at

        picture, scene = self._sheet_picture(), self._scene()
        if self._last is not None:
            scene = scene_at(scene, self._before, self._last, AT_THE_END, _colour)
        return picture.draw(scene)

    def frames(self, speed: float = 1.0) -> Iterator[NDArray[np.uint8]]:
        """The last throw as a film: pictures at `metadata["render_fps"]`.

        Parameters
        ----------
        speed : times as fast as it happened
        """
        from curling_env.render import playback_frames

        picture, scene = self._sheet_picture(), self._scene()
        if self._last is None:
            yield picture.draw(scene)
            return
        fps = float(self.metadata["render_fps"])
        yield from playback_frames(
            picture, scene, self._before, self._last, _colour, fps=fps, speed=speed
        )

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    # --- the parts -----------------------------------------------------------------------------

    def _observe(self) -> NDArray[np.float32]:
        places = np.array([(stone.x, stone.y) for stone in self._stones]).reshape(-1, 2)
        return self.observation.vector(
            target=self._target,
            throws_left=1 - self._played / self.throws,
            known=self.known(self._direction),
            stones=to_delivery(places, self._direction),
            own=[stone.stone >= FIRST_OWN_STONE for stone in self._stones],
        )

    def _target_stone(self, stones: tuple[StoneState, ...]) -> NDArray[np.float64]:
        """Where the task's given stone lies, (2,) delivery frame; NaN where there is none."""
        first = stones[0] if self.task.has_target_stone and stones else None
        if first is None or first.stone != 0:
            return np.full(2, np.nan)
        return to_delivery((first.x, first.y), self._direction)

    def _place(self) -> dict[str, Any]:
        return {
            "target": to_sheet(self._target, self._direction),
            "direction": self._direction,
        }

    def _show(self) -> None:
        """In the window: the last throw as it happened, or the sheet as it lies."""
        from curling_env.render.window import PictureWindow

        picture = self._sheet_picture()
        if self._viewer is None:
            self._viewer = PictureWindow(
                picture.size, "CurlingSheet-v0", self.metadata["render_fps"]
            )
        if self._last is None:
            self._viewer.show(picture.draw(self._scene()))
            return
        for frame in self.frames(speed=HASTE):
            self._viewer.show(frame)

    def _sheet_picture(self) -> SheetRenderer:
        from curling_env.render import SheetRenderer

        if self._direction not in self._pictures:
            self._pictures[self._direction] = SheetRenderer(self.ice, self._direction)
        return self._pictures[self._direction]

    def _scene(self) -> DrawnScene:
        """What there is to say of the last throw."""
        from curling_env.render import DrawnScene, drawn_stones

        end = self._direction.name.lower()
        number = f"throw {max(self._played, 1)} of {self.throws}" if self.throws > 1 else "throw"
        facts: list[tuple[str, str]] = []
        if self._last is not None and self._thrown is not None:
            facts = [
                ("Speed", f"{self._thrown.speed:.2f} m/s"),
                ("Line", _signed(np.degrees(self._thrown.angle), "°")),
                ("Spin", _signed(self._thrown.spin, " rad/s")),
                ("Time", f"{self._last.time:.1f} s"),
                ("From target", f"{self._distance_m:.2f} m"),
                ("Result", RESULT[self._last.delivered_status]),
                (self.task.name.replace("_", " ").capitalize(), WORD[self._success]),
            ]
        return DrawnScene(
            stones=drawn_stones(self._stones, _colour),
            target=to_sheet(self._target, self._direction),
            title=f"CurlingSheet, {number} to the {end} end",
            facts=facts,
        )


def _signed(value: float, unit: str) -> str:
    return f"{value:+.2f}{unit}".replace("-", "−")


def _colour(stone: int) -> tuple[int, int, int]:
    """Handles: the agent's stones are red, the others yellow."""
    from curling_env.render import RED, YELLOW

    return RED if stone >= FIRST_OWN_STONE else YELLOW
