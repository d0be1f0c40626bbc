"""Joining the frames: a Kalman filter forward, Rauch-Tung-Striebel backward, outliers left out.

The stone's acceleration is taken to wander slowly. How slowly, and how noisy the measurements are,
the film itself tells: both are chosen for the greatest likelihood of what was measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit  # pyright: ignore[reportMissingTypeStubs]
from numpy.typing import NDArray

Floats = NDArray[np.float64]

JERKS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Candidate square roots of the jerk's spectral density [m/s³/√Hz]; 0.003: a stone left alone."""
OUTLIER_AT = 4.0
"""Measurements this many standard deviations from what all others say are left out."""
ROUNDS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Smoothed:
    """A smoothed coordinate.

    Parameters
    ----------
    value, rate, change : (n,) the coordinate, its first and its second derivative
    sigma : (n,) standard error of `value`
    used : (n,) whether the measurement agreed with the others
    scale : by how much the given standard errors had to be stretched to be true
    """

    value: Floats
    rate: Floats
    change: Floats
    sigma: Floats
    used: NDArray[np.bool_]
    scale: float


def smooth(t: Floats, measured: Floats, sigma: Floats) -> Smoothed:
    """One coordinate through all frames, forward and backward.

    Parameters
    ----------
    t : (n,) increasing [s]
    measured : (n,) NaN where nothing was measured
    sigma : (n,) standard error of each measurement, right up to a common factor
    """
    used = np.isfinite(measured) & np.isfinite(sigma) & (sigma > 0)
    scale, jerk, fit = 1.0, JERKS[2], 1.0
    value = rate = change = variance = np.full(len(t), np.nan)
    for _ in range(ROUNDS):
        best = -np.inf
        for candidate in JERKS:
            noise = np.where(used, (scale * sigma) ** 2, np.inf)
            likelihood, count, chi2 = _likelihood(t, np.nan_to_num(measured), noise, candidate**2)
            if likelihood > best:
                best, jerk, fit = likelihood, candidate, chi2 / max(count, 1)
        noise = np.where(used, (scale * sigma) ** 2, np.inf)
        value, rate, change, variance = _smooth(t, np.nan_to_num(measured), noise, jerk**2)
        left = measured - value
        spread = np.sqrt(
            np.maximum((scale * sigma) ** 2 - variance * used, 0.2 * (scale * sigma) ** 2)
        )
        standard = np.abs(left) / spread
        seen = np.isfinite(standard)
        robust = 1.4826 * float(np.median(standard[seen & used])) if (seen & used).any() else 1.0
        scale *= float(np.clip(0.5 * (robust + np.sqrt(max(fit, 1e-6))), 0.2, 5.0))
        used = seen & (standard < OUTLIER_AT * max(robust, 0.3))
    return Smoothed(
        value=value,
        rate=rate,
        change=change,
        sigma=np.sqrt(variance),
        used=used,
        scale=scale,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _step(dt, q, transition, noise):
    transition[:] = 0.0
    for i in range(3):
        transition[i, i] = 1.0
    transition[0, 1] = dt
    transition[1, 2] = dt
    transition[0, 2] = dt * dt / 2
    noise[0, 0] = q * dt**5 / 20
    noise[0, 1] = noise[1, 0] = q * dt**4 / 8
    noise[0, 2] = noise[2, 0] = q * dt**3 / 6
    noise[1, 1] = q * dt**3 / 3
    noise[1, 2] = noise[2, 1] = q * dt**2 / 2
    noise[2, 2] = q * dt


@njit(cache=True, nogil=True, error_model="numpy")
def _filter(t, z, r, q, before, before_p, after, after_p):
    """Fill predicted and filtered states; return log-likelihood, count and normalised squares."""
    f, w = np.empty((3, 3)), np.empty((3, 3))
    n = len(t)
    state = np.zeros(3)
    p = np.diag(np.array([1e6, 1e3, 1e2]))
    likelihood, count, squares = 0.0, 0, 0.0
    for k in range(n):
        if k > 0:
            _step(t[k] - t[k - 1], q, f, w)
            state = f @ state
            p = f @ p @ f.T + w
        before[k] = state
        before_p[k] = p
        if r[k] < 1e30:
            s = p[0, 0] + r[k]
            gain = p[:, 0] / s
            miss = z[k] - state[0]
            if count >= 6:  # the first few only find the start
                likelihood -= 0.5 * (np.log(s) + miss * miss / s)
                squares += miss * miss / s
            count += 1
            state = state + gain * miss
            row = p[0].copy()
            p = p - np.outer(gain, row)
            p = 0.5 * (p + p.T)
        after[k] = state
        after_p[k] = p
    return likelihood, count - 6, squares


@njit(cache=True, nogil=True, error_model="numpy")
def _likelihood(t, z, r, q):
    n = len(t)
    a, b = np.empty((n, 3)), np.empty((n, 3, 3))
    c, d = np.empty((n, 3)), np.empty((n, 3, 3))
    return _filter(t, z, r, q, a, b, c, d)


@njit(cache=True, nogil=True, error_model="numpy")
def _smooth(t, z, r, q):
    n = len(t)
    before, before_p = np.empty((n, 3)), np.empty((n, 3, 3))
    after, after_p = np.empty((n, 3)), np.empty((n, 3, 3))
    _filter(t, z, r, q, before, before_p, after, after_p)
    f, w = np.empty((3, 3)), np.empty((3, 3))
    for k in range(n - 2, -1, -1):
        _step(t[k + 1] - t[k], q, f, w)
        gain = np.linalg.solve(before_p[k + 1], f @ after_p[k]).T
        after[k] += gain @ (after[k + 1] - before[k + 1])
        after_p[k] += gain @ (after_p[k + 1] - before_p[k + 1]) @ gain.T
    return after[:, 0].copy(), after[:, 1].copy(), after[:, 2].copy(), after_p[:, 0, 0].copy()
