"""Linearisation of a session around a fit, in the shared parameters of a model.

Search, evidence, intervals, alternatives and the choice of next throws all use it. A throw is the
Gram matrix of its whitened columns: the six numbers of its release, its own friction, the
parameters that all share, and the residual. The release is projected out, and the factor on its
friction is integrated over. Only the shared parameters remain.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from curling_env.physics.state import State
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.minimum import (
    Minimum,
    minimum_of,
    project_out,
    scaled_root,
)
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.quadratic import (
    integration_cost,
    prior_gram,
    profile_amplitudes,
    profile_spread,
)
from friction_estimation.discovery.model.whitening import whiten_throw
from friction_estimation.discovery.tuning import RELEASE_SIGMA, USUAL_SPIN_SIGMA


def gram_matrix(session: Session, noise: SessionNoise, i: int, columns: Floats) -> Floats:
    """Whitened Gram matrix of the i-th throw, (m, m).

    Parameters
    ----------
    session, noise : throws, and the noise that whitens
    columns : (n, 3, m) values for x, y and theta, which are overwritten; the last column is NaN
        where nothing was measured
    """
    rows, m = session.rows(i), columns.shape[2]
    work = np.ascontiguousarray(columns)
    whiten_throw(work, session.times[rows], session.sigma[rows], noise.table(), np.empty(m))
    flat = work.reshape(-1, m)
    return flat.T @ flat


def release_steps(grams: Floats, changes: Floats) -> Floats:
    """Best steps of the releases after steps of all other parameters, (n, k, 6).

    Parameters
    ----------
    grams : (k, m, m) Gram matrices of releases, other parameters and residual
    changes : (n, k, m-7) steps of the other parameters
    """
    root, scale = release_roots(grams)
    right = grams[:, :6, -1] - np.einsum("kij,nkj->nki", grams[:, :6, 6:-1], changes)
    inverse = np.linalg.inv(root)
    return scale * np.einsum("kji,kjl,nkl->nki", inverse, inverse, scale * right)


def release_roots(grams: Floats) -> tuple[Floats, Floats]:
    """Roots of the information on each release, (k, 6, 6), and their units (k, 6)."""
    return scaled_root(_believed(grams)[:, :6, :6])


def _believed(grams: Floats) -> Floats:
    """Gram matrices with the weak prior of a release."""
    out = grams.copy()
    out[:, range(6), range(6)] += RELEASE_SIGMA**-2
    return out


def eliminate_factor(reduced: Floats, ln_factors: Floats, spread: float) -> tuple[Floats, Floats]:
    """Gram matrices with the random factor integrated out.

    Parameters
    ----------
    reduced : (k, m-6, m-6) as of `Linearisation.reduced`; factor first, residual last
    ln_factors : (k,) ln factors around which the columns were computed
    spread : τ

    Returns
    -------
    grams : (k, m-7, m-7)
    log_terms : (k,) ln(1 + τ²h)
    """
    if spread <= 0.0:
        # Without a spread the factor is one, and the residual excludes the present deviation.
        out = reduced[:, 1:, 1:].copy()
        u = ln_factors[:, None]
        out[:, :, -1] += u * reduced[:, 0, 1:]
        out[:, -1, :] += u * reduced[:, 0, 1:]
        out[:, -1, -1] += ln_factors**2 * reduced[:, 0, 0]
        return out, np.zeros(len(reduced))
    h = reduced[:, 0, 0]
    own = h + spread**-2
    cross = reduced[:, 0, 1:].copy()
    cross[:, -1] -= ln_factors / spread**2
    out = reduced[:, 1:, 1:] - cross[:, :, None] * cross[:, None, :] / own[:, None, None]
    out[:, -1, -1] += ln_factors**2 / spread**2
    return out, np.log1p(spread**2 * h)


FROZEN = 1e14
"""Information that keeps a release state where it is."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Linearisation:
    """Throws by parameters, around a point.

    Parameters
    ----------
    model : model whose shared parameters are those of the matrices, at the point; it may have fewer
    ln_factors : (k,) deviation of ln μ of each throw there
    grams : (k, 6 + P + 2, 6 + P + 2) of release, ln factor, shared parameters and residual
    """

    model: Model
    ln_factors: Floats
    grams: Floats

    @classmethod
    def of(
        cls,
        session: Session,
        noise: SessionNoise,
        model: Model,
        states: Floats,
        ln_factors: Floats,
        columns: Iterable[Floats],
    ) -> Linearisation:
        """Whiten columns by the noise, and add the prior of releases.

        Parameters
        ----------
        session, noise : throws and their noise
        model, ln_factors : as of the class
        states : (k, 6) releases there
        columns : (n, 3, 7 + P + 1) for each throw, derivatives of x, y and heading, as of
            `sensitivities`, and what is left of them, NaN where not measured; overwritten
        """
        grams = np.array([gram_matrix(session, noise, i, each) for i, each in enumerate(columns)])
        # Without a heading only the last metres show the spin, which reduces the drag of the band.
        blind = ~session.turns
        off = (session.usual_spins[blind] - states[blind, State.OMEGA]) / USUAL_SPIN_SIGMA
        grams[blind, State.THETA, State.THETA] += FROZEN
        if session.gates is not None:
            for across in (State.X, State.VX):
                grams[:, across, across] += FROZEN
        grams[blind, State.OMEGA, State.OMEGA] += USUAL_SPIN_SIGMA**-2
        grams[blind, State.OMEGA, -1] += off / USUAL_SPIN_SIGMA
        grams[blind, -1, State.OMEGA] += off / USUAL_SPIN_SIGMA
        grams[blind, -1, -1] += off**2
        return cls(model=model, ln_factors=ln_factors, grams=grams)

    @cached_property
    def reduced(self) -> Floats:
        """Gram matrices of ln factor, shared parameters and residual, (k, P + 2, P + 2)."""
        return project_out(_believed(self.grams), 6)

    @cached_property
    def prior(self) -> Floats:
        """Gram matrix of the priors of the model's parameters, (P + 1, P + 1)."""
        return prior_gram(self.model, self.grams.shape[1] - 7)

    def each(self, spread: float | None = None) -> tuple[Floats, Floats]:
        """Return the information of each throw on the shared parameters, its own friction
        integrated out.

        Parameters
        ----------
        spread : standard deviation of ln μ between throws; that of the model by default

        Returns
        -------
        grams : (k, P + 1, P + 1) of shared parameters and residual
        log_terms : (k,) ln determinants that the integration adds
        """
        at = self.model.spread if spread is None else spread
        return eliminate_factor(self.reduced, self.ln_factors, at)

    def total(self, spread: float | None = None) -> Floats:
        """Return the information of all throws and the priors, (P + 1, P + 1); `spread` as in
        `each`.
        """
        return self.each(spread)[0].sum(axis=0) + self.prior

    def minimum(self, spread: float | None = None) -> Minimum:
        """Return the minimum of `total`."""
        return minimum_of(self.total(spread))

    def deviance(self) -> float:
        """F at the point, with releases and factors at their best; infinite if numbers overflow."""
        grams, log_terms = self.each()
        deviance = float(grams[:, -1, -1].sum() + log_terms.sum() + self.prior[-1, -1])
        deviance += integration_cost(self.model, grams.sum(axis=0))
        return deviance if np.isfinite(deviance) else np.inf

    def least(self, kept: Sequence[int] | Indices | None = None) -> float:
        """Return F at its minimum over shared parameters, the spread and the sizes of fields.

        Parameters
        ----------
        kept : numbers of the parameters that are free, those of fields among them; all by default
        """
        count = self.reduced.shape[1] - 2
        chosen = np.append(np.arange(count) if kept is None else kept, count).astype(np.intp)
        columns = np.concatenate([[0], chosen + 1])
        part = self.reduced[:, columns[:, None], columns]
        prior = self.prior[np.ix_(chosen, chosen)]
        spread, least = profile_spread(part, self.ln_factors, prior)
        if not self.model.fields:
            return least
        grams, log_terms = eliminate_factor(part, self.ln_factors, spread)
        return profile_amplitudes(self.model, grams.sum(axis=0))[1] + float(log_terms.sum())
