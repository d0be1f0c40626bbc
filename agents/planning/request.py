"""Checked requests to the planner: the objective, the stones, the spins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from agents.planning.objective import MostPoints, Objective, task_done
from agents.planning.target_search import check_target
from agents.planning.tuning import SPINS
from curling_env.envs.options import brief, floats_from
from curling_env.envs.sheet.tasks import Task, task_named
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.tuning import OVERLAP_ALLOWED
from curling_env.sheet import Direction, tee, to_sheet
from curling_env.throw import FROM_HOG_LINE, Delivery, Skill, skill_named
from curling_env.typing import Flags, Floats


def place_from(name: str, given: ArrayLike) -> Floats:
    """Parse a place (x, y) on the sheet, (2,) [m].

    Raises
    ------
    InputError : anything else
    """
    wanted = f"{name} must be (x, y) in metres, in the sheet frame"
    place = floats_from(wanted, given)
    if place.shape != (2,):
        raise InputError(f"{wanted}, got {brief(given)}")
    return place


def places_from(name: str, given: ArrayLike) -> Floats:
    """Parse places on the sheet, (k, 2) [m].

    Raises
    ------
    InputError : anything else
    """
    wanted = f"{name} must be places (x, y) in metres, in the sheet frame"
    places = floats_from(wanted, given)
    if places.size == 0:
        return np.empty((0, 2))
    if places.ndim != 2 or places.shape[1] != 2:
        raise InputError(f"{wanted}, got {brief(given)}")
    return places


def objective_for(
    ice: Ice,
    task: str | Task,
    mark: Floats | None,
    stones: Floats,
    teams: Flags | None,
    delivery: Delivery,
) -> Objective:
    """Make the objective of a throw: a task done, or the most points.

    Parameters
    ----------
    ice : the ice, whose stones and sheet bound the request
    task, mark, stones, teams, delivery : see `agents.planning.planner.plan_throw`

    Raises
    ------
    InputError : stones without teams in a plan for points, a task that needs a stone, or a place
        where none can rest
    """
    own = np.zeros(len(stones), dtype=np.bool_) if teams is None else teams
    nearest = stones[:, 1] if mark is None else np.atleast_1d(mark[1])
    direction = Direction.AWAY if nearest.sum() >= 0 else Direction.HOME
    if task == "score":
        if len(stones) and teams is None:
            raise InputError("points need each stone's team: give `own`")
        target = tee(direction) if mark is None else mark
        return MostPoints(
            target=target, direction=direction, stones=stones, own=own, delivery=delivery
        )
    known = task_named(task)
    given = None
    if known.has_target_stone:
        if not len(stones):
            if mark is None:
                raise InputError(
                    f"the task {known.name} needs a stone: give stones, or the position of one as "
                    "the target"
                )
            stones = mark[None]
            own, teams = np.zeros(1, dtype=np.bool_), None
        candidates = np.flatnonzero(~own) if mark is None and not own.all() else np.arange(len(own))
        aim = tee(direction) if mark is None else mark
        given = int(candidates[np.argmin(np.hypot(*(stones[candidates] - aim).T))])
        mark = stones[given]
    if mark is None:
        mark = np.asarray(to_sheet(known.easiest_goal, direction))
    objective = task_done(
        known,
        mark,
        direction,
        stones,
        own=teams,
        given=given,
        radius=ice.stone.radius,
        delivery=delivery,
    )
    if objective.comes_to_rest:
        check_target(ice, objective.target)
        others = stones if given is None else np.delete(stones, given, axis=0)
        check_room(ice, objective.target, others)
    return objective


def spins_from(given: Sequence[float] | None, delivery: Delivery) -> Sequence[float]:
    """Return the spins to try [rad/s]: the given ones, or the usual ones of a delivery.

    Raises
    ------
    InputError : anything but numbers
    """
    if given is None:
        return SPINS if delivery == FROM_HOG_LINE else (delivery.spin, -delivery.spin)
    wanted = "spins must be numbers in rad/s"
    spins = floats_from(wanted, given)
    if spins.ndim != 1 or not np.isfinite(spins).all():
        raise InputError(f"{wanted}, got {brief(given)}")
    return spins.tolist()


def teams_from(own: ArrayLike | None, stones: Floats) -> Flags | None:
    """Return whether each stone is the thrower's, (k,); None if unknown.

    Raises
    ------
    InputError : not a truth value for each stone
    """
    if own is None:
        return None
    wanted = f"own must have True or False for each of {len(stones)} stones"
    teams = floats_from(wanted, own)
    if teams.shape != (len(stones),) or not np.isin(teams, (0, 1)).all():
        raise InputError(f"{wanted}, got {brief(own)}")
    return teams.astype(np.bool_)


def skill_with(skill: str | Skill, spins: Sequence[float]) -> Skill:
    """Return the skill, if there is a spin to throw with.

    Raises
    ------
    InputError : no spin, or an unknown skill
    """
    if not len(spins):
        raise InputError("no spin to try: expected one or more spins")
    return skill_named(skill)


def check_stones(ice: Ice, stones: Floats) -> None:
    """Refuse stones (k, 2) that are off the ice or overlap.

    Raises
    ------
    InputError : names the first such stone
    """
    for k, stone in enumerate(stones):
        place = f"({stone[0]:g}, {stone[1]:g}) m"
        if not bool(ice.sheet.contains(stone)):
            raise InputError(f"stone {k + 1} at {place} is off the ice")
        apart = np.hypot(*(stones[:k] - stone).T)
        if k and apart.min() < 2 * ice.stone.radius - OVERLAP_ALLOWED:
            other = int(np.argmin(apart))
            raise InputError(
                f"stone {k + 1} at {place} overlaps stone {other + 1}: their centres are "
                f"{apart[other]:.3f} m apart; expected at least {2 * ice.stone.radius:g} m"
            )


def check_room(ice: Ice, target: Floats, stones: Floats) -> None:
    """Refuse a target that overlaps a stone.

    Raises
    ------
    InputError : names the stone
    """
    for stone in stones:
        if np.hypot(*(stone - target)) < 2 * ice.stone.radius - OVERLAP_ALLOWED:
            raise InputError(
                "no stone can rest at the target: the stone at "
                f"({stone[0]:.2f}, {stone[1]:.2f}) m is in its place"
            )
