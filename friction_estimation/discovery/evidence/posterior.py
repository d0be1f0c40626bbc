"""Draws from the joint posterior: shared parameters, the map, frictions and releases.

The shared parameters are drawn from their mixture over the spread; given them, the friction of each
throw and its release are Gaussian. All draws are independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.physics.state import State
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.intervals import mixture
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.linearisation import FROZEN, release_roots, release_steps
from friction_estimation.discovery.model.model import GLOBALS, Model
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.whitening import whiten_throw
from friction_estimation.discovery.tuning import RELEASE_SIGMA, USUAL_SPIN_SIGMA

DRAWS = 2000
"""Number of draws of a posterior: quantiles of 2.5 % are then accurate to a twentieth of a standard
deviation."""

MOST_CELLS = 4000
"""Maximum number of cells whose frictions are drawn: more would fill a hundred megabytes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Draws of everything that is uncertain in a fit.

    Parameters
    ----------
    names : (term, parameter) of the shared parameters, as of `Model.names`
    shared : (n, P) shared parameters, within their bounds
    spreads : (n,) standard deviation of ln μ between throws
    ln_factors : (n, k) deviation of ln μ of each throw
    states : (n, k, 6) release of each throw: x, y, vx, vy, theta, omega
    mu : (n, rows, columns) friction of the cells; None without a map, or with too many cells
    log_likelihood : (n, k) ln of the density of each throw's rows, with its release and its own
        friction integrated out [ln of 1/m and 1/rad per value]
    """

    names: list[tuple[str, str]]
    shared: Floats
    spreads: Floats
    ln_factors: Floats
    states: Floats
    mu: Floats | None
    log_likelihood: Floats


def draw_posterior(
    fitted: SessionFit, rng: np.random.Generator, *, draws: int = DRAWS
) -> Posterior:
    """Draw from the posterior of a fit.

    Parameters
    ----------
    fitted : the fit
    rng : randomness
    draws : number of draws
    """
    found = mixture(fitted)
    reduced = fitted.linear.reduced
    k, shared_count = len(fitted.session), reduced.shape[1] - 2
    constants = throw_constants(fitted)
    chosen = np.sort(rng.choice(len(found.weights), size=draws, p=found.weights))
    steps = np.empty((draws, shared_count))
    factors, likelihood = np.empty((draws, k)), np.empty((draws, k))
    vector = fitted.model.vector
    low, high = fitted.model.bounds
    for s in np.unique(chosen):
        own, spread = np.flatnonzero(chosen == s), float(found.spreads[s])
        noise = rng.standard_normal((len(own), shared_count))
        step = found.steps[s] + noise @ _root(found.covariances[s]).T
        steps[own] = np.clip(vector + step, low, high) - vector
        grams, log_terms = fitted.linear.each(spread)
        deviance = quadratic(grams, steps[own]) + log_terms + constants
        likelihood[own] = -0.5 * deviance
        factors[own] = _draw_factors(reduced, fitted.ln_factors, spread, steps[own], rng)
    # In the order of spreads neighbouring draws would resemble each other.
    order = rng.permutation(draws)
    steps, factors, likelihood = steps[order], factors[order], likelihood[order]
    changes = np.concatenate(
        [
            (factors - fitted.ln_factors)[:, :, None],
            np.broadcast_to(steps[:, None], (draws, k, shared_count)),
        ],
        axis=2,
    )
    return Posterior(
        names=fitted.model.names,
        shared=vector + steps,
        spreads=found.spreads[chosen][order],
        ln_factors=factors,
        states=_draw_states(fitted, changes, rng),
        mu=cells_of(fitted.model, vector + steps, rng),
        log_likelihood=likelihood,
    )


def quadratic(grams: Floats, steps: Floats) -> Floats:
    """|residual|² of every throw after steps of the shared parameters, (n, k).

    Parameters
    ----------
    grams : (k, P + 1, P + 1) Gram matrices of the shared parameters and the residual
    steps : (n, P)
    """
    moves = np.concatenate([-steps, np.ones((len(steps), 1))], axis=1)
    return np.einsum("ni,kij,nj->nk", moves, grams, moves, optimize=True)


def throw_constants(fitted: SessionFit) -> Floats:
    """Return the constants that make the deviance of each throw −2 ln of a density, (k,).

    The noise's ln variance, ln 2π for each value, and the contribution of integrating over its
    release: ln det of the information of the release, minus that of the release's prior.
    """
    prior = release_precisions(fitted.session)
    information = fitted.linear.grams[:, :6, :6] + np.eye(6) / RELEASE_SIGMA**2
    released = np.linalg.slogdet(information)[1] - np.log(prior).sum(axis=1)
    values = np.isfinite(fitted.session.observed).sum(axis=1)
    counts = np.add.reduceat(values, fitted.session.starts[:-1])
    return log_variances(fitted.session, fitted.noise) + counts * np.log(2 * np.pi) + released


def release_precisions(session: Session) -> Floats:
    """Diagonal of the prior information on releases, (k, 6)."""
    prior = np.tile(RELEASE_SIGMA**-2, (len(session), 1))
    blind = ~session.turns
    prior[blind, State.THETA] += FROZEN
    prior[blind, State.OMEGA] += USUAL_SPIN_SIGMA**-2
    return prior


def log_variances(session: Session, noise: SessionNoise) -> Floats:
    """Σ ln variance of the innovations of each throw, (k,)."""
    empty = np.where(np.isfinite(session.observed), 0.0, np.nan)[:, :, None]
    table, work = noise.table(), np.empty(1)
    out = np.empty(len(session))
    for i in range(len(session)):
        rows = session.rows(i)
        own = empty[rows].copy()
        out[i] = whiten_throw(own, session.times[rows], session.sigma[rows], table, work)
    return out


def cells_of(model: Model, vectors: Floats, rng: np.random.Generator) -> Floats | None:
    """Friction of every cell of the map, (n, rows, columns).

    None for a model without a map, and for one of more than `MOST_CELLS` cells.

    Parameters
    ----------
    model : the model
    vectors : (n, P) shared parameters
    rng : randomness of what the patterns of the map leave out
    """
    field = model.map_field
    if field is None or len(field.patterns) > MOST_CELLS:
        return None
    level = vectors[:, GLOBALS.index("ln_mu"), None]
    finer = rng.standard_normal((len(vectors), len(field.patterns)))
    ln_mu = level + vectors[:, model.map_slice] @ field.patterns.T
    ln_mu += field.amplitude * finer @ _root(field.unresolved_covariance()).T
    mu = model.ice.friction.mu
    return mu * np.exp(ln_mu).reshape(len(vectors), *mu.shape)


def _root(covariance: Floats) -> Floats:
    """Return a matrix whose product with its transpose is the covariance."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / scale[:, None] / scale)
    return scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))


def _draw_factors(
    reduced: Floats, ln_factors: Floats, spread: float, steps: Floats, rng: np.random.Generator
) -> Floats:
    """Deviations of ln μ of the throws, given spread and shared parameters, (n, k)."""
    noise = rng.standard_normal((len(steps), len(reduced)))
    if spread <= 0.0:
        return np.zeros_like(noise)
    own = reduced[:, 0, 0] + spread**-2
    right = reduced[:, 0, -1] - ln_factors / spread**2
    means = (right - steps @ reduced[:, 0, 1:-1].T) / own
    return ln_factors + means + noise / np.sqrt(own)


def _draw_states(fitted: SessionFit, changes: Floats, rng: np.random.Generator) -> Floats:
    """Releases of the throws, given the changes of all other parameters, (n, k, 6)."""
    grams = fitted.linear.grams
    # The inverse of the transposed Cholesky factor is a root of the covariance.
    root, scale = release_roots(grams)
    roots = np.swapaxes(np.linalg.inv(root), 1, 2)
    noise = rng.standard_normal((len(changes), len(grams), 6))
    scattered = scale * np.einsum("kij,nkj->nki", roots, noise)
    return fitted.states + release_steps(grams, changes) + scattered
