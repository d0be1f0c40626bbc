"""Tails of an athlete's errors: the degrees of freedom of Student's t."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import gammaln

from agents.coaching.tuning import TAIL_EVIDENCE, TAILS
from curling_env.typing import Floats, Integers


def tails_of(distances: ArrayLike, measured: ArrayLike) -> float:
    """Estimate the degrees of freedom of the t-distribution of errors with these sizes.

    Maximum likelihood over the degrees of freedom and a common factor of all spreads. Tails are
    reported only if a normal distribution is far less likely: among few throws a wild one proves
    little.

    Parameters
    ----------
    distances : (n,) sum of the squares of each error over its spread (Mahalanobis, squared)
    measured : (n,) number of measured components

    Returns
    -------
    degrees of freedom, from the range of `TAILS`; infinite for normal errors
    """
    squares, count = np.asarray(distances, dtype=np.float64), np.asarray(measured)
    squares, count = squares[count > 0], count[count > 0]
    if not len(squares):
        return math.inf
    normal = _log_likelihood(squares, count, math.inf)
    found = [(_log_likelihood(squares, count, tails), tails) for tails in TAILS]
    best, tails = max(found)
    return tails if 2 * (best - normal) > TAIL_EVIDENCE else math.inf


def squared_distances(
    errors: Floats, variances: Floats, group: Integers, bias: Floats, covariance: Floats
) -> tuple[Floats, Integers]:
    """Return squared sizes of errors over their spread (n,), and numbers of measured components
    (n,).

    Parameters
    ----------
    errors : (n, 3); NaN where a component was not measured
    variances : (n, 3, 3) covariances of their measurement errors
    group : (n,) the group of each throw
    bias, covariance : (groups, 3) and (groups, 3, 3) of the errors of each group
    """
    sizes, count = np.zeros(len(errors)), np.isfinite(errors).sum(axis=1)
    for k, (error, variance, g) in enumerate(zip(errors, variances, group, strict=True)):
        seen = np.flatnonzero(np.isfinite(error))
        off = (error - bias[g])[seen]
        spread = (covariance[g] + variance)[np.ix_(seen, seen)]
        sizes[k] = off @ np.linalg.solve(spread, off) if len(seen) else 0.0
    return sizes, count


def _log_likelihood(squares: Floats, count: Integers, tails: float) -> float:
    """Return the log likelihood of the sizes with the most likely common factor of the spreads."""

    def given(log_factor: float) -> float:
        u = squares * math.exp(-2 * log_factor)
        if tails == math.inf:
            each = -count / 2 * math.log(2 * math.pi) - u / 2
        else:
            # The spreads are standard deviations, so the scale is smaller than they are.
            each = gammaln((tails + count) / 2) - gammaln(tails / 2)
            each -= count / 2 * math.log((tails - 2) * math.pi)
            each -= (tails + count) / 2 * np.log1p(u / (tails - 2))
        return float((each - count * log_factor).sum())

    found: Any = minimize_scalar(lambda f: -given(float(f)), bounds=(-2.0, 2.0), method="bounded")
    return -float(found.fun)
