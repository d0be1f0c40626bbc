"""Matching of throws between the films of several cameras.

Clocks of cameras need not agree, and a camera may miss a throw. But throws come at uneven times,
which are the same for all cameras except for an offset of the start.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curling_env.typing import Floats
from friction_estimation.tracks.tuning import SAME_THROW_SECONDS


def same_throws(clocks: Sequence[Floats]) -> list[list[int | None]]:
    """Return the throws of a session, each with its number in the film of every camera.

    Parameters
    ----------
    clocks : for each camera, (n,) start times of its throws, on its clock and in order [s]

    Returns
    -------
    For each throw and camera the number of the throw in that film, None if the camera has not seen
    it; in order of play. Throws that the first camera has not seen are placed by the camera that
    saw them.
    """
    first = np.asarray(clocks[0], dtype=np.float64)
    found: list[tuple[float, list[int | None]]] = [
        (float(t), [k, *[None] * (len(clocks) - 1)]) for k, t in enumerate(first)
    ]
    for camera, own in enumerate(clocks[1:], start=1):
        shift = _shift(first, np.asarray(own, dtype=np.float64))
        for k, t in enumerate(own):
            at = float(t) - shift
            free = [row for row in found if row[1][camera] is None]
            near = min(free, key=lambda row: abs(row[0] - at), default=None)
            if near is not None and abs(near[0] - at) <= SAME_THROW_SECONDS:
                near[1][camera] = k
            else:
                alone: list[int | None] = [None] * len(clocks)
                alone[camera] = k
                found.append((at, alone))
    return [row for _, row in sorted(found, key=lambda item: item[0])]


def _shift(first: Floats, own: Floats) -> float:
    """Return the lead of a camera's clock over the first one's [s] at which most throws agree."""
    if not len(first) or not len(own):
        return 0.0
    best, least = 0.0, (0, np.inf)
    for shift in np.unique(np.subtract.outer(own, first)):
        apart = np.abs(np.subtract.outer(own - shift, first)).min(axis=1)
        agree = apart <= SAME_THROW_SECONDS
        cost = (-int(agree.sum()), float(np.mean(apart[agree] ** 2)))
        if cost < least:
            best, least = float(shift), cost
    # The middle one of the throws that agree gives the shift.
    differences = np.subtract.outer(own, first)
    close = np.abs(differences - best) <= SAME_THROW_SECONDS
    return float(np.median(differences[close]))
