"""How well each model foretells a throw that it was not fitted to: expected log predictive density.

The density of a throw under the fit to all the others, with what is uncertain integrated out: its
release and own friction, the shared parameters and the spread. Around a fit everything is
quadratic, so that a throw is left out by subtracting its Gram matrix, and every integral is a
Gaussian one. A parameter of which only that throw told falls back on a broad prior, as wide as its
card allows.

Source
------
Vehtari, Gelman and Gabry, Practical Bayesian model evaluation using leave-one-out cross-validation
and WAIC, Statistics and Computing 27 (2017), for the sums, differences and their errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.mixture import (
    integrated_spreads,
    levels_of,
    widths,
)
from friction_estimation.discovery.evidence.posterior import throw_constants
from friction_estimation.discovery.model.elimination import eliminate_factor, eliminate_states
from friction_estimation.discovery.model.fit import SessionFit, fit
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.quadratic import prior_gram

EVERY_SPREAD = 3
"""Of the spreads over which intervals integrate every third is used: their likelihood is smooth."""

WIDEST = 1e3
"""Standard deviation of that prior for a parameter without bounds, in its unit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictiveScore:
    """The expected log predictive density of a model.

    Parameters
    ----------
    name : name of the model
    per_throw : (k,) ln density of each throw under the fit to all the others
    elpd, se : their sum, and its standard error over throws
    difference, difference_se : the sum less that of the best model, and the standard error of the
        differences, throw by throw
    """

    name: str
    per_throw: Floats
    elpd: float
    se: float
    difference: float
    difference_se: float


class LeftOut(NamedTuple):
    """The shared parameters at one spread, with each throw left out.

    Parameters
    ----------
    whole : (P + 1, P + 1) Gram matrix of all throws and the priors
    others : (k, P + 1, P + 1) the same without each throw in turn
    log_terms : (k,) ln determinant that integrating over the friction of a throw adds
    """

    whole: Floats
    others: Floats
    log_terms: Floats


def left_out(fitted: SessionFit, spread: float) -> LeftOut:
    """The shared parameters of a fit at one spread, with each throw left out."""
    reduced = eliminate_states(fitted.grams)
    prior = prior_gram(fitted.model, reduced.shape[1] - 1) + broad_prior(fitted.model)
    grams, log_terms = eliminate_factor(reduced, fitted.ln_factors, spread)
    whole = grams.sum(axis=0) + prior
    return LeftOut(whole, whole - grams, log_terms)


def tried_spreads(fitted: SessionFit) -> Floats:
    """The spreads of ln μ between throws over which predictions are integrated."""
    return integrated_spreads(fitted)[::EVERY_SPREAD]


def broad_prior(model: Model) -> Floats:
    """Gram matrix of a broad prior around the fitted values, (P + 1, P + 1).

    Its standard deviations are those of even chances between a parameter's bounds; without bounds,
    it says next to nothing.
    """
    low, high = model.bounds
    deviations = np.minimum((high - low) / np.sqrt(12.0), WIDEST)
    return np.diag(np.append(deviations**-2.0, 0.0))


def left_out_densities(fitted: SessionFit) -> Floats:
    """Ln of the density of every throw under the fit to all the others, (k,).

    The unit is that of the measured values: 1/m for each coordinate, 1/rad for each heading.
    """
    log_widths = np.log(widths(tried_spreads(fitted)))
    whole, others = leave_one_out_levels(fitted)
    evidence = logsumexp(log_widths - 0.5 * whole)
    without = logsumexp(log_widths[:, None] - 0.5 * others, axis=0)
    return evidence - without - 0.5 * throw_constants(fitted)


def left_out_scores(fitted: SessionFit) -> Floats:
    """−2 ln of the density of every throw under the fit to all the others, (k,).

    It is that of `left_out_densities` at the spread of the fit, up to a constant of each throw.
    """
    each = left_out(fitted, fitted.model.spread)
    return levels_of(each.whole) - levels_of(each.others) + each.log_terms


def unseen_scores(fitted: SessionFit, session: Session) -> Floats:
    """The same of throws that a fit has not seen, each for itself, (k,)."""
    seen = fit(fitted.model, session, fitted.noise, shared=False)
    reduced = eliminate_states(seen.grams)
    grams, log_terms = eliminate_factor(reduced, seen.ln_factors, fitted.model.spread)
    whole = left_out(fitted, fitted.model.spread).whole
    return levels_of(whole + grams) - levels_of(whole) + log_terms


def leave_one_out_levels(fitted: SessionFit) -> tuple[Floats, Floats]:
    """−2 ln of the likelihood at each spread, of all throws (s,) and of all but one (s, k)."""
    whole: list[float] = []
    others: list[Floats] = []
    for spread in tried_spreads(fitted).tolist():
        each = left_out(fitted, spread)
        whole.append(float(levels_of(each.whole) + each.log_terms.sum()))
        others.append(levels_of(each.others) + each.log_terms.sum() - each.log_terms)
    return np.array(whole), np.array(others)


def compare_models(densities: Mapping[str, Floats]) -> list[PredictiveScore]:
    """Models in the order of their expected log predictive density, the best first.

    Parameters
    ----------
    densities : by name, (k,) ln density of each throw under the fit to all the others, of one
        session and with one noise
    """
    best = max(densities.values(), key=lambda each: float(each.sum()))
    scores = [
        PredictiveScore(
            name=name,
            per_throw=each,
            elpd=float(each.sum()),
            se=_error_of_sum(each),
            difference=float((each - best).sum()),
            difference_se=_error_of_sum(each - best),
        )
        for name, each in densities.items()
    ]
    return sorted(scores, key=lambda score: -score.elpd)


def _error_of_sum(values: Floats) -> float:
    """Standard error of the sum of independent values."""
    return float(np.sqrt(len(values)) * values.std(ddof=1)) if len(values) > 1 else 0.0
