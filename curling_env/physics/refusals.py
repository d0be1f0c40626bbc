"""Refusal of positions that are impossible or in which the throw would begin in a stone."""

from __future__ import annotations

from typing import Any

from curling_env.errors import InputError
from curling_env.physics.compiled import compiled
from curling_env.physics.state import State
from curling_env.physics.tuning import OVERLAP_ALLOWED, ROUNDING
from curling_env.typing import Floats


def refuse_impossible_positions(
    stones: Floats, radius: float, bounds: Floats, inside: str, *, bounded: int
) -> None:
    """Refuse invalid places, and two stones in one place; NaN twice means no stone.

    Parameters
    ----------
    stones : (n, k, 2) centres or (n, k, 6) states, sheet frame
    radius : radius of a stone [m]
    bounds : (4,) x_min, x_max, y_min, y_max of centres [m]
    inside : the bounds in words
    bounded : number of stones of each position, from the first, that must be within the bounds

    Raises
    ------
    InputError : a stone beyond the bounds, one with one number only, or centres nearer to each
        other than those of stones in contact
    """
    i, a, b = _first_impossible_position(
        stones, bounded, bounds, (2 * radius - OVERLAP_ALLOWED) ** 2
    )
    if i >= 0:
        first, second = (f"({x:g}, {y:g})" for x, y in stones[i, [a, b], :2])
        raise InputError(
            f"a stone must be inside {inside}, got one at {first} m"
            if a == b
            else f"two stones cannot be in one place: {first} and {second} m",
            where=f"position {i}" if len(stones) > 1 else None,
        )


@compiled
def _first_impossible_position(stones: Any, bounded: int, bounds: Any, least: float) -> Any:
    """Return position and numbers of two stones in one place; twice that of one beyond; or -1.

    Bounds are exact to the rounding of numbers; `least` is a squared distance.
    """
    for i in range(stones.shape[0]):
        for a in range(stones.shape[1]):
            x, y = stones[i, a, State.X], stones[i, a, State.Y]
            inside = bounds[0] - ROUNDING <= x <= bounds[1] + ROUNDING
            inside = inside and bounds[2] - ROUNDING <= y <= bounds[3] + ROUNDING
            is_there = x == x or y == y
            if a < bounded and is_there and not inside:
                return i, a, a
            for b in range(a):
                dx, dy = x - stones[i, b, State.X], y - stones[i, b, State.Y]
                if dx * dx + dy * dy < least:
                    return i, b, a
    return -1, -1, -1
