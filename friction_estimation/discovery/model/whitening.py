"""Whitening of residuals by the Kalman filter of their noise, which bridges lost frames.

The noise of a row is white plus an Ornstein–Uhlenbeck process. The innovations are independent and
of unit variance, so that every frame counts once.
"""

from __future__ import annotations

from math import exp
from typing import Any

import numpy as np

from curling_env.physics.compiled import compiled


@compiled
def whiten_series(
    columns: Any,
    times: Any,
    sigma: Any,
    white: float,
    fading: float,
    memory: float,
    state: Any,
) -> float:
    """Replace columns (n, m) by their innovations under the noise; returns Σ log variance.

    In row i both parts of the noise are sigma[i] times as large.
    """
    n, m = columns.shape
    for j in range(m):
        state[j] = 0.0
    log_variance = 0.0
    prior = fading * fading
    last = 0.0
    started = False
    for i in range(n):
        if np.isnan(columns[i, m - 1]):
            for j in range(m):
                columns[i, j] = 0.0
            continue
        keep = 0.0
        if started and fading > 0.0:
            keep = exp(-(times[i] - last) / memory)
        started = True
        last = times[i]
        # `prior` is the filter's variance of the correlated part in the row before.
        predicted = keep * keep * prior + fading * fading * (1.0 - keep * keep)
        variance = predicted + white * white
        gain = predicted / variance
        scale = 1.0 / np.sqrt(variance)
        weight = 1.0 / sigma[i]  # a product per column is faster than a quotient
        for j in range(m):
            expected = keep * state[j]
            innovation = weight * columns[i, j] - expected
            state[j] = expected + gain * innovation
            columns[i, j] = innovation * scale
        prior = (1.0 - gain) * predicted
        log_variance += np.log(variance * sigma[i] * sigma[i])
    return log_variance


@compiled
def restricted_square(gram: Any) -> float:
    """Return the last column's residual square given the others, plus their log determinant.

    Parameters
    ----------
    gram : (k + 1, k + 1) products of whitened columns; it is overwritten
    """
    last = gram.shape[0] - 1
    trace = 0.0
    for i in range(last):
        trace += gram[i, i]
    log_determinant = 0.0
    for i in range(last):
        gram[i, i] += 1e-9 * trace
    for i in range(last):
        pivot = gram[i, i]
        log_determinant += np.log(pivot)
        for j in range(i + 1, last + 1):
            share = gram[i, j] / pivot
            for k in range(j, last + 1):
                gram[j, k] -= share * gram[i, k]
    return gram[last, last] + log_determinant


@compiled
def whiten_throw(columns: Any, times: Any, sigma: Any, table: Any, state: Any) -> float:
    """Whiten columns (n, 3, m) of x, y, theta of a throw in place; returns Σ log variance.

    Rows whose last column is NaN (no heading) become zero and are not counted.

    Parameters
    ----------
    times, sigma : (n,), (n, 2) of its rows, as of `Session`
    table : (3, 3) from `SessionNoise.table`
    state : (m,) working memory
    """
    total = 0.0
    for channel in range(3):
        white, fading, memory = table[channel]
        own = columns[:, channel, :]
        total += whiten_series(own, times, sigma[:, channel // 2], white, fading, memory, state)
    return total
