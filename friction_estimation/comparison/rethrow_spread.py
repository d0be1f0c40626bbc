"""Uncertainty of a predicted rest, from the errors of the ice and of the measured release.

A throw is repeated on ices drawn from the standard errors of the ice. On each of them the release
is fitted again to the first seconds, to positions with new noise of the measured size. Errors of
ice and release that compensate each other are therefore not counted twice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from curling_env.analysis.ice_uncertainty import plausible_ices
from curling_env.analysis.tuning import MIN_RESTED_SHARE
from curling_env.ice import Ice
from curling_env.physics.batch import release_table, throw_batch
from curling_env.physics.slides import SlideEnd
from curling_env.throw import MAX_SPEED, MAX_SPIN
from curling_env.typing import Floats
from friction_estimation.comparison.rethrow_result import Rethrow
from friction_estimation.discovery.model.noise import CoordinateNoise, Series, most_likely_noise
from friction_estimation.tracks.outliers import robust_deviation
from friction_estimation.tracks.tuning import USUAL_SPIN

SPREAD_ICES = 128
"""Ices on which a throw is repeated; σ is then known to 9 %."""
NOISE_THROWS = 12
"""Number of throws from which the noise of the positions is estimated."""
BEND_TIME = 8.0
"""Longest period of residuals that count as noise of positions; slower ones come from the ice
[s]."""
MEMORY = (0.05, 4.0)
"""Shortest and longest correlation time of the noise [s]."""
LEAST_NOISE = 1e-5
"""Smallest noise that is considered [m], so that exact tracks do not divide by zero."""
EARLY_ROWS = 20.0
"""Rows a second at which the first seconds on two ices are compared [1/s]."""


def position_noise(throws: Sequence[Rethrow]) -> CoordinateNoise | None:
    """Noise of one coordinate of the measured positions; None if there are too few rows to estimate
    it.

    Parameters
    ----------
    throws : of one session
    """
    series: list[Series] = []
    jitter: list[float] = []
    for throw in throws[:NOISE_THROWS]:
        # Around the stop, paths that end at different times diverge.
        moving = throw.t <= 0.8 * min(throw.t[-1], throw.predicted_time)
        t = throw.t[moving]
        degree = 2 + int(t[-1] / BEND_TIME) if len(t) else 0
        if len(t) < 4 * (degree + 1):
            continue
        curve = np.polynomial.legendre.legvander(2.0 * t / t[-1] - 1.0, degree)
        for residual in (throw.measured - throw.predicted)[moving].T:
            series.append(Series(t, np.ones(len(t)), np.column_stack([curve, residual])))
            bend = np.linalg.lstsq(curve, residual, rcond=None)[0]
            jitter.append(robust_deviation(residual - curve @ bend))
    if not series:
        return None
    size = max(float(np.median(jitter)), LEAST_NOISE)
    white, slow, time = most_likely_noise(series, size, memory=MEMORY)
    return CoordinateNoise(white=white, slow=slow, time=time if slow else 0.0)


def rest_spread(
    throw: Rethrow, ice: Ice, noise: CoordinateNoise | None, *, heading_seen: bool
) -> tuple[float, float] | None:
    """Standard deviations of a predicted rest less the measured one.

    Parameters
    ----------
    throw : throw and its prediction
    ice : the ice on which it was predicted
    noise : noise of the positions to which its release was fitted
    heading_seen : whether the spin was measured; otherwise it may be any usual one

    Returns
    -------
    across and along the sheet [m]; None if the stone may well not rest on the ice
    """
    rng = np.random.default_rng(throw.release.order)
    ices = plausible_ices(ice, SPREAD_ICES, rng)
    which = np.arange(SPREAD_ICES) % len(ices)
    table = np.repeat(release_table([throw.release]), SPREAD_ICES)
    at = throw.t[~throw.tested]
    if len(ices) > 1:
        seconds = max(float(at[-1]), 1.0)
        early = throw_batch(ices, table, which=which, fps=EARLY_ROWS, longest=seconds)
        alone = throw_batch(ice, table[:1], fps=EARLY_ROWS, longest=seconds)
        assert early.paths is not None  # a rate was given
        assert alone.paths is not None
        apart = early.paths[:, :, :2] - alone.paths[:, :, :2]
        t = np.arange(apart.shape[1]) / EARLY_ROWS
        seen = np.isfinite(apart).all(axis=(0, 2))
        for names, column in ((("x", "vx"), 0), (("y", "vy"), 1)):
            start, speed = np.polynomial.polynomial.polyfit(t[seen], apart[:, seen, column].T, 1)
            table[names[0]] -= start
            table[names[1]] -= speed
    if noise is not None:
        root = np.linalg.cholesky(_line_covariance(at, noise))
        for names in (("x", "vx"), ("y", "vy")):
            start, speed = root @ _pairs(rng, 2)
            table[names[0]] += start
            table[names[1]] += speed
    if not heading_seen:
        table["omega"] += USUAL_SPIN * _pairs(rng, 1)[0]
    table["omega"] = np.clip(table["omega"], -MAX_SPIN, MAX_SPIN)
    excess = np.maximum(np.hypot(table["vx"], table["vy"]) / (0.999 * MAX_SPEED), 1.0)
    table["vx"] /= excess
    table["vy"] /= excess
    rests = throw_batch(ices, table, which=which)
    rested = rests.end == SlideEnd.REST
    if rested.mean() < MIN_RESTED_SHARE:
        return None
    # The measured rest is the median of the last tenth of a second, some three rows.
    measured = 0.0 if noise is None else np.hypot(noise.white / np.sqrt(2.0), noise.slow)
    across, along = rests.x[rested].std(), rests.y[rested].std()
    return float(np.hypot(across, measured)), float(np.hypot(along, measured))


def _pairs(rng: np.random.Generator, rows: int) -> Floats:
    """Independent Gaussian numbers of variance 1 whose mean is zero, (rows, SPREAD_ICES).

    Ices come in pairs of opposite sign, neighbours in their list; these numbers are paired
    differently.
    """
    half = rng.standard_normal((rows, SPREAD_ICES // 2))
    return np.concatenate([half, -half], axis=1)


def _line_covariance(t: Floats, noise: CoordinateNoise) -> Floats:
    """Covariance of start [m] and speed [m/s] of a line fitted to noisy positions, (2, 2)."""
    fit = np.linalg.pinv(np.column_stack([np.ones_like(t), t]))
    apart = np.abs(t[:, None] - t[None, :])
    alike = np.exp(-apart / noise.time) if noise.slow else np.zeros_like(apart)
    of_rows = noise.white**2 * np.eye(len(t)) + noise.slow**2 * alike
    return fit @ of_rows @ fit.T
