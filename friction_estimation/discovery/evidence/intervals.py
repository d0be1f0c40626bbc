"""Standard errors of the parameters, whose 95 % intervals have their nominal coverage.

A dozen throws determine the spread of their frictions poorly, and everything that shows only
between throws (the friction itself, wear, drift, a stone) is as uncertain as that spread. The
spread is therefore integrated over: for every spread the shared parameters are Gaussian, and their
distribution is the mixture of these, weighted by the restricted likelihood (at the maximum alone it
would be too narrow). A standard error is the half-width of the central 95 % of the mixture over
1.96.

The sides of a patch along the sheet are placed by a scan (`place_sides`); other places that fit as
well are averaged over in the same way.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.stats import norm

from curling_env.ice_form import LevelError
from curling_env.typing import Floats
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.model import GLOBALS
from friction_estimation.discovery.search.patches import scan_side, sides_along
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

    @property
    def covariance(self) -> Floats:
        """Covariance of all spreads together, around the fitted values, (P, P)."""
        within = np.einsum("s,sij->ij", self.weights, self.covariances)
        return within + np.einsum("s,si,sj->ij", self.weights, self.steps, self.steps)


@lru_cache(maxsize=4)
def mixture(fitted: SessionFit) -> Mixture:
    """Return the posterior of the shared parameters of a fit."""
    spreads = integrated_spreads(fitted)
    linear = fitted.linear
    each = [linear.each(spread) for spread in spreads.tolist()]
    found = minimum_of(np.array([grams.sum(axis=0) for grams, _ in each]) + linear.prior)
    levels = found.level + np.array([log_terms.sum() for _, log_terms in each])
    return Mixture(
        spreads=spreads,
        weights=weights_of(levels, spreads),
        steps=found.step,
        covariances=found.covariance,
    )


def integrated_spreads(fitted: SessionFit) -> Floats:
    """Spreads over which the posterior of a fit is integrated."""
    if fitted.only_spread is not None:
        return np.array([fitted.only_spread])
    return np.array([USUAL_SPREAD]) if has_few_throws(fitted) else SPREADS


def has_few_throws(fitted: SessionFit) -> bool:
    """Return whether a session has too few throws to estimate their spread."""
    return len(fitted.session) < LEAST_THROWS_FOR_SPREAD


def weights_of(levels: Floats, spreads: Floats) -> Floats:
    """Weights of spreads, (s,), which sum to one.

    Parameters
    ----------
    levels : (s,) −2 ln of the likelihood at each spread
    spreads : (s,) spreads; all are equally likely beforehand
    """
    weights = np.exp(-0.5 * (levels - levels.min())) * widths(spreads)
    return weights / weights.sum()


def widths(spreads: Floats) -> Floats:
    """Width of the integration interval of each spread, (s,)."""
    if len(spreads) == 1:
        return np.ones(1)
    middles = np.concatenate([[0.0], 0.5 * (spreads[1:] + spreads[:-1]), [spreads[-1]]])
    return np.diff(middles)


NEARLY_ONE = 1e-9
"""Added to the diagonal of a correlation, so that it has a root despite rounding."""
LEAST_SIDE_SIGMA = 0.05
"""Minimum standard error of a side of a patch [m]: the distance between tried places."""


def standard_errors(fitted: SessionFit) -> dict[tuple[str, str], float]:
    """Standard errors of the shared parameters, by (term, parameter)."""
    posterior = mixture(fitted)
    deviations = np.sqrt(np.maximum(np.einsum("sjj->sj", posterior.covariances), 0.0))
    sigma = _half_widths(posterior.weights, posterior.steps, deviations)
    return dict(zip(fitted.model.names, sigma.tolist(), strict=True))


def map_errors(fitted: SessionFit) -> Floats | None:
    """Standard errors of ln μ of every cell, (rows, columns); None for a model without a map.

    They include the part of the field that its patterns omit, and the overall friction.
    """
    field = fitted.model.map_field
    if field is None:
        return None
    own = np.r_[GLOBALS.index("ln_mu"), fitted.model.map_slice]
    covariance = mixture(fitted).covariance[np.ix_(own, own)]
    columns = np.column_stack([np.ones(len(field.patterns)), field.patterns])
    variance = np.einsum("ci,ij,cj->c", columns, covariance, columns)
    variance += field.amplitude**2 * field.unresolved()
    return np.sqrt(np.maximum(variance, 0.0)).reshape(field.sheet.shape)


def common_errors(
    fitted: SessionFit,
) -> tuple[LevelError, dict[tuple[str, str], tuple[float, ...]]]:
    """Return the common parts of the errors of effects and of the friction's level.

    They have the form of an ice file.

    Their covariance is Gaussian with the spread between throws integrated over. The error of a
    parameter is a combination of those before it (a Cholesky root of their correlation); that of
    the level comes last, with its unexplained rest as a separate error.

    Returns
    -------
    the error of the level, and for every parameter of an effect, by (term, parameter), the common
    parts of its error
    """
    model = fitted.model
    names = [
        (k, name)
        for k, name in enumerate(model.names)
        if name[0] and model.term(name[0]).card.is_physical
    ]
    to_level = np.zeros(len(model.names))
    to_level[GLOBALS.index("ln_mu")] = 1.0
    if model.map_field is not None:
        to_level[model.map_slice] = model.map_field.patterns[model.map_field.crossed].mean(axis=0)
    rows = np.vstack([np.eye(len(to_level))[[k for k, _ in names]], to_level])
    covariance = rows @ mixture(fitted).covariance @ rows.T
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = deviations > 0.0  # the others are lost to rounding
    scale = np.where(known, 1.0 / np.where(known, deviations, 1.0), 0.0)
    correlation = covariance * scale[:, None] * scale
    correlation[np.diag_indices_from(correlation)] = 1.0 + NEARLY_ONE
    root = np.round(np.linalg.cholesky(correlation), 6)
    level = LevelError(sigma=float(deviations[-1]), common=tuple(root[-1, :-1].tolist()))
    return level, {name: tuple(root[i, : i + 1].tolist()) for i, (_, name) in enumerate(names)}


def _half_widths(weights: Floats, steps: Floats, deviations: Floats) -> Floats:
    """Half-widths of the central 95 % of mixtures of Gaussians, over 1.96, by bisection.

    Parameters
    ----------
    weights : (s,) weights of the Gaussians
    steps, deviations : (s, P) means, from the fitted values, and standard deviations
    """
    deviations = np.clip(deviations, 1e-300, 1e9)
    high = 20.0 * np.sqrt(weights @ (deviations**2 + steps**2)) + 1e-300
    low = np.zeros_like(high)
    for _ in range(50):
        half = 0.5 * (low + high)
        mass = norm.cdf((half - steps) / deviations) - norm.cdf((-half - steps) / deviations)
        inside = weights @ mass < 0.95
        low, high = np.where(inside, half, low), np.where(inside, high, half)
    return high / norm.ppf(0.975)


def with_sides(
    fitted: SessionFit, sigma: dict[tuple[str, str], float]
) -> dict[tuple[str, str], float]:
    """Return standard errors that include the uncertainty of the sides of patches.

    Parameters
    ----------
    fitted : fit, with or without a patch
    sigma : standard errors for the sides where they are; those of the sides are added
    """
    out = dict(sigma)
    for label, side in sides_along(fitted.model):
        shifts, deviances, steps = scan_side(fitted, label, side)
        weights = np.exp(-0.5 * (deviances - deviances.min())) * np.gradient(shifts)
        weights /= weights.sum()
        out[label, side] = float(np.sqrt(max(weights @ shifts**2, LEAST_SIDE_SIGMA**2)))
        for name, moved in zip(fitted.model.names, weights @ steps**2, strict=True):
            if name[0] == label:
                out[name] = float(np.hypot(out[name], np.sqrt(moved)))
    return out
