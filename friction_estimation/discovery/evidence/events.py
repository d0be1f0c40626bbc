"""What happened once: a pick, a touch, a lost track. It must not pass for an effect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.fit import (
    Fit,
    eliminate_factor,
    eliminate_states,
    fit,
    prior_gram,
    solve_shared,
)
from friction_estimation.discovery.search.residuals import doubt_of
from friction_estimation.discovery.search.selection import place_sides

SURPRISING = 6.0
"""Standard deviations of χ² beyond which a throw differs from the model."""
CONCENTRATED = 0.7
"""Part of all misfit that goes with the throws in which something may have happened once."""
MOST_EVENTS = 0.15
"""Part of the throws in which something may have happened once; more is no accident."""


def odd_throws(best: Fit, session: Session) -> NDArray[np.intp]:
    """Indices of a few throws without which the others agree.

    Fitted together with the rest, an odd throw bends the model and spoils them all. Around the fit
    with whatever was selected, proved or not, throws are left out one by one, and what the others
    then leave is compared with what they left before.

    Parameters
    ----------
    best : fit of some of the throws with whatever was selected
    session : all throws
    """
    whole = place_sides(fit(best.model, session, best.noise))
    values = np.isfinite(session.observed).sum(axis=1)
    dof = np.add.reduceat(values, session.starts[:-1]) * doubt_of(session)
    odd: list[int] = []
    excess = _excess_without(whole, odd, dof)
    if excess < SURPRISING * np.sqrt(2.0 * dof.sum()):
        return np.empty(0, dtype=np.intp)
    for _ in range(max(1, int(MOST_EVENTS * len(session)))):
        others = [i for i in range(len(session)) if i not in odd]
        odd.append(min(others, key=lambda i: _excess_without(whole, [*odd, i], dof)))
        if _excess_without(whole, odd, dof) < (1.0 - CONCENTRATED) * excess:
            return np.sort(np.array(odd, dtype=np.intp))
    return np.empty(0, dtype=np.intp)


def _excess_without(whole: Fit, odd: list[int], dof: NDArray[np.float64]) -> float:
    """χ² beyond expectation of the other throws, fitted without the odd ones."""
    reduced = eliminate_states(whole.grams)
    grams, _ = eliminate_factor(reduced, whole.ln_factors, whole.model.spread)
    others = np.setdiff1d(np.arange(len(grams)), odd)
    step, _ = solve_shared(grams[others].sum(axis=0) + prior_gram(whole.model, grams.shape[1]))
    move = np.append(-step, 1.0)
    left = np.einsum("i,kij,j->k", move, grams[others], move)
    return float(np.maximum(left - dof[others], 0.0).sum())
