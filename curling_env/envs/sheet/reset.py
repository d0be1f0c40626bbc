"""How an episode of `CurlingSheet-v0` begins: the end played to, the target, stones on the sheet.

What is asked for is parsed once and drawn for every episode.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from curling_env.envs.sheet.tasks import Task
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.one_stone.slide import play_bounds
from curling_env.sheet import HOG_TO_TEE, Direction, to_sheet
from curling_env.typing import Floats

Aim = Literal["random"] | Sequence[float] | ArrayLike | None
Stones = int | Sequence[Sequence[float]] | ArrayLike
End = Direction | Literal["away", "home", "random"]

LIKELY = ((-1.6, 1.6), (-4.0, 1.6))
"""Where random stones lie, delivery frame: x and y ranges, the house and the guards [m]."""
APART = 0.02
"""Least gap between random stones [m]."""
TRIES = 100
"""Places tried for each random stone before the house counts as full."""
CHOICES = ("target", "stones", "direction", "level")
"""What may be chosen anew with ``reset(options=…)``."""


class InitialState(NamedTuple):
    """One episode's beginning.

    Parameters
    ----------
    direction : the end played to
    target : (2,) where the delivered stone is to end, delivery frame [m]
    places : (k, 2) stones on the sheet, a task's given stone first, delivery frame [m]
    """

    direction: Direction
    target: Floats
    places: Floats


@dataclass(frozen=True, kw_only=True)
class ResetDistribution:
    """What episodes begin with.

    Parameters
    ----------
    task : what a throw is asked to do
    direction : the end played to; None for either
    goal : (2,) of the task, delivery frame [m]; None for the task's own, as the level says
    level : None for positions as asked for; else how far from the task's easiest position marks
        spread, and up to what share of the stones lie there, 0 to 1
    stones : (k, 2) places in the delivery frame [m], or how many to lay at random; a given stone is
        not among them
    stone_radius : [m]
    """

    task: Task
    direction: Direction | None
    goal: Floats | None
    level: float | None
    stones: Floats | int
    stone_radius: float

    @property
    def stone_count(self) -> int:
        """Most stones on the sheet at the beginning."""
        others = self.stones if isinstance(self.stones, int) else len(self.stones)
        return others + self.task.has_target_stone

    @property
    def is_fixed(self) -> bool:
        """Whether every episode begins the same."""
        laid = self.stones == 0 if isinstance(self.stones, int) else True
        return self.direction is not None and self.goal is not None and laid

    def sample(self, rng: np.random.Generator) -> InitialState:
        """The beginning of one episode.

        Raises
        ------
        InputError : there is no room for so many stones
        """
        direction = self.direction
        if direction is None:
            direction = Direction.AWAY if rng.random() < 0.5 else Direction.HOME
        goal = self._sample_goal(rng) if self.goal is None else self.goal
        target = np.asarray(self.task.target(goal, self.stone_radius), dtype=np.float64)
        given = goal[None] if self.task.has_target_stone else np.empty((0, 2))
        stones = self.stones
        if isinstance(stones, int):
            if self.level is not None:
                stones = int(rng.integers(round(self.level * stones) + 1))
            stones = self._scatter(stones, rng, given)
        return InitialState(
            direction=direction, target=target, places=np.concatenate([given, stones])
        )

    def _sample_goal(self, rng: np.random.Generator) -> Floats:
        """The task's goal at random; a given stone touches none of those placed by hand."""
        level = 1.0 if self.level is None else self.level
        placed = np.empty((0, 2)) if isinstance(self.stones, int) else self.stones
        for _ in range(TRIES):
            u, v = rng.random(2).tolist()
            goal = np.array(self.task.sample_goal(level, u, v))
            apart = np.hypot(*(placed - goal).T)
            if not self.task.has_target_stone or (apart >= 2 * self.stone_radius + APART).all():
                return goal
        raise InputError("there is no room for the given stone among the stones placed")

    def _scatter(self, count: int, rng: np.random.Generator, given: Floats) -> Floats:
        """Places for stones at random, none touching another; (count, 2)."""
        (left, right), (near, far) = LIKELY
        least = 2 * self.stone_radius + APART
        taken: list[tuple[float, float]] = [(x, y) for x, y in given.tolist()]
        first = len(taken)
        for _ in range(TRIES * max(count, 1)):
            if len(taken) == first + count:
                return np.array(taken[first:]).reshape(-1, 2)
            u, v = rng.random(2).tolist()
            x, y = left + u * (right - left), near + v * (far - near)
            if all(hypot(x - other_x, y - other_y) >= least for other_x, other_y in taken):
                taken.append((x, y))
        raise InputError(f"there is no room for {count} stones in the house and before it")


def reset_distribution(choices: Mapping[str, Any], ice: Ice, task: Task) -> ResetDistribution:
    """What episodes begin with, from what was asked for.

    Parameters
    ----------
    choices : each of CHOICES, as `CurlingSheetEnv` takes it
    task : what a throw is asked to do

    Raises
    ------
    InputError : a choice that is none, or that makes no sense
    """
    unknown = sorted(choices.keys() - set(CHOICES))
    if unknown:
        raise InputError(f"unknown option {unknown[0]!r}; options are {', '.join(CHOICES)}")
    level = _level(choices["level"])
    goal = _aim(choices["target"], ice.sheet.width / 2)
    if choices["target"] is None and not level:
        goal = np.array(task.easiest_goal)
    return ResetDistribution(
        task=task,
        direction=_end(choices["direction"]),
        goal=goal,
        level=level,
        stones=_stones(choices["stones"], play_bounds(ice, Direction.AWAY)),
        stone_radius=ice.stone.radius,
    )


def _end(direction: Any) -> Direction | None:
    if isinstance(direction, Direction):
        return direction
    if direction == "random":
        return None
    names = {end.name.lower(): end for end in Direction}
    if direction not in names:
        raise InputError(f"direction must be 'away', 'home' or 'random', got {direction!r}")
    return names[direction]


def _level(level: Any) -> float | None:
    if level is None:
        return None
    if not isinstance(level, (int, float)) or not 0 <= level <= 1:
        raise InputError(f"level must be None or a number from 0 to 1, got {level!r}")
    return float(level)


def _aim(target: Any, half: float) -> Floats | None:
    if target is None:
        return None
    if isinstance(target, str):
        if target != "random":
            raise InputError(f"target must be (x, y) in metres or 'random', got {target!r}")
        return None
    try:
        aim = np.asarray(target, dtype=np.float64)
    except (TypeError, ValueError):
        aim = np.empty(0)
    if aim.shape != (2,) or not (abs(aim[0]) <= half and abs(aim[1]) <= HOG_TO_TEE):
        raise InputError(
            f"target must be (x, y) in metres from the tee, within {half:g} m of the centre "
            f"line and {HOG_TO_TEE:g} m of the tee, got {target!r}"
        )
    return aim


def _stones(stones: Any, bounds: Floats) -> Floats | int:
    if isinstance(stones, int):
        if stones < 0:
            raise InputError(f"there cannot be {stones} stones on the sheet")
        return stones
    try:
        places = np.asarray(stones, dtype=np.float64)
    except (TypeError, ValueError):
        places = np.full((1, 1), np.nan)
    if places.size == 0:
        return np.empty((0, 2))
    if places.ndim != 2 or places.shape[1] != 2 or not np.isfinite(places).all():
        raise InputError(f"stones must be their number or places (x, y) in metres, got {stones!r}")
    lying = to_sheet(places, Direction.AWAY)
    outside = (lying < bounds[::2]).any(axis=1) | (lying > bounds[1::2]).any(axis=1)
    if outside.any():
        x, y = places[int(np.argmax(outside))]
        raise InputError(
            f"a stone must lie inside the side lines and the back line, got one at ({x:g}, {y:g}) "
            "m from the tee"
        )
    return places
