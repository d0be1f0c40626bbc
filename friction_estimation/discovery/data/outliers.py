"""Wild rows: measurements that do not lie where their neighbours say.

A tracker that jumps to a shadow for one frame is off by centimetres. Such rows are found in what is
faster than any slide: the part of a series that neither slow cosines nor a running median follow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats

SLOWEST_PERIOD = 2.0
"""What swings slower than this may be physics [s]."""
WILD = 4.5
"""Robust standard deviations of the fast part beyond which a row is wild: one good row in
150 000."""
LEAST = (2e-4, 2e-4)
"""Smallest noise assumed [m, rad]: simulated tracks are rounded, and none is perfect."""
LEAST_RAW = (1e-3, 5e-3)
"""The same for a track itself, of which slow cosines leave a little where it begins and ends."""
FEWEST = 20
"""Rows below which a series is left as it is."""


def slow_basis(t: Floats, period: float = SLOWEST_PERIOD) -> Floats:
    """Cosines slower than a period and a parabola: what physics may look like, (n, K)."""
    span = max(float(t[-1] - t[0]), 1e-9)
    count = int(max(1, min(2 * span / period + 2, len(t) / 3)))
    phase = np.pi * (t - t[0]) / span
    return np.column_stack([np.cos(phase[:, None] * np.arange(count)), phase, phase**2])


def robust_deviation(values: Floats) -> float:
    """Standard deviation by the median of absolute values, of values around zero."""
    return 1.4826 * float(np.median(np.abs(values)))


def fast_series(t: Floats, values: Floats) -> Floats:
    """A series less its slow cosines and a running median over two thirds of a second.

    The cosines are fitted twice, the second time without values far off, which would bend them.

    Parameters
    ----------
    t, values : (n,), finite
    """
    basis = slow_basis(t)
    near = np.ones(len(values), dtype=bool)
    left = values
    for _ in range(2):
        gram = basis[near].T @ basis[near] + 1e-8 * near.sum() * np.eye(basis.shape[1])
        left = values - basis @ np.linalg.solve(gram, basis[near].T @ values[near])
        near = np.abs(left) <= 4.0 * robust_deviation(left) + 1e-12
    return left - median_filter(left, min(21, len(left) // 2 * 2 - 1))


def without_wild_rows(track: Trajectory) -> Trajectory:
    """A track without rows whose position is wild, and without wild headings."""
    if len(track) < FEWEST:
        return track
    keep = np.ones(len(track), dtype=bool)
    for axis in range(2):
        fast = fast_series(track.t, track.xy[:, axis])
        keep &= np.abs(fast) <= WILD * max(robust_deviation(fast), LEAST_RAW[0])
    theta = track.theta.copy()
    known = np.flatnonzero(np.isfinite(theta))
    if len(known) >= FEWEST:
        fast = fast_series(track.t[known], theta[known])
        theta[known[np.abs(fast) > WILD * max(robust_deviation(fast), LEAST_RAW[1])]] = np.nan
    columns = {
        name: getattr(track, name)[keep]
        for name in ("sigma_xy", "sigma_theta")
        if getattr(track, name).size
    }
    return replace(
        track,
        t=track.t[keep],
        xy=track.xy[keep],
        theta=theta[keep],
        swept=track.swept[keep],
        **columns,
    )
