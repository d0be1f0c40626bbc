"""Kernel regression: what a throw is worth, from all that was tried near it.

A throw that is meant as `a` leaves the hand as `a` + error, and what happens then does not depend
on what was meant. So every execution tells of every throw whose error could have produced it: with
the density of the error as the kernel, and over the density with which executions were tried (the
balance heuristic of multiple importance sampling, Veach and Guibas 1995), the weighted mean is a
consistent estimate. Lee, Kim, Choi and Lee (2018) and Yee, Lisý and Bowling (2016) share outcomes
in the same way, with kernels of a chosen width and without that denominator.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats


def estimate(
    asked: Floats, tried: Floats, often: Floats, executed: Floats, worth: Floats, sigma: Floats
) -> tuple[Floats, Floats]:
    """Expected worth of throws.

    Parameters
    ----------
    asked : (a, 3) throws as meant, whose worth is asked for
    tried : (m, 3) throws as meant that were tried
    often : (m,) how often each
    executed : (n, 3) all executions, as they left the hand
    worth : (n,) of what each led to
    sigma : (3,) standard deviations of the error, all above 0

    Returns
    -------
    the mean worth, and its standard error, (a,) each
    """
    mean, error = np.empty(len(asked)), np.empty(len(asked))
    # Handles are far apart: what was thrown with one tells nothing of the other.
    for side in (True, False):
        here, known = (asked[:, 2] > 0) == side, (executed[:, 2] > 0) == side
        if not here.any():
            continue
        centre = asked[here].mean(axis=0)
        source = (tried[:, 2] > 0) == side
        x = ((executed[known] - centre) / sigma).astype(np.float32)
        density = _density((tried[source] - centre) / sigma, x)
        tried_there = np.maximum(often[source].astype(np.float32) @ density, 1e-12)
        weights = _density((asked[here] - centre) / sigma, x) / tried_there
        total = np.maximum(weights.sum(axis=1), 1e-12)
        value = worth[known]
        mean[here] = (weights @ value) / total
        spread = (weights**2 @ value**2) - 2 * mean[here] * (weights**2 @ value)
        spread += mean[here] ** 2 * (weights**2).sum(axis=1)
        error[here] = np.sqrt(np.maximum(spread, 0)) / total
    return mean, error


def _density(means: Floats, x: NDArray[np.float32]) -> NDArray[np.float32]:
    """Gaussian density, up to a factor, of each x (n, 3) under each mean (m, 3): (m, n)."""
    m = means.astype(np.float32)
    exponent = m @ x.T
    exponent -= 0.5 * (x * x).sum(axis=1)
    exponent -= 0.5 * (m * m).sum(axis=1)[:, None]
    np.minimum(exponent, 0, out=exponent)
    return np.exp(exponent, out=exponent)
