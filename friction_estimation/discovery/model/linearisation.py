"""A session, linear around a fit: its throws by the shared parameters of a model.

Search, evidence, intervals, rivals and the planner of throws all ask this one object. A throw is
the Gram matrix of its whitened columns: the six numbers of its release, its own friction, the
parameters that all share, and the residual. The release is projected out (`elimination`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from curling_env.physics.state import State
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrices,
)
from friction_estimation.discovery.model.minimum import Minimum, minimum_of
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.quadratic import (
    integration_cost,
    prior_gram,
    profile_amplitudes,
    profile_spread,
)
from friction_estimation.discovery.tuning import USUAL_SPIN_SIGMA

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
        """Whiten columns by the noise, and add what is known of releases.

        Parameters
        ----------
        session, noise : throws and their noise
        model, ln_factors : as of the class
        states : (k, 6) releases there
        columns : (n, 3, 7 + P + 1) for each throw, derivatives of x, y and heading, as of
            `sensitivities`, and what is left of them, NaN where not measured
        """
        grams = gram_matrices(session, noise, columns)
        # Without a heading only the last metres show the spin, which eases the drag of the band.
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
        return eliminate_states(self.grams)

    @cached_property
    def prior(self) -> Floats:
        """Gram matrix of the priors of the model's parameters, (P + 1, P + 1)."""
        return prior_gram(self.model, self.grams.shape[1] - 7)

    def each(self, spread: float | None = None) -> tuple[Floats, Floats]:
        """Return what each throw says of the shared parameters, its own friction integrated out.

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
        """Return what all throws and the priors say, (P + 1, P + 1); `spread` as of `each`."""
        return self.each(spread)[0].sum(axis=0) + self.prior

    def minimum(self, spread: float | None = None) -> Minimum:
        """The minimum of `total`."""
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
