"""The search for a friction map, with the most promising correlation length.

Around a fit the response to every pattern of a field is linear, so that the evidence of fields of
several lengths can be compared without fitting any of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from curling_env.sheet import Sheet
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.fit import SessionFit, refit
from friction_estimation.discovery.model.friction_field import CARD, FrictionField, fields_to_try
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.tuning import BETTER_MAP


def find_map(fitted: SessionFit) -> tuple[Term, float] | None:
    """Return the most promising friction map, as a term, and its predicted fall of F.

    None if the model has a map, or for gate times, which do not show differences from place to
    place.
    """
    if fitted.model.map_field is not None or fitted.session.gates is not None:
        return None
    fields = _fields_of(fitted.session, fitted.model.ice.sheet)
    field, least = _best_of(fitted, fitted.model, fields)
    return Term(card=CARD, map_field=field), fitted.linear.least() - least


def renew_map(fitted: SessionFit) -> SessionFit:
    """Return the fit with a map of another correlation length, if that is better."""
    present = fitted.model.map_field
    if present is None:
        return fitted
    bare = fitted.model.without(CARD.name)
    # Around the present map the other fields are deviations from it.
    if present.known is None:
        fields = _fields_of(fitted.session, present.sheet)
    else:
        fields = fields_to_try(present.sheet, fitted.session.paths, present.known)
    field, _ = _best_of(fitted, bare, fields)
    alike = (field.length, field.smoothness) == (present.length, present.smoothness)
    if alike and (present.known is None or field.amplitude == present.amplitude):
        return fitted
    # It begins as the present map: the releases belong to it, and flat ice is far from it.
    begin = Term(card=CARD, map_field=field.near(present.ln_mu))
    goal = fitted.deviance - BETTER_MAP
    other = refit(fitted, bare.with_terms(begin), goal=goal)
    return other if other.deviance < goal else fitted


@lru_cache(maxsize=2)
def _fields_of(session: Session, sheet: Sheet) -> list[FrictionField]:
    """Fields of zero of all shapes, computed once: they depend only on the paths of the stones."""
    return fields_to_try(sheet, session.paths)


def _best_of(
    fitted: SessionFit, bare: Model, fields: Sequence[FrictionField]
) -> tuple[FrictionField, float]:
    """Return the best field in place of the map of a fit, to first order, and its F.

    Parameters
    ----------
    fitted : fit, with or without a map
    bare : its model without a map
    fields : the fields, of zero
    """
    model, own, paths, residual = fitted.model, fitted.columns, fitted.paths, fitted.residuals
    if model.map_field is not None:
        # The part explained by the present map is added to the residual for the other map.
        area = slice(7 + model.map_slice.start, 7 + model.map_slice.stop)
        residual = residual + own[:, :, area] @ model.map_field.values
        own = np.delete(own, np.r_[area], axis=2)
    at = 7 + bare.map_slice.start
    best, least = fields[0], np.inf
    for field in fields:
        response = paths.responses(paths.friction, field.patterns_at(paths.xy))
        columns = np.concatenate([own[:, :, :at], response, own[:, :, at:]], axis=2)
        other = bare.with_terms(Term(card=CARD, map_field=field))
        value = fitted.linear_in(other, columns, residual).least()
        if value < least:
            best, least = field, value
    return best, least
