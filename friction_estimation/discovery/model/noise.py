"""Noise of a session's tracks: its size, its correlation from frame to frame, and its outliers.

The error of a row is white noise plus a part with a correlation time of some tenths of a second, an
Ornstein–Uhlenbeck process, due to a tracker's smoother, compression, or a ripple of the
calibration.

Its size is estimated from the fast part of the residuals, which no slide can have. Slow residuals
may be an effect that the model lacks, and must not count as noise.

Errors of tracks from film last for seconds (`Session.smoothed`), so their correlation time may be
longer. Slower errors depend on the place (`gaussian_field.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from curling_env.typing import Flags, Floats, Indices
from friction_estimation.discovery.data.outliers import fast_series, robust_deviation, slow_basis
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.whitening import restricted_square, whiten_series
from friction_estimation.discovery.tuning import (
    FILM_MEMORY_BOUNDS,
    LEAST_NOISE,
    LEAST_ROWS,
    MEMORY_BOUNDS,
    NOISE_THROWS,
    OUTLIER_DEVIATIONS,
    SLOW_HEADING_SHARE,
    SLOWEST_FILM_NOISE_PERIOD,
    SMOOTHED_PERIOD,
)


@dataclass(frozen=True, kw_only=True)
class CoordinateNoise:
    """Noise of one measured coordinate.

    Parameters
    ----------
    white : standard deviation of the independent part [m]
    slow : standard deviation of the part with a memory [m]
    time : time in which that part fades to 1/e [s]
    """

    white: float
    slow: float = 0.0
    time: float = 0.0

    @property
    def total(self) -> float:
        """Standard deviation of a row [m]."""
        return float(np.hypot(self.white, self.slow))


class Series(NamedTuple):
    """One coordinate of a throw, for the estimation of its noise.

    Parameters
    ----------
    t : (n,) times [s]
    sigma : (n,) relative noise of the rows
    columns : (n, k + 1) what may be no noise, k curves, and the values
    """

    t: Floats
    sigma: Floats
    columns: Floats


@dataclass(frozen=True, kw_only=True)
class SessionNoise:
    """Noise of x, y and the heading.

    Parameters
    ----------
    white : standard deviations of the independent part of x, y and the heading [m, m, rad]
    fading : the same of the part with a memory
    memory : time in which that part fades to 1/e [s]
    """

    white: tuple[float, float, float]
    fading: tuple[float, float, float]
    memory: tuple[float, float, float]

    @property
    def total(self) -> Floats:
        """Standard deviations of a row, (3,) [m, m, rad]."""
        return np.hypot(self.white, self.fading)

    @property
    def position(self) -> float:
        """Standard deviation of a coordinate, over x and y [m]."""
        return float(np.sqrt((self.total[:2] ** 2).mean()))

    @property
    def coordinate(self) -> CoordinateNoise:
        """The noise of a coordinate, over x and y."""
        white, slow = (
            float(np.sqrt(np.mean(np.square(part[:2])))) for part in (self.white, self.fading)
        )
        return CoordinateNoise(white=white, slow=slow, time=max(self.memory[:2]) if slow else 0.0)

    @property
    def remembers(self) -> bool:
        """Return whether the noise of positions has a memory."""
        return max(self.fading[:2]) > 0.0

    @property
    def lasts(self) -> bool:
        """Return whether the noise of positions has a longer correlation time than in most raw
        tracks.
        """
        return self.remembers and max(self.memory[:2]) > MEMORY_BOUNDS[1]

    def table(self) -> Floats:
        """Columns white, fading and memory; rows x, y and theta; (3, 3), for the kernel."""
        return np.ascontiguousarray(np.array([self.white, self.fading, self.memory]).T)


def fast_cosines(t: Floats) -> Floats:
    """Cosines that a smoother flattens, (n, K).

    They contain no information on the slow part of the noise.
    """
    span = max(float(t[-1] - t[0]), 1e-9)
    first = int(2 * span / SMOOTHED_PERIOD) + 1
    return np.cos(np.pi * (t - t[0])[:, None] / span * np.arange(first, len(t) - 1))


def fast_part(session: Session, residuals: Floats) -> Floats:
    """Return the part of residuals (rows, 3) that is faster than any slide; NaN if not measured."""
    out = np.full_like(residuals, np.nan)
    for i in range(len(session)):
        rows = session.rows(i)
        for channel in range(3):
            known = rows.start + np.flatnonzero(np.isfinite(residuals[rows, channel]))
            if len(known) >= LEAST_ROWS:
                out[known, channel] = fast_series(session.times[known], residuals[known, channel])
    return out


def outlying_rows(session: Session, residuals: Floats) -> Flags:
    """Return rows that contradict their neighbours; never the first of a throw.

    Smoothed tracks have no outliers: a smoother drops or spreads them.

    Parameters
    ----------
    session : throws
    residuals : (rows, 3) measured less predicted x, y, theta
    """
    if session.smoothed:
        return np.zeros(len(residuals), dtype=bool)
    fast = fast_part(session, residuals)
    outlying = np.zeros(len(fast), dtype=bool)
    for channel in range(3):
        values = fast[:, channel] / session.sigma[:, channel // 2]
        known = np.isfinite(values)
        if known.sum() < LEAST_ROWS:
            continue
        spread = robust_deviation(values[known])
        limit = OUTLIER_DEVIATIONS * max(spread, LEAST_NOISE[channel // 2])
        outlying |= known & (np.abs(values) > limit)
    outlying[session.starts[:-1]] = False
    return outlying


def estimate_noise(
    session: Session,
    residuals: Floats,
    *,
    throws: int = NOISE_THROWS,
    start: SessionNoise | None = None,
    lasting: bool = False,
) -> SessionNoise:
    """Return the noise that makes the fast part of the residuals most likely.

    Slow cosines of each throw are projected out, so that an effect that the model lacks does not
    count as noise. Raw tracks are assumed to have equal errors in x and y; those of a film are not,
    because a low camera sees one of them foreshortened.

    Parameters
    ----------
    session : throws
    residuals : (rows, 3) measured less predicted x, y, theta
    throws : most throws that are used, spread over the session
    start : an earlier estimate, from which fewer steps are needed
    lasting : whether the noise of raw tracks, too, may last for seconds, as that of films
    """
    if session.gates is not None:
        stated = session.gates.noise
        return SessionNoise(
            white=(stated, stated, LEAST_NOISE[1]),
            fading=(0.0, 0.0, 0.0),
            memory=(MEMORY_BOUNDS[0], MEMORY_BOUNDS[0], MEMORY_BOUNDS[0]),
        )
    slow = lasting or session.smoothed or (start is not None and start.lasts)
    chosen = np.unique(np.linspace(0, len(session) - 1, min(throws, len(session))).astype(int))
    together = ((0,), (1,), (2,)) if session.smoothed else ((0, 1), (2,))
    fast = fast_part(session, residuals)
    found = {
        channels: _estimate_channel(
            session,
            residuals,
            fast,
            chosen,
            channels,
            start
            and (start.white[channels[0]], start.fading[channels[0]], start.memory[channels[0]]),
            slow,
        )
        for channels in together
    }
    each = [found[channels] for channels in together for _ in channels]
    white, fading, memory = (tuple(values) for values in zip(*each, strict=True))
    return SessionNoise(
        white=white,  # pyright: ignore[reportArgumentType]
        fading=fading,  # pyright: ignore[reportArgumentType]
        memory=memory,  # pyright: ignore[reportArgumentType]
    )


def _estimate_channel(
    session: Session,
    residuals: Floats,
    fast: Floats,
    chosen: Indices,
    channels: tuple[int, ...],
    before: tuple[float, float, float] | None,
    slow: bool,
) -> tuple[float, float, float]:
    """Return white part, correlated part and correlation time of some of the channels x, y, theta
    together.

    Parameters
    ----------
    fast : (rows, 3) the part of the residuals that is faster than any slide
    """
    least = LEAST_NOISE[channels[0] // 2]
    bounds = FILM_MEMORY_BOUNDS if slow else MEMORY_BOUNDS
    lasting_turn = SLOW_HEADING_SHARE * session.claimed_turn if channels == (2,) else 0.0
    series = _series_of(session, residuals, chosen, channels, slow)
    if not series:
        # So few rows show no noise. Those of a film have their stated errors, with the correlation
        # time of films.
        claimed = session.claimed_turn if channels == (2,) else session.claimed
        return least, claimed, bounds[1]
    size = max(_rough_size(fast[:, list(channels)], series), least)
    white, fading, memory = most_likely_noise(series, size, memory=bounds, before=before)
    if fading < lasting_turn:
        # The slow part was projected out, and with it most of the error of a heading.
        fading, memory = lasting_turn, bounds[1]
    return max(white, 0.1 * least), fading, memory


def _series_of(
    session: Session,
    residuals: Floats,
    chosen: Indices,
    channels: tuple[int, ...],
    slow: bool,
) -> list[Series]:
    """Return the series of some channels with enough rows, and the shapes that are not noise."""
    series: list[Series] = []
    for i in chosen:
        rows = session.rows(int(i))
        for channel in channels:
            values = residuals[rows, channel]
            known = np.isfinite(values)
            if known.sum() < (LEAST_ROWS if session.smoothed else 1):
                continue
            t = session.times[rows][known]
            basis = slow_basis(t, SLOWEST_FILM_NOISE_PERIOD) if slow else slow_basis(t)
            if session.smoothed:
                basis = np.column_stack([basis, fast_cosines(t)])
            sigma = session.sigma[rows, channel // 2][known]
            if len(t) > basis.shape[1]:
                series.append(Series(t, sigma, np.column_stack([basis, values[known]])))
    return series


def _rough_size(fast: Floats, series: Sequence[Series]) -> float:
    """Rough standard deviation of a noise, from which its search begins.

    Parameters
    ----------
    fast : the part of the residuals that is faster than any slide; NaN where rows are few
    series : coordinates with this noise
    """
    if np.isfinite(fast).any():
        return 1.4826 * float(np.nanmedian(np.abs(fast)))
    left = [
        np.linalg.norm(c[:, -1] - c[:, :-1] @ np.linalg.lstsq(c[:, :-1], c[:, -1])[0])
        / np.sqrt(len(c) - c.shape[1] + 1)
        for c in (one.columns for one in series)
    ]
    return float(np.median(left))


def most_likely_noise(
    series: Sequence[Series],
    size: float,
    *,
    memory: tuple[float, float],
    before: tuple[float, float, float] | None = None,
) -> tuple[float, float, float]:
    """Return white part, correlated part and correlation time of a noise, by restricted maximum
    likelihood.

    Parameters
    ----------
    series : coordinates with this noise
    size : rough standard deviation of the noise [m or rad]
    memory : shortest and longest memory [s]
    before : an earlier estimate, from which fewer steps are needed
    """

    def deviance(guess: Floats) -> float:
        white, fading = np.exp(guess[:2])
        lasts = float(np.exp(np.clip(guess[2], *np.log(memory))))
        total = 0.0
        for t, sigma, columns in series:
            work = columns.copy()
            log_variance = whiten_series(
                work, t, sigma, white, fading, lasts, np.empty(work.shape[1])
            )
            total += log_variance + restricted_square(work.T @ work)
        outside = guess[2] - np.clip(guess[2], *np.log(memory))
        return total + 1e3 * outside**2

    begins = [(size * np.sqrt(1 - share), size * np.sqrt(share), 0.15) for share in (0.1, 0.9)]
    if before is not None:
        begins = [(before[0], max(before[1], 0.05 * before[0]), before[2])]
    best: Any = None
    for begin in begins:
        first = np.log(begin)
        simplex = first + np.vstack([np.zeros(3), (0.5 if before is None else 0.25) * np.eye(3)])
        found = minimize(
            deviance,
            first,
            method="Nelder-Mead",
            options={
                "initial_simplex": simplex,
                "maxfev": 90 if before is None else 45,
                "xatol": 0.03,
                "fatol": 0.5,
            },
        )
        if best is None or found.fun < best.fun:
            best = found
    white, fading = np.exp(best.x[:2])
    lasts = float(np.exp(np.clip(best.x[2], *np.log(memory))))
    return float(white), float(fading) if fading >= 0.05 * white else 0.0, lasts
