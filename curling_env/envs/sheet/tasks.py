"""What a throw is asked to do: draw, guard, takeout, freeze.

A task says where its mark lies, whether a stone is given there, what counts as done, and how the
parts of the reward weigh. Everything works on one throw or on arrays of many, so that one sheet
and many sheets share it. Positions are in the delivery frame.

A task of one's own is an object with the attributes and methods of `Task`, handed to the
environment in place of a name.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, pi, sin, sqrt
from typing import Any, Literal, Protocol

import numpy as np

from curling_env.envs.sheet.reward import Landing, RewardWeights
from curling_env.errors import InputError
from curling_env.sheet import HOUSE_RADIUS, RING_RADII

DRAW_RADIUS = RING_RADII[2]
"""Distance from its target at which a draw still counts as made: the 4-foot ring's radius [m]."""
GUARD_GOAL = (0.0, -3.2)
"""A centre guard, about a stone and a half's roll before the house [m]."""
GUARD_SPREAD = (0.9, 1.2)
"""How far to the sides and along play guards are asked for: corner guards, long and tight [m]."""
GUARD_LENGTH = 1.0
"""How much longer or tighter than asked a guard may lie: a choice [m]."""
FREEZE_GAP = 0.15
"""Widest gap between frozen stones, half a stone's width: a choice [m]."""
FREEZE_DRIVEN = 0.3
"""Farthest that a freeze may drive the given stone back, a stone's width: a choice [m]."""
GIVEN_SPREAD = 0.9 * HOUSE_RADIUS
"""Radius about the tee within which stones are given to take out or freeze to [m]."""

Shooter = Literal["any", "stays", "leaves"]


class Task(Protocol):
    """What a throw is asked to do."""

    @property
    def name(self) -> str:
        """By which it is asked for."""
        ...

    @property
    def has_target_stone(self) -> bool:
        """Whether a stone is given: it lies on the mark, and counts as the sheet's first."""
        ...

    @property
    def easiest_goal(self) -> tuple[float, float]:
        """The mark of the easiest position [m]."""
        ...

    @property
    def weights(self) -> RewardWeights:
        """Of the parts of the reward, unless others are asked for."""
        ...

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """A mark at random.

        Parameters
        ----------
        level : 0 (always the centre) to 1 (anywhere the task may be asked for)
        u, v : evenly distributed in [0, 1)
        """
        ...

    def target(self, goal: Any, radius: float) -> Any:
        """Where the delivered stone is to end, (2,), given the mark and a stone's radius [m]."""
        ...

    def is_done(self, landing: Landing) -> Any:
        """Whether the task was done, (...)."""
        ...


@dataclass(frozen=True, kw_only=True)
class DrawTask:
    """Come to rest at a place in the house: within the 4-foot ring's radius of it."""

    name: str = "draw"
    has_target_stone: bool = False
    easiest_goal: tuple[float, float] = (0.0, 0.0)
    weights: RewardWeights = field(default_factory=RewardWeights)

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """Anywhere in the house at level 1."""
        return _in_disc(level * HOUSE_RADIUS, u, v)

    def target(self, goal: Any, radius: float) -> Any:
        """The mark itself."""
        return goal

    def is_done(self, landing: Landing) -> Any:
        """In play and near enough."""
        return landing.in_play & (landing.distance_m <= DRAW_RADIUS)


@dataclass(frozen=True, kw_only=True)
class GuardTask:
    """Come to rest before the house, covering a line down the sheet.

    Done: in play, clear of the house on its near side, within a stone's width of the mark to the
    side and within 1 m of it along play.
    """

    name: str = "guard"
    has_target_stone: bool = False
    easiest_goal: tuple[float, float] = GUARD_GOAL
    weights: RewardWeights = field(
        default_factory=lambda: RewardWeights(in_house=-0.5, success=1.0)
    )

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """From centre guards to corner guards, from long to tight ones."""
        aside, along = GUARD_SPREAD
        x, y = self.easiest_goal
        return x + level * aside * (2 * u - 1), y + level * along * (2 * v - 1)

    def target(self, goal: Any, radius: float) -> Any:
        """The mark itself."""
        return goal

    def is_done(self, landing: Landing) -> Any:
        """In play, before the house, on the line and near enough along it."""
        off = np.abs(landing.stone - landing.target)
        return (
            landing.in_play
            & ~landing.in_house
            & (landing.stone[..., 1] < 0)
            & (off[..., 0] <= 2 * landing.stone_radius)
            & (off[..., 1] <= GUARD_LENGTH)
        )


@dataclass(frozen=True, kw_only=True)
class TakeoutTask:
    """Put the given stone out of play.

    Parameters
    ----------
    shooter : what is asked of the delivered stone besides: ``any``thing, that it ``stays`` in play,
        or that it ``leaves`` too
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
        """Anywhere in the house at level 1."""
        return _in_disc(level * GIVEN_SPREAD, u, v)

    def target(self, goal: Any, radius: float) -> Any:
        """Where the given stone lies."""
        return goal

    def is_done(self, landing: Landing) -> Any:
        """The given stone out, and the delivered one as it should be."""
        if self.shooter == "stays":
            return landing.is_out & landing.in_play
        if self.shooter == "leaves":
            return landing.is_out & ~landing.in_play
        return landing.is_out


@dataclass(frozen=True, kw_only=True)
class FreezeTask:
    """Come to rest against the given stone, on the thrower's side of it.

    Done: in play, nearer to the thrower than the given stone, at most 0.15 m from touching it, and
    the given stone driven back by no more than 0.3 m.
    """

    name: str = "freeze"
    has_target_stone: bool = True
    easiest_goal: tuple[float, float] = (0.0, 0.0)
    weights: RewardWeights = field(default_factory=lambda: RewardWeights(removed=-1.0, success=1.0))

    def sample_goal(self, level: float, u: float, v: float) -> tuple[float, float]:
        """Anywhere in the house at level 1."""
        return _in_disc(level * GIVEN_SPREAD, u, v)

    def target(self, goal: Any, radius: float) -> Any:
        """Touching the given stone, straight before it."""
        return np.asarray(goal) - np.array([0.0, 2 * radius])

    def is_done(self, landing: Landing) -> Any:
        """In play, in front, near enough, and the given stone about where it was."""
        return (
            landing.in_play
            & (landing.stone[..., 1] < landing.target_stone[..., 1])
            & (landing.gap <= FREEZE_GAP)
            & (landing.driven <= FREEZE_DRIVEN)
        )


def _in_disc(reach: float, u: float, v: float) -> tuple[float, float]:
    """Evenly distributed over a disc about the tee."""
    radius, turn = reach * sqrt(u), 2 * pi * v
    return radius * cos(turn), radius * sin(turn)


def _hit(name: str, shooter: Shooter, out_of_play: float) -> TakeoutTask:
    """A takeout that asks something of the shooter, and rewards it on the way there."""
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
        _hit("hit_and_stay", "stays", 0.5),
        _hit("peel", "leaves", -0.5),
        FreezeTask(),
    )
}
"""Tasks by name."""


def task_named(name: str | Task) -> Task:
    """The task of that name; a `Task` is returned as it is.

    Raises
    ------
    InputError : a name that is not in `TASKS`
    """
    if not isinstance(name, str):
        return name
    if name not in TASKS:
        raise InputError(f"no task is named {name!r}; there are {', '.join(TASKS)}")
    return TASKS[name]
