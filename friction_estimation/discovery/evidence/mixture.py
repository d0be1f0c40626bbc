"""The posterior of the shared parameters: a mixture of Gaussians over the spread between throws.

Around a fit everything is quadratic. At a given spread of the throws' frictions the shared
parameters are therefore Gaussian; each spread weighs by the likelihood with the shared parameters
integrated out (the restricted likelihood; a plain maximum would be too narrow).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.tuning import (
    LEAST_THROWS_FOR_SPREAD,
    SPREADS,
    USUAL_SPREAD,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Mixture:
    """The posterior of the shared parameters.

    Parameters
    ----------
    spreads, weights : (s,) spreads of ln μ between throws, and the weight of each; they sum to one
    steps : (s, P) mean at each spread, from the fitted values
    covariances : (s, P, P)
    """

    spreads: Floats
    weights: Floats
    steps: Floats
    covariances: Floats


@lru_cache(maxsize=4)
def mixture(fitted: SessionFit) -> Mixture:
    """The posterior of the shared parameters of a fit."""
    spreads = integrated_spreads(fitted)
    linear = fitted.linear
    each = [linear.each(spread) for spread in spreads.tolist()]
    found = minimum_of(np.array([grams.sum(axis=0) for grams, _ in each]) + linear.prior)
    levels = found.level + np.array([log_terms.sum() for _, log_terms in each])
    return Mixture(
        spreads=spreads,
        weights=weights_of(levels, spreads),
        steps=found.step,
        covariances=found.covariance + (0.0 if fitted.by_paths is None else fitted.by_paths),
    )


def integrated_spreads(fitted: SessionFit) -> Floats:
    """Spreads over which the posterior of a fit is integrated."""
    if fitted.only_spread is not None:
        return np.array([fitted.only_spread])
    return np.array([USUAL_SPREAD]) if has_few_throws(fitted) else SPREADS


def has_few_throws(fitted: SessionFit) -> bool:
    """Return whether a session has too few throws to tell how far they differ."""
    return len(fitted.session) < LEAST_THROWS_FOR_SPREAD


def weights_of(levels: Floats, spreads: Floats) -> Floats:
    """Weights of spreads, which sum to one along the first axis.

    Parameters
    ----------
    levels : (s, ...) −2 ln of the likelihood at each spread
    spreads : (s,) spreads; all are equally likely beforehand
    """
    shape = (-1,) + (1,) * (levels.ndim - 1)
    weights = np.exp(-0.5 * (levels - levels.min(axis=0))) * widths(spreads).reshape(shape)
    return weights / weights.sum(axis=0)


def widths(spreads: Floats) -> Floats:
    """The part of the axis of spreads that each spread stands for, (s,)."""
    if len(spreads) == 1:
        return np.ones(1)
    middles = np.concatenate([[0.0], 0.5 * (spreads[1:] + spreads[:-1]), [spreads[-1]]])
    return np.diff(middles)
