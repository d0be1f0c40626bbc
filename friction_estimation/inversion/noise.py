"""The noise of measured distances: white, and correlated in time, both estimated from the data.

Frames are not independent. A tracker that smooths, a lens, compression err alike in neighbouring
frames; taking such frames for independent makes every σ too small. Errors are modelled as white
noise plus an Ornstein–Uhlenbeck process, and residuals and sensitivities are whitened by one
Kalman filter, exact for uneven times. Rows that the filter finds wild are left out.
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

GATE = 5.0
"""Standard deviations from its prediction beyond which a row is left out."""
WORTHWHILE = 6.0
"""Gain in 2·ln likelihood that two more parameters must bring (χ²: 5 %)."""
FOLLOWING = 0.2
"""Correlation of successive increments above which a track counts as smoothed."""
LONGEST_SMOOTHING = 1.0
"""Longest smoothing considered [s]."""
SMALLEST = 1e-5
"""Least noise considered [m]: noise-free tracks must not divide by zero."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations and correlation time of the error of a measured distance.

    Parameters
    ----------
    white : of the part that is independent from frame to frame [m]
    slow : of the part that is correlated in time [m]
    time : after which that part's correlation has fallen to 1/e [s]
    spacing : rows closer than this to the last one used are passed over [s]: those of a smoothed
        track between them tell nothing new
    """

    white: float
    slow: float = 0.0
    time: float = 0.1
    spacing: float = 0.0

    @property
    def total(self) -> float:
        """Standard deviation of one row [m]."""
        return float(np.hypot(self.white, self.slow))

    def keep(self, t: Floats, left: Floats, scale: Floats) -> Flags:
        """Which rows agree with the noise; `scale` (n,) is each row's own relative noise."""
        keep = np.ones(len(t), dtype=np.bool_)
        _whiten(
            t,
            (left / scale)[:, None],
            *self._numbers,
            keep,
            True,
            np.zeros(1),
            np.empty((len(t), 1)),
        )
        return keep

    def whiten(self, t: Floats, columns: Floats, scale: Floats, keep: Flags) -> Floats:
        """Columns (n, k) made independent with unit noise, (rows used, k)."""
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

    def volume(self, t: Floats, scale: Floats, keep: Flags) -> float:
        """2·ln of the volume of the noise of the rows that `whiten` uses."""
        used = keep & spaced_rows(t, keep, self.spacing)
        spread = _misfit(t[used], np.zeros(int(used.sum())), *self._numbers)
        return float(spread + 2.0 * np.log(scale[used]).sum())

    @property
    def _numbers(self) -> tuple[float, float, float]:
        return max(self.white, SMALLEST) ** 2, self.slow**2, max(self.time, 1e-3)


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


Residual = tuple[Floats, Floats, Floats]
"""Times, residuals and relative noise of one throw's rows."""


def estimate_noise(
    residuals: Sequence[Residual], *, slowest: float = 2.0, start: Noise | None = None
) -> Noise:
    """The noise that makes the residuals of all throws most likely.

    Parameters
    ----------
    residuals : one per throw
    slowest : longest correlation time considered [s]
    start : where to look first; a slow part found before is refined

    Returns
    -------
    the noise; without a slow part unless the residuals clearly ask for one
    """
    spacing = smoothing_time(residuals)
    if spacing > 0:
        thin = []
        for t, left, scale in residuals:
            rows = spaced_rows(t, np.ones(len(t), dtype=np.bool_), spacing)
            thin.append((t[rows], left[rows], scale[rows]))
        residuals = thin
    pooled = np.concatenate([left / scale for _, left, scale in residuals])
    size = max(1.4826 * float(np.median(np.abs(pooled))), SMALLEST)
    steps = np.concatenate([np.diff(left / scale) for _, left, scale in residuals])
    quick = max(1.4826 * float(np.median(np.abs(steps))) / sqrt(2), SMALLEST)

    def cost(noise: Noise) -> float:
        white, slow, time = noise._numbers
        return sum(_misfit(t, left / scale, white, slow, time) for t, left, scale in residuals)

    def white_only(p: Floats) -> float:
        return cost(Noise(white=float(np.exp(p[0]))))

    def both(p: Floats) -> float:
        if not log(0.01) <= p[2] <= log(slowest):
            return 1e12 * (1 + abs(p[2]))
        return cost(Noise(white=exp(p[0]), slow=exp(p[1]), time=exp(p[2])))

    plain = minimize(white_only, [log(size)], method="Nelder-Mead", options={"xatol": 1e-3})
    best = plain
    guesses = [(quick, size, 0.1), (0.7 * size, 0.7 * size, 0.5 * slowest)]
    if start is not None and start.slow > 0:
        guesses = [(start.white, start.slow, min(start.time, 0.9 * slowest))]
    for guess in guesses:
        found = minimize(
            both,
            np.log(guess),
            method="Nelder-Mead",
            options={"xatol": 1e-2, "fatol": 1e-2, "maxiter": 150},
        )
        if found.fun < best.fun:
            best = found
    if plain.fun - best.fun < WORTHWHILE:
        return Noise(white=max(float(np.exp(plain.x[0])), SMALLEST), spacing=spacing)
    white, slow, time = (float(value) for value in np.exp(best.x))
    return Noise(white=max(white, SMALLEST), slow=slow, time=time, spacing=spacing)


def smoothing_time(residuals: Sequence[Residual]) -> float:
    """How far apart rows must be for their errors to be rough again [s]; 0 for raw tracks.

    Increments of white noise are anticorrelated, those of an Ornstein–Uhlenbeck process
    independent. Where they follow one another the track was smoothed: its errors then have no
    high frequencies from which the low ones, which bend μ, could be judged.
    """
    step = float(np.median(np.concatenate([np.diff(t) for t, _, _ in residuals])))
    for lag in range(1, int(LONGEST_SMOOTHING / step) + 2):
        product = square = 0.0
        for _, left, scale in residuals:
            rise = (left / scale)[::lag]
            rise = np.diff(rise)
            if len(rise) > 1:
                limit = GATE * 1.4826 * float(np.median(np.abs(rise))) + 1e-12
                rise = np.clip(rise, -limit, limit)
                product += float(rise[1:] @ rise[:-1])
                square += float(rise @ rise)
        if square == 0.0 or product < FOLLOWING * square:
            return 0.0 if lag == 1 else lag * step
    return LONGEST_SMOOTHING


@compiled
def _whiten(
    t: Any, columns: Any, white: float, slow: float, time: float, keep: Any, gate: bool,
    mean: Any, out: Any,
) -> None:  # fmt: skip
    """Innovations of the first column, and of all others with the first one's gains."""
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
            keep[i] = fabs(columns[i, 0] - mean[0]) <= GATE * sqrt(spread)
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
def _misfit(t: Any, left: Any, white: float, slow: float, time: float) -> float:
    """−2·ln likelihood; rows beyond the gate count as at it and do not steer the filter."""
    mean = 0.0
    variance = slow
    total = 0.0
    for i in range(t.shape[0]):
        if i > 0:
            fade = exp(-(t[i] - t[i - 1]) / time)
            variance = fade * fade * variance + slow * (1.0 - fade * fade)
            mean *= fade
        spread = variance + white
        ahead = left[i] - mean
        if ahead * ahead > GATE * GATE * spread:
            total += GATE * GATE + log(spread)
            continue
        total += ahead * ahead / spread + log(spread)
        gain = variance / spread
        mean += gain * ahead
        variance *= 1.0 - gain
    return total
