"""Kernel regression: the expected value of a throw, from all simulations near it.

A throw intended as `a` leaves the hand as `a` + error, and its outcome does not depend on the
intention. So every executed throw is evidence on each throw whose error could have produced it. The
kernel is the density of the error, divided by the density of all executions (the balance heuristic
of multiple importance sampling, Veach and Guibas 1995); the weighted mean is a consistent estimate.
Lee, Kim, Choi and Lee (2018) and Yee, Lisý and Bowling (2016) share outcomes in the same way, with
kernels of a chosen width and without that denominator.
"""

from __future__ import annotations

import math

import numpy as np

from curling_env.typing import Floats, Singles


def estimate(
    asked: Floats,
    tried: Floats,
    counts: Floats,
    executed: Floats,
    values: Floats,
    sigma: Floats,
    *,
    tails: float = math.inf,
    correlation: float = 0.0,
) -> tuple[Floats, Floats]:
    """Estimate the expected value of throws.

    Parameters
    ----------
    asked : (a, 3) intended throws to evaluate
    tried : (m, 3) intended throws that were simulated
    counts : (m,) number of simulations of each
    executed : (n, 3) all executed throws, as they left the hand
    values : (n,) resulting value of each
    sigma : (3,) standard deviations of the error, all above 0
    tails, correlation : the rest of its distribution, see `curling_env.throw.Skill`

    Returns
    -------
    the mean value and its standard error, (a,) each
    """
    mean, error = np.empty(len(asked)), np.empty(len(asked))
    # The two handles are so different that throws of one are no evidence on the other.
    for side in (True, False):
        here, known = (asked[:, 2] > 0) == side, (executed[:, 2] > 0) == side
        if not here.any():
            continue
        centre = asked[here].mean(axis=0)
        source = (tried[:, 2] > 0) == side

        def standard(throws: Floats, centre: Floats = centre) -> Floats:
            z = (throws - centre) / sigma
            if correlation:
                z[:, 1] = (z[:, 1] - correlation * z[:, 0]) / math.sqrt(1 - correlation**2)
            return z

        x = standard(executed[known]).astype(np.float32)
        density = _density(standard(tried[source]), x, tails)
        tried_there = np.maximum(counts[source].astype(np.float32) @ density, 1e-12)
        weights = _density(standard(asked[here]), x, tails) / tried_there
        total = np.maximum(weights.sum(axis=1), 1e-12)
        value = values[known]
        mean[here] = (weights @ value) / total
        spread = (weights**2 @ value**2) - 2 * mean[here] * (weights**2 @ value)
        spread += mean[here] ** 2 * (weights**2).sum(axis=1)
        error[here] = np.sqrt(np.maximum(spread, 0)) / total
    return mean, error


def _density(means: Floats, x: Singles, tails: float) -> Singles:
    """Return the density of the error, up to a factor, of each x (n, 3) for each mean (m, 3): (m,
    n).
    """
    m = means.astype(np.float32)
    exponent = m @ x.T
    exponent -= 0.5 * (x * x).sum(axis=1)
    exponent -= 0.5 * (m * m).sum(axis=1)[:, None]
    np.minimum(exponent, 0, out=exponent)
    if tails < math.inf:
        # Student's t in three dimensions, with standard deviations of 1.
        exponent *= -2 / (tails - 2)
        np.log1p(exponent, out=exponent)
        exponent *= -(tails + 3) / 2
    return np.exp(exponent, out=exponent)
