"""A smoother for one coordinate: a Kalman filter forward, Rauch-Tung-Striebel backward.

The acceleration is assumed to change slowly, as a random walk. How fast it changes, and how noisy
the measurements are, is estimated from the film itself by maximum likelihood. Outliers are left
out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from curling_env.physics.compiled import compiled
from curling_env.typing import Flags, Floats
from friction_estimation.tracking import tuning


@dataclass(frozen=True, kw_only=True, eq=False)
class Smoothed:
    """A smoothed coordinate.

    Parameters
    ----------
    value, rate, change : (n,) the coordinate, its first and its second derivative
    sigma : (n,) standard error of `value`
    used : (n,) whether the measurement was used; outliers are not
    scale : factor by which the given standard errors had to be multiplied
    """

    value: Floats
    rate: Floats
    change: Floats
    sigma: Floats
    used: Flags
    scale: float


def smooth(t: Floats, measured: Floats, sigma: Floats) -> Smoothed:
    """Smooth one coordinate over all frames.

    Parameters
    ----------
    t : (n,) increasing times [s]
    measured : (n,) the coordinate, NaN where it was not measured
    sigma : (n,) standard error of each measurement, up to a common factor
    """
    used = np.isfinite(measured) & np.isfinite(sigma) & (sigma > 0)
    scale, jerk, fit = 1.0, tuning.JERK_DENSITIES[2], 1.0
    value = rate = change = variance = np.full(len(t), np.nan)
    states = _States(t, np.nan_to_num(measured))
    for _ in range(tuning.SMOOTHING_PASSES):
        best = -np.inf
        for candidate in tuning.JERK_DENSITIES:
            noise = np.where(used, (scale * sigma) ** 2, np.inf)
            likelihood, count, chi2 = states.filtered(noise, candidate**2)
            if likelihood > best:
                best, jerk, fit = likelihood, candidate, chi2 / max(count, 1)
        noise = np.where(used, (scale * sigma) ** 2, np.inf)
        value, rate, change, variance = states.smoothed(noise, jerk**2)
        residual = measured - value
        spread = np.sqrt(
            np.maximum((scale * sigma) ** 2 - variance * used, 0.2 * (scale * sigma) ** 2)
        )
        standard = np.abs(residual) / spread
        seen = np.isfinite(standard)
        robust = 1.4826 * float(np.median(standard[seen & used])) if (seen & used).any() else 1.0
        scale *= float(np.clip(0.5 * (robust + np.sqrt(max(fit, 1e-6))), 0.2, 5.0))
        used = seen & (standard < tuning.OUTLIER_SIGMAS * max(robust, 0.3))
    return Smoothed(
        value=value,
        rate=rate,
        change=change,
        sigma=np.sqrt(np.maximum(variance, 0.0)),  # rounding may make it negative at rest
        used=used,
        scale=scale,
    )


@compiled
def _predict(dt, q, state, p, ahead, ahead_p):
    """Predict a state and its covariance a time `dt` later; the third derivative is white noise."""
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
    """Predict and filter all states; log-likelihood, count and sum of normalised squares."""
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
            if count >= 6:  # the first ones only determine the state
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
def _smooth_back(t, before, before_p, after, after_p, work):
    """Turn filtered states into smoothed ones, in place; `work` is (4, 3, 3)."""
    inverse, carried, gain, apart = work[0], work[1], work[2], work[3]
    for k in range(len(t) - 2, -1, -1):
        dt = t[k + 1] - t[k]
        p = before_p[k + 1]
        for i in range(3):  # the inverse by cofactors
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
        """Log-likelihood of the measurements, their number, and the sum of normalised squares."""
        return _filter(
            self._t, self._z, r, q, self._before, self._before_p, self._after, self._after_p
        )

    def smoothed(self, r: Floats, q: float) -> tuple[Floats, Floats, Floats, Floats]:
        """The coordinate, its two derivatives and its variance, each (n,)."""
        self.filtered(r, q)
        work = np.empty((4, 3, 3))
        _smooth_back(self._t, self._before, self._before_p, self._after, self._after_p, work)
        value, rate, change = self._after.T.copy()
        return value, rate, change, self._after_p[:, 0, 0].copy()
