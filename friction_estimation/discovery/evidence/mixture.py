"""The posterior of the shared parameters: a mixture of Gaussians over the spread between throws.

Around a fit everything is quadratic. At a given spread of the throws' frictions the shared
parameters are therefore Gaussian; each spread weighs by the likelihood with the shared parameters
integrated out (the restricted likelihood; a plain maximum would be too narrow).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.tuning import (
    INTEGRATED_SPREADS,
    LEAST_THROWS_FOR_SPREAD,
    USUAL_SPREAD,
)

NO_INFORMATION = 1e-100
"""Of a parameter that no throw feels: its variance is huge, and still a number."""


class Gaussian(NamedTuple):
    """The minimum of quadratics, as the Gaussian that they are −2 ln of.

    Parameters
    ----------
    step : (..., P) where they are least, from the fitted values
    covariance : (..., P, P)
    level : (...) their least value and ln det of the information: −2 ln of the integral of the
        likelihood over the parameters, up to a constant
    """

    step: Floats
    covariance: Floats
    level: Floats


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


def mixture(fitted: SessionFit) -> Mixture:
    """The posterior of the shared parameters of a fit."""
    spreads = integrated_spreads(fitted)
    found: list[Gaussian] = []
    levels: list[float] = []
    for spread in spreads:
        grams, log_terms = fitted.linear.each(float(spread))
        found.append(gaussian(grams.sum(axis=0) + fitted.linear.prior))
        levels.append(float(found[-1].level + log_terms.sum()))
    by_paths = 0.0 if fitted.by_paths is None else fitted.by_paths
    return Mixture(
        spreads=spreads,
        weights=weights_of(np.array(levels), spreads),
        steps=np.array([each.step for each in found]),
        covariances=np.array([each.covariance for each in found]) + by_paths,
    )


def integrated_spreads(fitted: SessionFit) -> Floats:
    """Spreads over which the posterior of a fit is integrated."""
    if fitted.only_spread is not None:
        return np.array([fitted.only_spread])
    return np.array([USUAL_SPREAD]) if has_few_throws(fitted) else INTEGRATED_SPREADS


def has_few_throws(fitted: SessionFit) -> bool:
    """Return whether a session has too few throws to tell how far they differ."""
    return len(fitted.session) < LEAST_THROWS_FOR_SPREAD


def gaussian(totals: Floats) -> Gaussian:
    """The Gaussians of quadratics.

    Parameters
    ----------
    totals : (..., P + 1, P + 1) Gram matrices of the shared parameters and the residual, priors
        included
    """
    inner, right = totals[..., :-1, :-1], totals[..., :-1, -1]
    diagonal = np.einsum("...jj->...j", inner)
    scale = 1.0 / np.sqrt(np.maximum(diagonal, NO_INFORMATION))
    scaled = inner * scale[..., :, None] * scale[..., None, :]
    scaled = scaled + 1e-10 * np.eye(inner.shape[-1])
    inverse = np.linalg.inv(scaled)
    step = scale * np.einsum("...ij,...j->...i", inverse, scale * right)
    least = totals[..., -1, -1] - np.einsum("...j,...j->...", right, step)
    log_det = np.linalg.slogdet(scaled)[1] - 2.0 * np.log(scale).sum(axis=-1)
    return Gaussian(
        step=step,
        covariance=inverse * scale[..., :, None] * scale[..., None, :],
        level=least + log_det,
    )


def levels_of(totals: Floats) -> Floats:
    """The level of the Gaussians of quadratics alone, (...); as of `gaussian`, but much faster."""
    diagonal = np.einsum("...jj->...j", totals[..., :-1, :-1])
    scale = 1.0 / np.sqrt(np.maximum(diagonal, NO_INFORMATION))
    scaled = totals[..., :-1, :-1] * scale[..., :, None] * scale[..., None, :]
    root = np.linalg.cholesky(scaled + 1e-10 * np.eye(scaled.shape[-1]))
    right = np.linalg.solve(root, (scale * totals[..., :-1, -1])[..., None])[..., 0]
    log_det = 2.0 * np.log(np.einsum("...jj->...j", root) / scale).sum(axis=-1)
    return totals[..., -1, -1] - (right**2).sum(axis=-1) + log_det


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
