"""Positions into which no stone is thrown: they cannot be, or the throw would begin in a stone."""

from __future__ import annotations

import numpy as np

from curling_env.errors import InputError
from curling_env.physics.slides import is_beyond
from curling_env.physics.tuning import OVERLAP_ALLOWED
from curling_env.typing import Floats


def refuse_nowhere(stones: Floats, bounds: Floats) -> None:
    """Refuse places that are none; NaN twice stands for no stone.

    Parameters
    ----------
    stones : (n, k, 2) centres, sheet frame [m]
    bounds : (4,) x_min, x_max, y_min, y_max of centres [m]

    Raises
    ------
    InputError : a stone beyond the bounds, or with one number only
    """
    x, y = stones[..., 0], stones[..., 1]
    no_x, no_y = np.isnan(x), np.isnan(y)
    lost = (no_x != no_y) | is_beyond(x, y, bounds)
    if lost.any():
        position, stone = (int(index) for index in np.argwhere(lost)[0])
        x, y = (float(value) for value in stones[position, stone])
        raise InputError(
            f"stone {stone} lies at ({x:g}, {y:g}) m, outside the bounds of the ice; a position "
            "without it has NaN twice",
            where=f"position {position}",
        )


def refuse_overlaps(stones: Floats, radius: float) -> None:
    """Refuse stones (n, k, 2) of which two lie in one place.

    Raises
    ------
    InputError : centres nearer to each other than stones in contact
    """
    least = (2 * radius - OVERLAP_ALLOWED) ** 2
    for a in range(stones.shape[1] - 1):
        apart = stones[:, a + 1 :] - stones[:, a : a + 1]
        square = np.square(apart, out=apart)
        overlap = square[..., 0] + square[..., 1] < least
        if overlap.any():
            position, b = (int(index) for index in np.argwhere(overlap)[0])
            raise InputError(
                f"stones {a} and {a + 1 + b} overlap: their centres are "
                f"{np.sqrt(square[position, b].sum()):.3f} m apart",
                where=f"position {position}",
            )


def refuse_releases_in_stones(releases: Floats, stones: Floats, radius: float) -> None:
    """Refuse places of release (n, 2) that lie within a stone of (n, k, 2).

    Raises
    ------
    InputError : a release nearer to a stone than stones in contact
    """
    gaps = np.hypot(*(stones - releases[:, None]).transpose(2, 0, 1))
    within = gaps < 2 * radius - OVERLAP_ALLOWED
    if within.any():
        position, stone = (int(index) for index in np.argwhere(within)[0])
        raise InputError(
            f"the stone is released {gaps[position, stone]:.3f} m from stone {stone}, within it",
            where=f"position {position}",
        )
