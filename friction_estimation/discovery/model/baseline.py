"""Initial model of a discovery, before it is fitted to the throws of the session."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.effects import EffectCard, catalogue
from curling_env.physics.motion import GRAVITY
from curling_env.physics.wear import wear_along_path
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.candidates import (
    Belief,
    Term,
    known_effects,
    neutral_values,
)
from friction_estimation.discovery.model.gaussian_field import systematic_error_of
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.tuning import USUAL_FRICTION

FEWEST_ROWS = 5
"""Minimum number of rows for a quadratic with residuals."""


def base_model(ice: Ice | None, session: Session) -> Model:
    """Return the baseline as a model whose parameters can be fitted.

    Parameters
    ----------
    ice : ice whose map is scaled and whose effects are fitted again; None for uniform Coulomb
        friction
    session : throws that the model will be fitted to

    Raises
    ------
    InputError : an effect that is not known, or without a parameter that it needs
    """
    if ice is None:
        plain = Ice.uniform(first_friction(session))
        return Model(ice=plain, systematic_error=systematic_error_of(session))
    known = known_effects(session.measurements)
    terms: list[Term] = []
    for effect in ice.effects:
        card = known.get(effect.name)
        if card is not None:
            terms.append(_term(card, effect.parameters, set(effect.sigma)))
        elif effect.name not in catalogue():
            raise InputError(f"unknown effect {effect.name!r}; expected one of {', '.join(known)}")
        # Others have nothing to fit: remarks, and factors by which the tracks were corrected.
    return Model(
        ice=ice,
        terms=tuple(terms),
        systematic_error=systematic_error_of(session),
        own_cells_wear=wear_along_path(ice) != 0.0,
    )


def _term(card: EffectCard, given: Mapping[str, float], uncertain: set[str]) -> Term:
    """Return an effect of an ice file as a term.

    Parameters
    ----------
    card : card of the effect
    given : its parameters in the file
    uncertain : parameters that have a standard error there
    """
    values = {p.name: given.get(p.name, p.default) for p in card.parameters}
    missing = [name for name, value in values.items() if value is None]
    if missing:
        raise InputError(f"effect {card.name} needs its parameter {missing[0]!r}")
    free = tuple(
        p.name
        for p in card.parameters
        if not p.held and (p.neutral is not None or p.name in uncertain)
    )
    if card.search.variants:
        # The active variant is fitted; the others remain candidates.
        idle = neutral_values(card)
        acts = {name for name, value in values.items() if value != idle[name]} | uncertain
        free = tuple(p.name for p in card.parameters if not p.held and p.name in acts) or free
    # The shape of an effect differs from rink to rink, like its strength; few throws determine it.
    shape = {p.name: p.spread for p in card.parameters if p.spread is not None}
    beliefs = {n: Belief(mean=float(values[n] or 0.0), sd=sd) for n, sd in shape.items()}
    return Term(
        card=card,
        values={k: float(v or 0.0) for k, v in values.items()},
        free=(*free, *(n for n in shape if n not in free)),
        beliefs=beliefs,
    )


def first_friction(session: Session) -> float:
    """Return the median deceleration of the throws over g, from which a fit begins.

    Throws seen for less than half as long as another are ignored, because a short slide between two
    contacts hardly shows its deceleration. The criterion is time, not the number of rows, because
    tracks from films keep few of them.
    """
    firsts, lasts = session.starts[:-1], session.starts[1:] - 1
    seconds = session.times[lasts] - session.times[firsts]
    found: list[float] = []
    for i in np.flatnonzero(seconds >= 0.5 * seconds.max()).tolist():
        rows = session.rows(i)
        t = session.times[rows]
        moved = np.hypot(*(session.xy[rows] - session.xy[rows][0]).T)
        if len(t) >= FEWEST_ROWS:
            found.append(-2.0 * float(np.polyfit(t, moved, 2)[0]) / GRAVITY)
    mu = float(np.median(found)) if found else USUAL_FRICTION
    return float(np.clip(mu, 1e-3, 0.1))
