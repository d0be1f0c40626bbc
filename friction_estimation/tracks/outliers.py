"""Outliers of a track: rows that contradict their neighbours."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from curling_env.typing import Flags, Floats
from friction_estimation.tracks.tuning import MIN_NOISE, WILD_DEVIATIONS


def robust_deviation(values: Floats) -> float:
    """Return the standard deviation of roughly Gaussian values, from their median absolute
    deviation.
    """
    return 1.4826 * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.0


def wild_rows(t: Floats, xy: Floats) -> tuple[Flags, float]:
    """Return the outliers of a track, and the noise of the other rows.

    Every row is compared with the parabola through the medians of its neighbourhood, so that single
    outliers are found, and bursts of them shorter than half the neighbourhood.

    Parameters
    ----------
    t : (n,) times [s]
    xy : (n, 2) positions [m]

    Returns
    -------
    wild : (n,) flags
    noise : robust standard deviation of one coordinate [m]
    """
    n = len(t)
    # Ten rows to either side, or those of a second for a slow camera. In a longer window the
    # release and the rest of the stone would no longer be at the edge of the visible part.
    half = int(np.clip(1.0 / float(np.median(np.diff(t))), 5, 10)) if n > 1 else 1
    if n < 2 * half + 1:
        half = max(1, (n - 1) // 2)
    size = 2 * half + 1
    wild = np.zeros(n, dtype=bool)
    scale = MIN_NOISE
    # At either end the window stays inside, so that a wild last row counts once.
    inside = np.arange(half, n - half)
    nearest = np.clip(np.arange(n), half, n - half - 1)
    windows = nearest[:, None] + np.arange(-half, half + 1)
    lasting = np.maximum(t[inside + half] - t[inside - half], 1e-9)
    middle = median_filter(0.5 * (t[inside + half] + t[inside - half]), size, mode="mirror")
    middle = middle[nearest - half]
    ahead, behind = np.minimum(np.arange(n) + half, n - 1), np.maximum(np.arange(n) - half, 0)
    for axis in range(2):
        values = xy[:, axis]
        # The velocity is a median of differences half a window apart, the acceleration a median of
        # changes of the velocity, and the level a median about the parabola of both. The
        # acceleration matters: in the seconds that a window of a slow camera lasts, friction bends
        # the path by many centimetres.
        slope = (values[inside + half] - values[inside - half]) / lasting
        slope = median_filter(slope, size, mode="mirror")[nearest - half]
        change = (slope[ahead] - slope[behind]) / np.maximum(middle[ahead] - middle[behind], 1e-9)
        bend = median_filter(change, 2 * size + 1, mode="mirror")
        velocity = slope + bend * (t - middle)
        apart = t[windows] - t[:, None]
        path = velocity[:, None] * apart + 0.5 * bend[:, None] * apart**2
        level = np.median(values[windows] - path, axis=1)
        residual = values - level
        spread = max(robust_deviation(residual), MIN_NOISE)
        # Two centimetres are allowed in addition: a stone that is pushed or stops is no parabola.
        wild |= np.abs(residual) > WILD_DEVIATIONS * spread + 0.02
        scale = max(scale, robust_deviation(residual[~wild]))
    return wild, scale
