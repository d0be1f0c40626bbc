"""A table for the unknown: fitted friction over the variable that the unknown follows.

The table describes and explains nothing. It is kept only if it improves the forecast of throws that
it was not fitted to.
"""

from __future__ import annotations

import numpy as np

from curling_env.physics.effects import catalogue
from curling_env.physics.effects.residual import KNOTS, VARIABLES
from curling_env.physics.state import State
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.hold_out import ForecastGap, forecast
from friction_estimation.discovery.evidence.predictive_density import unseen_scores
from friction_estimation.discovery.evidence.unknown.explanation import Dependence
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.search.selection import refit
from friction_estimation.discovery.tuning import TABLE_WORTH

NAME = "residual"


def try_table(
    named: SessionFit, dependences: list[Dependence], unseen: Session
) -> tuple[SessionFit, ForecastGap] | None:
    """The fit with a table over the first variable that improves the forecast, if one does.

    Parameters
    ----------
    named : fit of the training throws with the named effects
    dependences : variables that the unknown follows, the strongest first
    unseen : throws that nothing was fitted to
    """
    card = catalogue().get(NAME)
    if card is None or any(term.name == NAME for term in named.model.terms):
        return None
    plain = forecast(named.model, unseen, named.noise)
    score = unseen_scores(named, unseen).sum()
    for variable in [d.variable for d in dependences if d.variable in VARIABLES]:
        low, high = _range(named, variable)
        knots = [f"log_factor_{k}" for k in range(KNOTS)]
        values = {"variable": float(VARIABLES.index(variable)), "low": low, "high": high}
        term = Term(
            card=card,
            values={**values, **dict.fromkeys(knots, 0.0)},
            # The middle stays one, since the friction of the map is fitted beside the table.
            free=tuple(name for k, name in enumerate(knots) if k != KNOTS // 2),
        )
        fitted = refit(named, named.model.with_terms(term))
        gap = forecast(fitted.model, unseen, fitted.noise)
        better = gap.rest_error < TABLE_WORTH * plain.rest_error
        if better and unseen_scores(fitted, unseen).sum() < score:
            return fitted, gap
    return None


def _range(fitted: SessionFit, variable: str) -> tuple[float, float]:
    """Least and largest value of a variable in the session."""
    session, path = fitted.session, fitted.predicted
    values = {
        "speed": np.hypot(path[:, 2], path[:, 3]),
        "x": path[:, State.X],
        "y": path[:, State.Y],
        "spin": np.abs(path[:, State.OMEGA]),
        "clock": session.clocks,
        "order": session.orders.astype(float),
    }[variable]
    return float(values.min()), float(max(values.max(), values.min() + 1e-3))
