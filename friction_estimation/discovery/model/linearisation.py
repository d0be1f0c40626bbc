"""A session, linear around a fit: its throws by the shared parameters of a model.

Search, evidence, intervals, rivals and the planner of throws all ask this one object. A throw is
the Gram matrix of its whitened columns, its release projected out (`elimination`). The friction of
the throw is its first parameter, the residual its last; between them are those that all share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrices,
)
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.quadratic import (
    prior_gram,
    profile_amplitudes,
    profile_spread,
)
from friction_estimation.discovery.tuning import LEAST_SPREAD

SPREADS_OF_A_SEARCH = np.geomspace(LEAST_SPREAD, 0.3, 14)
"""Throw-to-throw spreads of ln μ that are tried beside the present one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Linearisation:
    """Throws by parameters, around a point.

    Parameters
    ----------
    model : model whose shared parameters are those of the matrices, at the point
    ln_factors : (k,) deviation of ln μ of each throw there
    reduced : (k, P + 2, P + 2) Gram matrices of ln factor, shared parameters and residual
    """

    model: Model
    ln_factors: Floats
    reduced: Floats

    @classmethod
    def whitened(
        cls,
        session: Session,
        noise: SessionNoise,
        model: Model,
        ln_factors: Floats,
        columns: Floats,
        residual: Floats,
    ) -> Linearisation:
        """Whiten columns by the noise, and project the releases out.

        Parameters
        ----------
        session, noise : throws and their noise
        model, ln_factors : as of the class
        columns : (rows, 3, 7 + P) derivatives of x, y and heading, as of `sensitivities`
        residual : (rows, 3) what is left of them; NaN where not measured
        """
        stacked = np.concatenate([columns, residual[:, :, None]], axis=2)
        reduced = eliminate_states(gram_matrices(session, noise, stacked))
        return cls(model=model, ln_factors=ln_factors, reduced=reduced)

    @cached_property
    def prior(self) -> Floats:
        """Gram matrix of the priors of the shared parameters, (P + 1, P + 1)."""
        return prior_gram(self.model, self.reduced.shape[1] - 1)

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
        spreads = np.array([*SPREADS_OF_A_SEARCH, max(self.model.spread, LEAST_SPREAD)])
        prior = self.prior[np.ix_(chosen, chosen)]
        spread, _, least = profile_spread(part, self.ln_factors, prior, spreads)
        if not self.model.fields:
            return least
        grams, log_terms = eliminate_factor(part, self.ln_factors, spread)
        return profile_amplitudes(self.model, grams.sum(axis=0))[1] + float(log_terms.sum())
