"""Single events, such as a pick, a touch or a lost track, which are not effects."""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.fit import SessionFit, fit_to
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.search.patches import place_sides
from friction_estimation.discovery.search.residuals import throw_tolerance_of
from friction_estimation.discovery.tuning import CLEARLY_SEEN, EVENT_SHARE, MOST_EVENTS


def exceptional_throws(best: SessionFit, session: Session) -> Indices:
    """Return the indices of a few throws without which the others agree.

    An exceptional throw would distort the fit of all others. Around the fit with all selected
    effects, throws are excluded one by one, and the misfit of the others is compared with their
    misfit before.

    Parameters
    ----------
    best : fit of some of the throws with all selected effects
    session : all throws
    """
    whole = place_sides(fit_to(best, session))
    values = np.isfinite(session.observed).sum(axis=1)
    dof = np.add.reduceat(values, session.starts[:-1]) * throw_tolerance_of(session)
    odd: list[int] = []
    excess = _excess_without(whole, odd, dof)
    if excess < CLEARLY_SEEN * np.sqrt(2.0 * dof.sum()):
        return np.empty(0, dtype=np.intp)
    for _ in range(max(1, int(MOST_EVENTS * len(session)))):
        others = [i for i in range(len(session)) if i not in odd]
        odd.append(min(others, key=lambda i: _excess_without(whole, [*odd, i], dof)))
        if _excess_without(whole, odd, dof) < (1.0 - EVENT_SHARE) * excess:
            return np.sort(np.array(odd, dtype=np.intp))
    return np.empty(0, dtype=np.intp)


def _excess_without(whole: SessionFit, odd: list[int], dof: Floats) -> float:
    """χ² of the other throws beyond its expectation, fitted without the exceptional ones."""
    grams, _ = whole.linear.each()
    others = np.setdiff1d(np.arange(len(grams)), odd)
    step = minimum_of(grams[others].sum(axis=0) + whole.linear.prior).step
    move = np.append(-step, 1.0)
    chi2 = np.einsum("i,kij,j->k", move, grams[others], move)
    return float(np.maximum(chi2 - dof[others], 0.0).sum())
