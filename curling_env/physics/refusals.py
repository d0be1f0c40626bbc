"""Positions into which no stone is thrown: they cannot be, or the throw would begin in a stone."""

from __future__ import annotations

from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.physics.compiled import compiled
from curling_env.physics.slides import is_beyond
from curling_env.physics.state import State
from curling_env.physics.tuning import OVERLAP_ALLOWED
from curling_env.typing import Floats


def refuse_nowhere(stones: Floats, bounds: Floats, inside: str) -> None:
    """Refuse places that are none; NaN twice stands for no stone.

    Parameters
    ----------
    stones : (n, k, 2) centres or (n, k, 6) states, sheet frame
    bounds : (4,) x_min, x_max, y_min, y_max of centres [m]
    inside : the bounds in words

    Raises
    ------
    InputError : a stone beyond the bounds, or with one number only
    """
    x, y = stones[..., State.X], stones[..., State.Y]
    lost = (np.isnan(x) != np.isnan(y)) | is_beyond(x, y, bounds)
    if lost.any():
        i, k = np.argwhere(lost)[0].tolist()
        raise _refusal(f"a stone must lie inside {inside}, got one at", stones, i, [k])


def refuse_overlaps(stones: Floats, radius: float) -> None:
    """Refuse stones, given as in `refuse_nowhere`, of which two lie in one place.

    Raises
    ------
    InputError : centres nearer to each other than stones in contact
    """
    i, first, second = _first_overlap(stones, (2 * radius - OVERLAP_ALLOWED) ** 2)
    if i >= 0:
        raise _refusal("two stones cannot lie in one place:", stones, i, [first, second])


@compiled
def _first_overlap(stones: Any, least: float) -> Any:
    """Position and numbers of the first stones whose squared distance is below `least`; or -1."""
    for i in range(stones.shape[0]):
        for a in range(stones.shape[1]):
            for b in range(a + 1, stones.shape[1]):
                dx = stones[i, b, State.X] - stones[i, a, State.X]
                dy = stones[i, b, State.Y] - stones[i, a, State.Y]
                if dx * dx + dy * dy < least:
                    return i, a, b
    return -1, -1, -1


def _refusal(problem: str, stones: Floats, position: int, chosen: list[int]) -> InputError:
    places = [f"({x:g}, {y:g})" for x, y in stones[position, chosen, :2]]
    where = f"position {position}" if len(stones) > 1 else None
    return InputError(f"{problem} {' and '.join(places)} m", where=where)
