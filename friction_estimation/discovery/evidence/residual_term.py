"""A table for what is unknown: fitted friction over the variable that it follows.

It describes, it does not explain. It is kept only if throws that it was not fitted to are forecast
better with it.
"""

from __future__ import annotations

import numpy as np

from curling_env.physics.effects import catalogue
from friction_estimation.discovery.data.form import form_of
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.hold_out import Gap, forecast
from friction_estimation.discovery.evidence.significance import score_unseen
from friction_estimation.discovery.evidence.unknown import Follows
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.fit import Fit
from friction_estimation.discovery.search.selection import refit

NAME = "residual"
VARIABLES = ("speed", "x", "y", "spin", "clock", "order")
"""What the effect's table may run over, in the order of its parameter `variable`."""
FIXED_KNOT = "log_factor_3"
"""The middle of the table stays one: the friction of the map is fitted beside it."""
WORTH_KEEPING = 0.9
"""Part of the forecast gap to which the table must bring it down."""


def try_table(named: Fit, follows: list[Follows], unseen: Session) -> tuple[Fit, Gap] | None:
    """The fit with a table over the first variable that serves throws not seen, if one does.

    Parameters
    ----------
    named : fit of the training throws with the named effects
    follows : variables of the unknown, the strongest first
    unseen : throws that nothing was fitted to
    """
    card = catalogue().get(NAME)
    if card is None or any(term.name == NAME for term in named.model.terms):
        return None
    plain = forecast(named.model, unseen, named.noise)
    score = score_unseen(named, unseen).sum()
    for variable in [f.variable for f in follows if f.variable in VARIABLES]:
        low, high = _range(named, variable)
        knots = [p.name for p in card.parameters if p.name.startswith("log_factor")]
        values = {"variable": float(VARIABLES.index(variable)), "low": low, "high": high}
        term = Term(
            form=form_of(card),
            values={**values, **dict.fromkeys(knots, 0.0)},
            free=tuple(name for name in knots if name != FIXED_KNOT),
        )
        fitted = refit(named, named.model.with_terms(term))
        gap = forecast(fitted.model, unseen, fitted.noise)
        better = gap.rest_error < WORTH_KEEPING * plain.rest_error
        if better and score_unseen(fitted, unseen).sum() < score:
            return fitted, gap
    return None


def _range(fitted: Fit, variable: str) -> tuple[float, float]:
    """Least and largest value of a variable in the session."""
    session, path = fitted.session, fitted.predicted
    values = {
        "speed": np.hypot(path[:, 2], path[:, 3]),
        "x": path[:, 0],
        "y": path[:, 1],
        "spin": np.abs(path[:, 5]),
        "clock": session.clocks,
        "order": session.orders.astype(float),
    }[variable]
    return float(values.min()), float(max(values.max(), values.min() + 1e-3))
