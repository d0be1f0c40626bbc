"""Predictive density of a throw under a fit to all the others.

All uncertain quantities are integrated out: the throw's release and own friction, and the shared
parameters. Around a fit everything is quadratic, so that a throw is excluded by subtracting its
Gram matrix, and every integral is a Gaussian one. A parameter that only that throw constrains falls
back on a broad prior, as wide as its card allows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.fit import SessionFit, fit
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.model import Model

WIDEST = 1e3
"""Standard deviation of that prior for a parameter without bounds, in its unit."""


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


def left_out(fitted: SessionFit) -> LeftOut:
    """The shared parameters of a fit at its spread, with each throw left out."""
    grams, log_terms = fitted.linear.each()
    whole = grams.sum(axis=0) + fitted.linear.prior + broad_prior(fitted.model)
    return LeftOut(whole, whole - grams, log_terms)


def broad_prior(model: Model) -> Floats:
    """Gram matrix of a broad prior around the fitted values, (P + 1, P + 1).

    Its standard deviations are those of even chances between a parameter's bounds; without bounds,
    it says next to nothing.
    """
    low, high = model.bounds
    deviations = np.minimum((high - low) / np.sqrt(12.0), WIDEST)
    return np.diag(np.append(deviations**-2.0, 0.0))


def left_out_scores(fitted: SessionFit) -> Floats:
    """−2 ln of the density of every throw under the fit to all the others, (k,).

    It is up to a constant of each throw.
    """
    each = left_out(fitted)
    return minimum_of(each.whole).level - minimum_of(each.others).level + each.log_terms


def unseen_scores(fitted: SessionFit, session: Session) -> Floats:
    """The same of throws that a fit has not seen, each for itself, (k,)."""
    seen = fit(fitted.model, session, fitted.noise, shared=False)
    grams, log_terms = seen.linear.each(fitted.model.spread)
    whole = left_out(fitted).whole
    return minimum_of(whole + grams).level - minimum_of(whole).level + log_terms
