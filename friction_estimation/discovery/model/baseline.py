"""The model that discovery starts from, before it is fitted to the session's own throws."""

from __future__ import annotations

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.effects.motion import GRAVITY
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.candidates import FORMS, UNDECIDABLE, Term, forms
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.place_errors import misplacement_of

USUAL_FRICTION = 0.009
"""μ from which the fit of a plain baseline starts: that of a draw of 25 s."""
PLACES = frozenset({"x_min", "x_max", "y_min", "y_max", "stone", "speed_floor", "centre_x", "edge"})
"""Parameters of a base's effects that are kept as they are given."""


def base_model(ice: Ice | None, session: Session) -> Model:
    """The base as a model whose parameters can be refitted.

    Parameters
    ----------
    ice : None for uniform Coulomb friction; else its map is scaled and its effects are refitted

    Raises
    ------
    InputError : an effect that is not known
    """
    if ice is None:
        plain = Ice.uniform(_first_friction(session))
        return Model(ice=plain, misplacement=misplacement_of(session))
    known = forms(session.measurements)
    terms: list[Term] = []
    for effect in ice.effects:
        if effect.name == "unknown" or effect.name in UNDECIDABLE:
            continue  # nothing to fit; the tracks have been corrected by the latter
        form = known.get(effect.name)
        if form is None:
            raise InputError(f"unknown effect {effect.name!r}; known are {', '.join(known)}")
        values = {p.name: effect.parameters.get(p.name, p.default) for p in form.parameters}
        missing = [name for name, value in values.items() if value is None]
        if missing:
            raise InputError(f"effect {effect.name} needs its parameter {missing[0]!r}")
        free = tuple(
            p.name
            for p in form.parameters
            if p.name not in PLACES and (p.neutral is not None or p.name in effect.sigma)
        )
        if form.name in FORMS:
            # The form it has is refitted; the others stay candidates.
            free = tuple(n for n, value in values.items() if value or n in effect.sigma) or free
        terms.append(
            Term(form=form, values={k: float(v or 0.0) for k, v in values.items()}, free=free)
        )
    worn = any(term.values.get("along_path") for term in terms)
    misplacement = misplacement_of(session)
    return Model(ice=ice, terms=tuple(terms), misplacement=misplacement, own_cells_wear=worn)


def _first_friction(session: Session) -> float:
    """Median deceleration of the throws over g."""
    found: list[float] = []
    for i in range(len(session)):
        rows = session.rows(i)
        t = session.times[rows]
        moved = np.hypot(*(session.xy[rows] - session.xy[rows][0]).T)
        if len(t) > 20:
            found.append(-2.0 * float(np.polyfit(t, moved, 2)[0]) / GRAVITY)
    mu = float(np.median(found)) if found else USUAL_FRICTION
    return float(np.clip(mu, 1e-3, 0.1))
