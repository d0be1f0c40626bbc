"""Whether forecasts err as often as they say: probability integral transforms of left-out throws.

Each throw is forecast from its first seconds by the fit to all the others. The transform is the
probability that the forecast gave to a place short of where the stone was last seen, and the same
to its left. Of an honest model these are spread evenly between 0 and 1: piled up at both ends, the
forecasts are surer than they should be; in the middle, less sure; to one side, they are biased.

Source
------
Dawid, Statistical theory: the prequential approach, JRSS A 147 (1984); with throws left out one by
one, Gelfand, Dey and Chang, Bayesian Statistics 4 (1992).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from curling_env.typing import Flags, Floats, Indices
from friction_estimation.discovery.evidence.mixture import gaussian, weights_of
from friction_estimation.discovery.evidence.predictive_density import (
    leave_one_out_levels,
    left_out,
    tried_spreads,
)
from friction_estimation.discovery.model.elimination import gram_matrices
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.sensitivity import sensitivities
from friction_estimation.discovery.tuning import FORECAST_SECONDS, LEAST_ROWS, RELEASE_SIGMA

LEAST_WEIGHT = 1e-4
"""Weight below which a spread is passed over."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LooPit:
    """Probability integral transforms of throws left out.

    Parameters
    ----------
    throws : (n,) numbers of the throws that are seen long enough to be forecast
    along : (n,) probability that the forecast gave to a shorter throw than was measured
    across : (n,) the same of a place further to the left, as the thrower sees it
    """

    throws: Indices
    along: Floats
    across: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class _LastRow:
    """The last row of a throw, and what its first seconds say.

    Parameters
    ----------
    early : (m, m) Gram matrix of the first seconds, as of `SessionFit.grams`
    response : (2, m - 1) how far along and to the right it moves with releases and parameters
    miss : (2,) measured less fitted place, along and to the right [m]
    noise : (2,) standard deviation of the measured place, along and to the right [m]
    """

    early: Floats
    response: Floats
    miss: Floats
    noise: Floats


def loo_pit(fitted: SessionFit) -> LooPit:
    """The probability integral transforms of all throws of a fit."""
    session = fitted.session
    early = session.times <= FORECAST_SECONDS
    seen = np.add.reduceat(early.astype(int), session.starts[:-1])
    long_enough = (seen >= LEAST_ROWS // 2) & ~early[session.starts[1:] - 1]
    chosen = np.flatnonzero(long_enough).tolist()
    rows = _last_rows(fitted, early)
    spreads = tried_spreads(fitted)
    weights = weights_of(leave_one_out_levels(fitted)[1], spreads)
    found = np.zeros((len(session), 2))
    for s in np.flatnonzero(weights.max(axis=1) > LEAST_WEIGHT):
        spread = float(spreads[s])
        others = left_out(fitted, spread).others
        for i in chosen:
            ln_factor = float(fitted.ln_factors[i])
            found[i] += weights[s, i] * _probability(rows[i], others[i], spread, ln_factor)
    found = np.clip(found[chosen], 0.0, 1.0)
    return LooPit(throws=session.throws[chosen], along=found[:, 0], across=found[:, 1])


def _last_rows(fitted: SessionFit, early: Flags) -> list[_LastRow]:
    """The last row of every throw."""
    session, noise = fitted.session, fitted.noise
    _, columns = sensitivities(fitted.model, session, fitted.states, fitted.ln_factors)
    columns = np.concatenate([columns, fitted.residuals[:, :, None]], axis=2)
    grams = gram_matrices(session.without_rows(~early), noise, columns[early])
    out: list[_LastRow] = []
    for i in range(len(session)):
        first, last = session.starts[i], session.starts[i + 1] - 1
        along = fitted.predicted[last, :2] - fitted.predicted[first, :2]
        along = along / max(float(np.hypot(*along)), 1e-9)
        axes = np.array([along, [along[1], -along[0]]])
        error = noise.total[:2] * session.sigma[last, 0]
        out.append(
            _LastRow(
                early=grams[i],
                response=axes @ columns[last, :2, :-1],
                miss=axes @ columns[last, :2, -1],
                noise=np.hypot(*(axes * error).T),
            )
        )
    return out


def _probability(row: _LastRow, others: Floats, spread: float, ln_factor: float) -> Floats:
    """Probability of a shorter throw and of a place further to the left than measured, (2,).

    Parameters
    ----------
    row : last row of the throw
    others : (P + 1, P + 1) Gram matrix of the shared parameters by the other throws
    spread : spread of ln μ between throws
    ln_factor : deviation of ln μ of this throw, around which the columns were computed
    """
    total, response, known = row.early.copy(), row.response, 0.0
    total[:6, :6] += np.diag(RELEASE_SIGMA**-2)
    total[7:, 7:] += others
    if spread > 0.0:
        pull = np.array([[1.0, -ln_factor], [-ln_factor, ln_factor**2]]) * spread**-2
        total[np.ix_([6, -1], [6, -1])] += pull
    else:  # no throw has a friction of its own: the deviation is taken back
        total[:-1, -1] += ln_factor * total[:-1, 6]
        known = -ln_factor * response[:, 6]
        total, response = np.delete(np.delete(total, 6, 0), 6, 1), np.delete(response, 6, 1)
    found = gaussian(total)
    deviation = np.sqrt(np.einsum("ai,ij,aj->a", response, found.covariance, response))
    off = row.miss - (response @ found.step + known)
    return norm.cdf(off / np.hypot(deviation, row.noise))
