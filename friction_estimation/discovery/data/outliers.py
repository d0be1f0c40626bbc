"""Outliers: rows of a track that contradict their neighbours.

A tracker that jumps to a shadow for one frame is off by centimetres. Such rows are found in the
high-frequency part of a series, which neither slow cosines nor a running median follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.discovery.tuning import (
    LEAST_ROWS,
    LEAST_TRACK_NOISE,
    OUTLIER_DEVIATIONS,
    SLOWEST_NOISE_PERIOD,
)
from friction_estimation.tracks.contacts import stretches


def slow_basis(t: Floats, period: float = SLOWEST_NOISE_PERIOD) -> Floats:
    """Cosines slower than a period, and a parabola: the possible shapes of physical motion, (n,
    K).
    """
    span = max(float(t[-1] - t[0]), 1e-9)
    count = int(max(1, min(2 * span / period + 2, len(t) / 3)))
    phase = np.pi * (t - t[0]) / span
    return np.column_stack([np.cos(phase[:, None] * np.arange(count)), phase, phase**2])


def robust_deviation(values: Floats) -> float:
    """Standard deviation of values around zero, by the median of their absolute values."""
    return 1.4826 * float(np.median(np.abs(values)))


def fast_series(t: Floats, values: Floats) -> Floats:
    """Return a series minus its slow cosines and a running median over two thirds of a second.

    The cosines are fitted twice, the second time without outliers.

    Parameters
    ----------
    t : (n,) times [s]
    values : (n,) finite values
    """
    basis = slow_basis(t)
    near = np.ones(len(values), dtype=bool)
    residual = values
    for _ in range(2):
        gram = basis[near].T @ basis[near] + 1e-8 * near.sum() * np.eye(basis.shape[1])
        residual = values - basis @ np.linalg.solve(gram, basis[near].T @ values[near])
        near = np.abs(residual) <= 4.0 * robust_deviation(residual) + 1e-12
    return residual - median_filter(residual, min(21, len(residual) // 2 * 2 - 1))


def without_outliers(track: Trajectory, contacts: Sequence[float] = ()) -> Trajectory:
    """Return a track without the rows whose position is an outlier, and without outlying headings.

    Parameters
    ----------
    track : track of one stone
    contacts : times at which it was touched [s]; no smooth motion leads across them
    """
    keep = np.ones(len(track), dtype=bool)
    theta = track.theta.copy()
    for first, last in stretches(track, contacts):
        if last - first < LEAST_ROWS:
            continue
        rows = slice(first, last)
        for axis in range(2):
            fast = fast_series(track.t[rows], track.xy[rows, axis])
            keep[rows] &= np.abs(fast) <= OUTLIER_DEVIATIONS * max(
                robust_deviation(fast), LEAST_TRACK_NOISE[0]
            )
        known = first + np.flatnonzero(np.isfinite(theta[rows]))
        if len(known) >= LEAST_ROWS:
            fast = fast_series(track.t[known], theta[known])
            limit = OUTLIER_DEVIATIONS * max(robust_deviation(fast), LEAST_TRACK_NOISE[1])
            theta[known[np.abs(fast) > limit]] = np.nan
    return replace(track, theta=theta).only(keep)
