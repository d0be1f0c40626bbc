"""Joining the frames: a Kalman filter forward, Rauch-Tung-Striebel backward, outliers left out.

The stone's acceleration is taken to wander slowly. How slowly, and how noisy the measurements are,
the film itself tells: both are chosen for the greatest likelihood of what was measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from curling_env.physics.compiled import compiled
from curling_env.typing import Floats

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
    states = _States(t, np.nan_to_num(measured))
    for _ in range(ROUNDS):
        best = -np.inf
        for candidate in JERKS:
            noise = np.where(used, (scale * sigma) ** 2, np.inf)
            likelihood, count, chi2 = states.filtered(noise, candidate**2)
            if likelihood > best:
                best, jerk, fit = likelihood, candidate, chi2 / max(count, 1)
        noise = np.where(used, (scale * sigma) ** 2, np.inf)
        value, rate, change, variance = states.smoothed(noise, jerk**2)
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
        sigma=np.sqrt(np.maximum(variance, 0.0)),  # rounding, where a stone lies still
        used=used,
        scale=scale,
    )


@compiled
def _predict(dt, q, state, p, ahead, ahead_p):
    """Fill a state and its covariance a time `dt` later; the third derivative is white noise."""
    ahead[0] = state[0] + dt * state[1] + 0.5 * dt * dt * state[2]
    ahead[1] = state[1] + dt * state[2]
    ahead[2] = state[2]
    # F p, then (F p) Fᵀ, both in place
    for j in range(3):
        ahead_p[0, j] = p[0, j] + dt * p[1, j] + 0.5 * dt * dt * p[2, j]
        ahead_p[1, j] = p[1, j] + dt * p[2, j]
        ahead_p[2, j] = p[2, j]
    for i in range(3):
        ahead_p[i, 0] += dt * ahead_p[i, 1] + 0.5 * dt * dt * ahead_p[i, 2]
        ahead_p[i, 1] += dt * ahead_p[i, 2]
    ahead_p[0, 0] += q * dt**5 / 20
    ahead_p[0, 1] += q * dt**4 / 8
    ahead_p[1, 0] += q * dt**4 / 8
    ahead_p[0, 2] += q * dt**3 / 6
    ahead_p[2, 0] += q * dt**3 / 6
    ahead_p[1, 1] += q * dt**3 / 3
    ahead_p[1, 2] += q * dt**2 / 2
    ahead_p[2, 1] += q * dt**2 / 2
    ahead_p[2, 2] += q * dt


@compiled
def _filter(t, z, r, q, before, before_p, after, after_p):
    """Fill predicted and filtered states; return log-likelihood, count and normalised squares."""
    likelihood, count, squares = 0.0, 0, 0.0
    for k in range(len(t)):
        if k == 0:
            for i in range(3):
                before[0, i] = 0.0
                for j in range(3):
                    before_p[0, i, j] = 0.0
            before_p[0, 0, 0], before_p[0, 1, 1], before_p[0, 2, 2] = 1e6, 1e3, 1e2
        else:
            dt = t[k] - t[k - 1]
            _predict(dt, q, after[k - 1], after_p[k - 1], before[k], before_p[k])
        seen = r[k] < 1e30
        s = before_p[k, 0, 0] + r[k] if seen else 1.0
        miss = z[k] - before[k, 0] if seen else 0.0
        share = 1.0 / s if seen else 0.0
        if seen:
            if count >= 6:  # the first few only find the start
                likelihood -= 0.5 * (math.log(s) + miss * miss / s)
                squares += miss * miss / s
            count += 1
        for i in range(3):
            after[k, i] = before[k, i] + before_p[k, i, 0] * share * miss
            for j in range(3):
                kept = 0.5 * (before_p[k, i, j] + before_p[k, j, i])
                after_p[k, i, j] = kept - before_p[k, i, 0] * before_p[k, j, 0] * share
    return likelihood, count - 6, squares


@compiled
def _look_back(t, before, before_p, after, after_p, work):
    """HeadingCurve filtered states into smoothed ones in place; `work` is (4, 3, 3)."""
    inverse, carried, gain, apart = work[0], work[1], work[2], work[3]
    for k in range(len(t) - 2, -1, -1):
        dt = t[k + 1] - t[k]
        p = before_p[k + 1]
        for i in range(3):  # by cofactors
            a, b = (i + 1) % 3, (i + 2) % 3
            for j in range(3):
                c, d = (j + 1) % 3, (j + 2) % 3
                inverse[j, i] = p[a, c] * p[b, d] - p[a, d] * p[b, c]
        det = p[0, 0] * inverse[0, 0] + p[0, 1] * inverse[1, 0] + p[0, 2] * inverse[2, 0]
        for i in range(3):  # after_p Fᵀ
            carried[i, 2] = after_p[k, i, 2]
            carried[i, 1] = after_p[k, i, 1] + dt * carried[i, 2]
            carried[i, 0] = after_p[k, i, 0] + dt * after_p[k, i, 1] + 0.5 * dt * dt * carried[i, 2]
        for i in range(3):
            for j in range(3):
                total = 0.0
                for m in range(3):
                    total += carried[i, m] * inverse[m, j]
                gain[i, j] = total / det
                apart[i, j] = after_p[k + 1, i, j] - p[i, j]
        for i in range(3):
            for j in range(3):
                after[k, i] += gain[i, j] * (after[k + 1, j] - before[k + 1, j])
        for i in range(3):
            for j in range(3):
                total = 0.0
                for m in range(3):
                    for n in range(3):
                        total += gain[i, m] * apart[m, n] * gain[j, n]
                after_p[k, i, j] += total


class _States:
    """Predicted and filtered states of one pass, and their covariances."""

    def __init__(self, t: Floats, z: Floats) -> None:
        self._t, self._z = t, z
        self._before, self._after = np.empty((2, len(t), 3))
        self._before_p, self._after_p = np.empty((2, len(t), 3, 3))

    def filtered(self, r: Floats, q: float) -> tuple[float, int, float]:
        """Log-likelihood of what was measured, how many measurements, their normalised squares."""
        return _filter(
            self._t, self._z, r, q, self._before, self._before_p, self._after, self._after_p
        )

    def smoothed(self, r: Floats, q: float) -> tuple[Floats, Floats, Floats, Floats]:
        """The coordinate, its two derivatives and its variance, each (n,)."""
        self.filtered(r, q)
        work = np.empty((4, 3, 3))
        _look_back(self._t, self._before, self._before_p, self._after, self._after_p, work)
        value, rate, change = self._after.T.copy()
        return value, rate, change, self._after_p[:, 0, 0].copy()
