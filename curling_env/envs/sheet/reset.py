"""Start of an episode of `CurlingSheet-v0`: the end played to, the target, the stones.

The options are read once, into the distribution from which every episode draws its initial state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from curling_env.envs.options import brief, floats_from, is_whole_number
from curling_env.envs.sheet.tasks import Task
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.slides import play_bounds
from curling_env.sheet import HOG_TO_TEE, Direction, to_sheet
from curling_env.typing import Floats

TargetOption = Literal["random"] | Sequence[float] | ArrayLike | None
StonesOption = int | Sequence[Sequence[float]] | ArrayLike
DirectionOption = Direction | Literal["away", "home", "random"]

FIRST_OWN_STONE = 100
"""Identifiers of the agent's stones start here; stones laid at reset count from 0."""
POSITION_OPTIONS = ("target", "stones", "direction", "level")
"""Options of the start of an episode."""
RESET_OPTIONS = (*POSITION_OPTIONS, "ice", "known_ice")
"""Names of the `options` of `reset`."""

# Positions of random stones, delivery frame: in the house and before it (chosen).
STONES_X = (-1.6, 1.6)
"""Range of their x [m]."""
STONES_Y = (-4.0, 1.6)
"""Range of their y [m]."""
MIN_GAP = 0.02
"""Minimum gap between two of them [m]."""
MAX_TRIES = 100
"""Maximum number of tried positions for each of them."""


class InitialState(NamedTuple):
    """Initial state of one episode.

    Parameters
    ----------
    direction : the end played to
    target : (2,) where the delivered stone should end, delivery frame [m]
    places : (k, 2) stones on the sheet, the task's target stone first, delivery frame [m]
    """

    direction: Direction
    target: Floats
    places: Floats


@dataclass(frozen=True, kw_only=True)
class ResetDistribution:
    """The distribution of initial states.

    Parameters
    ----------
    task : task of the throw
    direction : the end played to; None for either
    goal : (2,) the task's goal, delivery frame [m]; None for a random one
    level : difficulty, 0 to 1: how far random goals spread from the task's easiest goal, and up to
        what share of the random stones lie on the sheet; None for positions as asked for
    stones : (k, 2) places in the delivery frame [m], or how many stones to lay at random; the
        target stone is not among them
    stone_radius : radius of a stone [m]
    """

    task: Task
    direction: Direction | None
    goal: Floats | None
    level: float | None
    stones: Floats | int
    stone_radius: float

    @property
    def stone_count(self) -> int:
        """Maximum number of stones at the start of an episode."""
        others = self.stones if isinstance(self.stones, int) else len(self.stones)
        return others + self.task.has_target_stone

    @cached_property
    def is_fixed(self) -> bool:
        """True if every episode begins in the same state."""
        no_random_stones = self.stones == 0 if isinstance(self.stones, int) else True
        return self.direction is not None and self.goal is not None and no_random_stones

    def on(self, radius: float) -> ResetDistribution:
        """Return the same distribution with stones of another radius [m]."""
        return self if radius == self.stone_radius else replace(self, stone_radius=radius)

    def sample(self, rng: np.random.Generator) -> InitialState:
        """Draw the initial state of one episode.

        Raises
        ------
        InputError : there is no room for that number of stones
        """
        direction = self.direction
        if direction is None:
            direction = Direction.AWAY if rng.random() < 0.5 else Direction.HOME
        goal = self._sample_goal(rng) if self.goal is None else self.goal
        target = np.asarray(self.task.target(goal, self.stone_radius), dtype=np.float64)
        target_stone = goal[None] if self.task.has_target_stone else np.empty((0, 2))
        stones = self.stones
        if isinstance(stones, int):
            if self.level is not None:
                stones = int(rng.integers(round(self.level * stones) + 1))
            stones = self._sample_stones(stones, rng, target_stone)
        places = np.concatenate([target_stone, stones])
        return InitialState(direction=direction, target=target, places=places)

    def _sample_goal(self, rng: np.random.Generator) -> Floats:
        """Draw a goal of the task; a target stone there touches none of the given stones."""
        level = 1.0 if self.level is None else self.level
        placed = np.empty((0, 2)) if isinstance(self.stones, int) else self.stones
        for _ in range(MAX_TRIES):
            u, v = rng.random(2).tolist()
            goal = np.array(self.task.sample_goal(level, u, v))
            apart = np.hypot(*(placed - goal).T)
            if not self.task.has_target_stone or (apart >= 2 * self.stone_radius + MIN_GAP).all():
                return goal
        raise InputError("there is no room for the target stone among the given stones")

    def _sample_stones(self, count: int, rng: np.random.Generator, taken: Floats) -> Floats:
        """Draw positions of stones that touch neither each other nor others; (count, 2)."""
        (left, right), (near, far) = STONES_X, STONES_Y
        least = 2 * self.stone_radius + MIN_GAP
        places: list[tuple[float, float]] = [(x, y) for x, y in taken.tolist()]
        first = len(places)
        for _ in range(MAX_TRIES * max(count, 1)):
            if len(places) == first + count:
                return np.array(places[first:]).reshape(-1, 2)
            u, v = rng.random(2).tolist()
            x, y = left + u * (right - left), near + v * (far - near)
            if all(hypot(x - other_x, y - other_y) >= least for other_x, other_y in places):
                places.append((x, y))
        raise InputError(f"there is no room for {count} stones in the house and before it")


def reset_distribution(options: Mapping[str, Any], ice: Ice, task: Task) -> ResetDistribution:
    """Return the distribution of initial states from the options.

    Parameters
    ----------
    options : all of POSITION_OPTIONS, as `CurlingSheetEnv` takes them
    ice : the ice, which knows the size of sheet and stone
    task : task of the throw

    Raises
    ------
    InputError : an unknown or invalid option
    """
    level = _level(options["level"])
    goal = _goal(options["target"], ice.sheet.width / 2)
    if options["target"] is None and not level:
        goal = np.array(task.easiest_goal)
    return ResetDistribution(
        task=task,
        direction=_direction(options["direction"]),
        goal=goal,
        level=level,
        stones=_stones(options["stones"], play_bounds(ice, Direction.AWAY)),
        stone_radius=ice.stone.radius,
    )


def check_level_counts(options: Mapping[str, Any]) -> None:
    """Refuse a level if target and stones already determine the start of every episode.

    Raises
    ------
    InputError : it does so
    """
    target, stones = options["target"], options["stones"]
    given = target is not None and not isinstance(target, str)
    if options["level"] is not None and given and not (is_whole_number(stones) and stones):
        raise InputError("level needs a random target or a number of stones, which it scales")


def _direction(direction: Any) -> Direction | None:
    if isinstance(direction, Direction):
        return direction
    if direction == "random":
        return None
    names = {end.name.lower(): end for end in Direction}
    if not isinstance(direction, str) or direction not in names:
        raise InputError(f"direction must be 'away', 'home' or 'random', got {direction!r}")
    return names[direction]


def _level(level: Any) -> float | None:
    if level is None:
        return None
    if isinstance(level, bool) or not isinstance(level, (int, float)) or not 0 <= level <= 1:
        raise InputError(f"level must be None or a number from 0 to 1, got {level!r}")
    return float(level)


def _goal(target: Any, half_width: float) -> Floats | None:
    if target is None:
        return None
    if isinstance(target, str):
        if target != "random":
            raise InputError(f"target must be (x, y) in metres or 'random', got {target!r}")
        return None
    wanted = (
        f"target must be (x, y) in metres from the tee, within {half_width:g} m of the centre line "
        f"and {HOG_TO_TEE:g} m of the tee"
    )
    goal = floats_from(wanted, target)
    if goal.shape != (2,) or not (abs(goal[0]) <= half_width and abs(goal[1]) <= HOG_TO_TEE):
        raise InputError(f"{wanted}, got {brief(target)}")
    return goal


def _stones(stones: Any, bounds: Floats) -> Floats | int:
    if is_whole_number(stones):
        if stones < 0:
            raise InputError(f"the number of stones must be at least 0, got {stones}")
        return int(stones)
    wanted = "stones must be a number or places (x, y) in metres"
    places = floats_from(wanted, stones)
    if places.size == 0:
        return np.empty((0, 2))
    if places.ndim != 2 or places.shape[1] != 2 or not np.isfinite(places).all():
        raise InputError(f"{wanted}, got {brief(stones)}")
    on_sheet = to_sheet(places, Direction.AWAY)
    outside = (on_sheet < bounds[::2]).any(axis=1) | (on_sheet > bounds[1::2]).any(axis=1)
    if outside.any():
        x, y = places[int(np.argmax(outside))]
        raise InputError(
            f"a stone must lie inside the side lines and the back line, got one at ({x:g}, {y:g}) "
            "m from the tee"
        )
    return places
