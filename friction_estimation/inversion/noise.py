"""The noise of measured distances: a white and a correlated part, both estimated from the data.

Frames are not independent. A smoothing tracker, a lens or compression err alike in neighbouring
frames, and taking such frames for independent would make every σ too small. Errors are modelled as
white noise plus an Ornstein–Uhlenbeck process. Residuals and sensitivities are whitened by one
Kalman filter, which is exact for uneven times. Rows that the filter finds wild are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, fabs, log, sqrt
from typing import Any

import numpy as np
from scipy.optimize import minimize

from curling_env.physics.compiled import compiled
from curling_env.typing import Flags, Floats
from friction_estimation.inversion.tuning import (
    MAX_SMOOTHING_TIME,
    MIN_NOISE,
    NOISE_GATE,
    SLOW_NOISE_GAIN,
    SMOOTHED_CORRELATION,
)


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations and correlation time of the error of a measured distance.

    Parameters
    ----------
    white : standard deviation of the part that is independent from frame to frame [m]
    slow : standard deviation of the part that is correlated in time [m]
    time : time after which the correlation of the slow part has fallen to 1/e [s]
    spacing : rows closer than this to the last one used are skipped [s]; between them a smoothed
        track adds nothing new
    """

    white: float
    slow: float = 0.0
    time: float = 0.1
    spacing: float = 0.0

    @property
    def total(self) -> float:
        """Standard deviation of one row [m]."""
        return float(np.hypot(self.white, self.slow))

    def keep(self, t: Floats, residual: Floats, scale: Floats) -> Flags:
        """Which rows agree with the noise, (n,) flags.

        Parameters
        ----------
        t : (n,) times [s]
        residual : (n,) residuals [m]
        scale : (n,) noise of each row relative to the common noise
        """
        keep = np.ones(len(t), dtype=np.bool_)
        _whiten(
            t,
            (residual / scale)[:, None],
            *self._numbers,
            keep,
            True,
            np.zeros(1),
            np.empty((len(t), 1)),
        )
        return keep

    def whiten(self, t: Floats, columns: Floats, scale: Floats, keep: Flags) -> Floats:
        """Columns made independent with unit noise, (rows used, k).

        Parameters
        ----------
        t : (n,) times [s]
        columns : (n, k) residuals or sensitivities [m]
        scale : (n,) noise of each row relative to the common noise
        keep : (n,) rows that may be used
        """
        out = np.zeros_like(columns)
        keep = keep & spaced_rows(t, keep, self.spacing)
        _whiten(
            t,
            columns / scale[:, None],
            *self._numbers,
            keep,
            False,
            np.zeros(columns.shape[1]),
            out,
        )
        return out[keep]

    def log_volume(self, t: Floats, scale: Floats, keep: Flags) -> float:
        """2·ln of the volume over which the noise of the rows that `whiten` uses spreads their
        density.
        """
        used = keep & spaced_rows(t, keep, self.spacing)
        spread = _minus_two_log_likelihood(t[used], np.zeros(int(used.sum())), *self._numbers)
        return float(spread + 2.0 * np.log(scale[used]).sum())

    @property
    def _numbers(self) -> tuple[float, float, float]:
        return max(self.white, MIN_NOISE) ** 2, self.slow**2, max(self.time, 1e-3)


def spaced_rows(t: Floats, keep: Flags, spacing: float) -> Flags:
    """Kept rows at least `spacing` apart, (n,) flags."""
    if spacing <= 0:
        return keep
    out = np.zeros(len(t), dtype=np.bool_)
    last = -np.inf
    for i in np.flatnonzero(keep):
        if t[i] - last >= spacing - 1e-6:
            out[i] = True
            last = t[i]
    return out


Residuals = tuple[Floats, Floats, Floats]
"""Times, residuals and relative noise of one throw's rows."""


def estimate_noise(
    residuals: Sequence[Residuals], *, longest: float = 2.0, start: Noise | None = None
) -> Noise:
    """The noise that makes the residuals of all throws most likely.

    Parameters
    ----------
    residuals : times, residuals and relative noise of each throw
    longest : longest correlation time considered [s]
    start : first guess; a slow part found before is refined

    Returns
    -------
    the noise; it has a slow part only where the residuals clearly show one
    """
    spacing = smoothing_time(residuals)
    if spacing > 0:
        thin = []
        for t, residual, scale in residuals:
            rows = spaced_rows(t, np.ones(len(t), dtype=np.bool_), spacing)
            thin.append((t[rows], residual[rows], scale[rows]))
        residuals = thin
    pooled = np.concatenate([residual / scale for _, residual, scale in residuals])
    size = max(1.4826 * float(np.median(np.abs(pooled))), MIN_NOISE)
    steps = np.concatenate([np.diff(residual / scale) for _, residual, scale in residuals])
    quick = max(1.4826 * float(np.median(np.abs(steps))) / sqrt(2), MIN_NOISE)

    def cost(noise: Noise) -> float:
        white, slow, time = noise._numbers
        return sum(
            _minus_two_log_likelihood(t, residual / scale, white, slow, time)
            for t, residual, scale in residuals
        )

    def white_only(p: Floats) -> float:
        return cost(Noise(white=float(np.exp(p[0]))))

    def both(p: Floats) -> float:
        if not log(0.01) <= p[2] <= log(longest):
            return 1e12 * (1 + abs(p[2]))
        return cost(Noise(white=exp(p[0]), slow=exp(p[1]), time=exp(p[2])))

    plain = minimize(white_only, [log(size)], method="Nelder-Mead", options={"xatol": 1e-3})
    best = plain
    guesses = [(quick, size, 0.1), (0.7 * size, 0.7 * size, 0.5 * longest)]
    if start is not None and start.slow > 0:
        guesses = [(start.white, start.slow, min(start.time, 0.9 * longest))]
    for guess in guesses:
        found = minimize(
            both,
            np.log(guess),
            method="Nelder-Mead",
            options={"xatol": 1e-2, "fatol": 1e-2, "maxiter": 150},
        )
        if found.fun < best.fun:
            best = found
    if plain.fun - best.fun < SLOW_NOISE_GAIN:
        return Noise(white=max(float(np.exp(plain.x[0])), MIN_NOISE), spacing=spacing)
    white, slow, time = (float(value) for value in np.exp(best.x))
    return Noise(white=max(white, MIN_NOISE), slow=slow, time=time, spacing=spacing)


def smoothing_time(residuals: Sequence[Residuals]) -> float:
    """Distance in time from which on the errors of rows are independent [s]; 0 for raw tracks.

    Increments of white noise are anticorrelated, those of an Ornstein–Uhlenbeck process
    independent. Where successive increments are positively correlated the track was smoothed: its
    errors then lack the high frequencies from which the low ones, which bend μ, could be judged.
    """
    step = float(np.median(np.concatenate([np.diff(t) for t, _, _ in residuals])))
    for lag in range(1, int(MAX_SMOOTHING_TIME / step) + 2):
        product = square = 0.0
        for _, residual, scale in residuals:
            rise = (residual / scale)[::lag]
            rise = np.diff(rise)
            if len(rise) > 1:
                limit = NOISE_GATE * 1.4826 * float(np.median(np.abs(rise))) + 1e-12
                rise = np.clip(rise, -limit, limit)
                product += float(rise[1:] @ rise[:-1])
                square += float(rise @ rise)
        if square == 0.0 or product < SMOOTHED_CORRELATION * square:
            return 0.0 if lag == 1 else lag * step
    return MAX_SMOOTHING_TIME


@compiled
def _whiten(
    t: Any,
    columns: Any,
    white: float,
    slow: float,
    time: float,
    keep: Any,
    gate: bool,
    mean: Any,
    out: Any,
) -> None:
    """Innovations of the first column, and of the other columns with the gains of the first."""
    n, k = columns.shape
    variance = slow
    for i in range(n):
        if i > 0:
            fade = exp(-(t[i] - t[i - 1]) / time)
            variance = fade * fade * variance + slow * (1.0 - fade * fade)
            for c in range(k):
                mean[c] *= fade
        spread = variance + white
        if gate:
            keep[i] = fabs(columns[i, 0] - mean[0]) <= NOISE_GATE * sqrt(spread)
        if not keep[i]:
            continue
        root = 1.0 / sqrt(spread)
        gain = variance / spread
        for c in range(k):
            ahead = columns[i, c] - mean[c]
            out[i, c] = ahead * root
            mean[c] += gain * ahead
        variance *= 1.0 - gain


@compiled
def _minus_two_log_likelihood(
    t: Any, residual: Any, white: float, slow: float, time: float
) -> float:
    """−2·ln likelihood; rows beyond the gate count as lying at it and do not steer the filter."""
    mean = 0.0
    variance = slow
    total = 0.0
    for i in range(t.shape[0]):
        if i > 0:
            fade = exp(-(t[i] - t[i - 1]) / time)
            variance = fade * fade * variance + slow * (1.0 - fade * fade)
            mean *= fade
        spread = variance + white
        ahead = residual[i] - mean
        if ahead * ahead > NOISE_GATE * NOISE_GATE * spread:
            total += NOISE_GATE * NOISE_GATE + log(spread)
            continue
        total += ahead * ahead / spread + log(spread)
        gain = variance / spread
        mean += gain * ahead
        variance *= 1.0 - gain
    return total
