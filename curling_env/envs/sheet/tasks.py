"""Tasks of a throw: draw, guard, takeout, hit and stay, peel, freeze.

A task defines its goal, a target stone there, the condition of success, and the weights of the
parts of the reward. One formula serves a single throw and arrays of many throws. Positions are in
the delivery frame.

A custom task is a class with the attributes and methods of `Task`, constructible without arguments.
Pass an object of it to the environment, name it as ``module:Class``, or declare it under the
entry-point group `curling.tasks`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, pi, sin, sqrt
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from curling_env.envs.sheet.reward import Landing, RewardWeights
from curling_env.errors import InputError
from curling_env.infrastructure.plugins import load_plugin, plugin_names
from curling_env.sheet import HOUSE_RADIUS, RING_RADII

TASK_GROUP = "curling.tasks"
"""Entry-point group of tasks: classes constructible without arguments, or objects."""

DRAW_RADIUS = RING_RADII[2]
"""Maximum distance from its target of a successful draw: the 4-foot ring's radius [m]."""
TARGET_STONE_SPREAD = 0.9 * HOUSE_RADIUS
"""Maximum distance of random target stones from the tee [m]."""

Shooter = Literal["any", "stays", "leaves"]


@runtime_checkable
class Task(Protocol):
    """The task of a throw."""

    @property
    def name(self) -> str:
        """Name of the task."""
        ...

    @property
    def has_target_stone(self) -> bool:
        """True if a stone is on the goal, to be hit or frozen to. It is the first of the sheet."""
        ...

    @property
    def easiest_goal(self) -> tuple[float, float]:
        """Goal (x, y) of the easiest position [m]."""
        ...

    @property
    def weights(self) -> RewardWeights:
        """Default weights of the parts of the reward."""
        ...

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """Draw a goal (x, y) [m].

        Parameters
        ----------
        level : difficulty, from 0 (always the easiest goal) to 1 (anywhere the task may be set)
        u, v : random numbers, uniform in [0, 1)
        """
        ...

    def target(self, goal: Any, stone_radius: float) -> Any:
        """Return the point at which the delivered stone should come to rest or hit, (2,) [m]."""
        ...

    def is_done(self, landing: Landing) -> Any:
        """Return whether the task was done, (...) for the throws (...) of `landing`."""
        ...


@dataclass(frozen=True, kw_only=True)
class DrawTask:
    """Come to rest near a place in the house.

    Parameters
    ----------
    radius : largest distance from the target at which the draw is made [m]
    """

    radius: float = DRAW_RADIUS
    name: str = "draw"
    has_target_stone: bool = False
    easiest_goal: tuple[float, float] = (0.0, 0.0)
    weights: RewardWeights = field(default_factory=RewardWeights)

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """Draw a place in the house; at level 1 in all of it."""
        return _in_disc(level * HOUSE_RADIUS, u, v)

    def target(self, goal: Any, stone_radius: float) -> Any:
        """Return the goal."""
        return goal

    def is_done(self, landing: Landing) -> Any:
        """Return true in play and near enough to the target."""
        return landing.in_play & (landing.distance_m <= self.radius)


@dataclass(frozen=True, kw_only=True)
class GuardTask:
    """Come to rest before the house, as cover for stones behind.

    The guard is made if the stone is in play before the house, at most a stone's width from the
    goal sideways, and near enough to it along play.

    Parameters
    ----------
    length_error : maximum distance of the guard from its target along the sheet [m]
    spread : largest distance of random goals from the easiest, sideways and along play [m]
    """

    length_error: float = 1.0
    spread: tuple[float, float] = (0.9, 1.2)
    name: str = "guard"
    has_target_stone: bool = False
    easiest_goal: tuple[float, float] = (0.0, -3.2)
    weights: RewardWeights = field(
        default_factory=lambda: RewardWeights(in_house=-0.5, success=1.0)
    )

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """Draw a place before the house, from centre to corner guards, long and short ones."""
        sideways, along = self.spread
        x, y = self.easiest_goal
        return x + level * sideways * (2 * u - 1), y + level * along * (2 * v - 1)

    def target(self, goal: Any, stone_radius: float) -> Any:
        """Return the goal."""
        return goal

    def is_done(self, landing: Landing) -> Any:
        """Return true in play, before the house, and near enough to the target sideways and along
        play.
        """
        off = np.abs(landing.stone - landing.target)
        return (
            landing.in_play
            & ~landing.in_house
            & (landing.stone[..., 1] < 0)
            & (off[..., 0] <= 2 * landing.stone_radius)
            & (off[..., 1] <= self.length_error)
        )


@dataclass(frozen=True, kw_only=True)
class TakeoutTask:
    """Put the target stone out of play.

    Parameters
    ----------
    shooter : what the delivered stone must also do: ``any`` thing, ``stays`` in play, or
        ``leaves`` play too
    """

    name: str = "takeout"
    shooter: Shooter = "any"
    has_target_stone: bool = True
    easiest_goal: tuple[float, float] = (0.0, 0.0)
    weights: RewardWeights = field(
        default_factory=lambda: RewardWeights(
            distance=0.25, precision=0.0, in_house=0.0, out_of_play=0.0, removed=2.0, success=1.0
        )
    )

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """Draw a place in the house; at level 1 in nearly all of it."""
        return _in_disc(level * TARGET_STONE_SPREAD, u, v)

    def target(self, goal: Any, stone_radius: float) -> Any:
        """Return the place of the target stone."""
        return goal

    def is_done(self, landing: Landing) -> Any:
        """Return true if the target stone is out of play and the delivered stone meets its
        condition.
        """
        if self.shooter == "stays":
            return landing.is_out & landing.in_play
        if self.shooter == "leaves":
            return landing.is_out & ~landing.in_play
        return landing.is_out


@dataclass(frozen=True, kw_only=True)
class FreezeTask:
    """Come to rest against the target stone, on the thrower's side of it.

    The freeze is made if the stone is in play and nearer to the thrower than the target stone, the
    gap between them is small, and the target stone was hardly pushed.

    Parameters
    ----------
    max_gap : largest gap between the stones, half a stone's width [m]
    max_push : largest distance that the target stone may be pushed, a stone's width [m]
    """

    max_gap: float = 0.15
    max_push: float = 0.3
    name: str = "freeze"
    has_target_stone: bool = True
    easiest_goal: tuple[float, float] = (0.0, 0.0)
    weights: RewardWeights = field(default_factory=lambda: RewardWeights(removed=-1.0, success=1.0))

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """Draw a place in the house; at level 1 in nearly all of it."""
        return _in_disc(level * TARGET_STONE_SPREAD, u, v)

    def target(self, goal: Any, stone_radius: float) -> Any:
        """Return the place straight before the target stone where both touch."""
        return np.asarray(goal) - np.array([0.0, 2 * stone_radius])

    def is_done(self, landing: Landing) -> Any:
        """Return true in play, before the target stone and near enough, with the target stone
        hardly pushed.
        """
        return (
            landing.in_play
            & (landing.stone[..., 1] < landing.target_stone[..., 1])
            & (landing.gap <= self.max_gap)
            & (landing.pushed <= self.max_push)
        )


def _in_disc(radius: float, u: float, v: float) -> tuple[float, float]:
    """Return a point of a disc about the tee, uniformly distributed if u and v are."""
    distance, turn = radius * sqrt(u), 2 * pi * v
    return distance * cos(turn), distance * sin(turn)


def _takeout_with(name: str, shooter: Shooter, out_of_play: float) -> TakeoutTask:
    """Return a takeout with a condition on the delivered stone and a weight of its leaving play."""
    weights = RewardWeights(
        distance=0.25,
        precision=0.0,
        in_house=0.0,
        out_of_play=out_of_play,
        removed=2.0,
        success=1.0,
    )
    return TakeoutTask(name=name, shooter=shooter, weights=weights)


TASKS: dict[str, Task] = {
    task.name: task
    for task in (
        DrawTask(),
        GuardTask(),
        TakeoutTask(),
        _takeout_with("hit_and_stay", "stays", 0.5),
        _takeout_with("peel", "leaves", -0.5),
        FreezeTask(),
    )
}
"""Built-in tasks by name."""


def task_names() -> list[str]:
    """Return the names of the tasks: built-in ones, then those of installed packages."""
    return [*TASKS, *(name for name in plugin_names(TASK_GROUP) if name not in TASKS)]


def task_named(name: str | Task) -> Task:
    """Return the task of that name; a `Task` is returned unchanged.

    Parameters
    ----------
    name : a name in `task_names`, where a hyphen serves for an underscore, or ``module:Class``

    Raises
    ------
    InputError : an unknown name, or an object that is not a task
    """
    if not isinstance(name, str):
        task = name
    elif (own := TASKS.get(name.replace("-", "_"))) is not None:
        task = own
    else:
        found = load_plugin("task", TASK_GROUP, name, built_in=TASKS)
        task = found() if isinstance(found, type) else found
    if not isinstance(task, Task):  # pyright: ignore[reportUnnecessaryIsInstance]  (from outside)
        parts = [part for part in vars(Task) if not part.startswith("_")]
        missing = next(part for part in parts if not hasattr(task, part))
        raise InputError(
            f"{str(name)[:60]!r} is not a task (it has no {missing}); expected one of "
            f"{', '.join(task_names())}, module:Class, or a Task"
        )
    return task
