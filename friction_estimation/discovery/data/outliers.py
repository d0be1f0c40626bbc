"""The part of a series that is faster than any slide, in which outliers and noise show.

A tracker that jumps to a shadow for one frame is off by centimetres. Neither slow cosines nor a
running median follow that.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from curling_env.typing import Floats
from friction_estimation.discovery.tuning import SLOWEST_NOISE_PERIOD
from friction_estimation.tracks.outliers import robust_deviation


def slow_basis(t: Floats, period: float = SLOWEST_NOISE_PERIOD) -> Floats:
    """Cosines slower than a period, and a parabola: the shapes that physics may have, (n, K)."""
    span = max(float(t[-1] - t[0]), 1e-9)
    count = int(max(1, min(2 * span / period + 2, len(t) / 3)))
    phase = np.pi * (t - t[0]) / span
    return np.column_stack([np.cos(phase[:, None] * np.arange(count)), phase, phase**2])


def fast_series(t: Floats, values: Floats) -> Floats:
    """A series less its slow cosines and a running median over two thirds of a second.

    The cosines are fitted twice, the second time without values that are far off and would bend
    them.

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
