"""The models that an estimate begins with, before they are fitted to the throws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.physics.effects import catalogue
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.baseline import base_model, first_friction
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.friction_field import CARD as MAP_CARD
from friction_estimation.discovery.model.friction_field import (
    crossed_by,
    field_along,
    fields_to_try,
)
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.tuning import MAP_SHAPES

SIDEWAYS = "curl"
"""Effect that bends paths: free in a fit of friction alone, and excluded from its result."""


def believed_model(start: Ice, session: Session, *, from_map: bool = False) -> Model:
    """Return the usual model of a rink's ice: a map, and the effects of every ice.

    Parameters
    ----------
    start : ice whose own effects take the place of the usual ones
    session : throws that the model will be fitted to
    from_map : whether the map of `start` holds, but for what has changed since
    """
    usual = tuple(
        ActiveEffect(name=card.name, parameters=card.usual)
        for card in catalogue().values()
        if card.usual and start.effect(card.name) is None
    )
    ice = start if from_map else _level(start, session)
    model = base_model(replace(ice, effects=(*start.effects, *usual)), session)
    return _with_map(model, session, start if from_map else None)


def known_effects_model(
    start: Ice, session: Session, *, uniform: bool = False, from_map: bool = False
) -> Model:
    """Return the model of an ice with known effects and unknown friction.

    Parameters
    ----------
    start : ice whose effects stay as they are
    session, from_map : as of `believed_model`
    uniform : whether the friction is one number
    """
    bends = start.effect(SIDEWAYS) is None
    card = catalogue()[SIDEWAYS]
    beside = (ActiveEffect(name=SIDEWAYS, parameters=card.usual),) if bends else ()
    ice = start if from_map else _level(start, session)
    model = base_model(replace(ice, effects=(*start.effects, *beside)), session)
    held = tuple(
        replace(term, free=card.first if bends and term.name == SIDEWAYS else (), beliefs={})
        for term in model.terms
    )
    model = replace(model, terms=held)
    return model if uniform else _with_map(model, session, start if from_map else None)


def _level(start: Ice, session: Session) -> Ice:
    """Return the ice with a single friction, roughly that of the throws."""
    return replace(start, friction=FrictionMap.uniform(first_friction(session), start.sheet))


def _with_map(model: Model, session: Session, before: Ice | None) -> Model:
    """Return the model with a friction map, starting from an earlier ice if given."""
    paths = [session.xy[session.rows(i)] for i in range(len(session))]
    sheet = model.ice.sheet
    if before is None:
        field = field_along(sheet, crossed_by(sheet, paths), *MAP_SHAPES[2])
    else:
        known: Floats = np.ravel(before.friction.sigma / before.friction.mu)
        tried = fields_to_try(sheet, paths, known)
        field = tried[len(tried) // 2]
    return model.with_terms(Term(card=MAP_CARD, map_field=field))
