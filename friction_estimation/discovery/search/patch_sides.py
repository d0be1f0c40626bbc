"""The sides of patches that run along the sheet are placed where they fit best.

The effect of such a side changes only when it passes a stone's path, so that no derivative finds
its place; the search for a patch left it on a grid. A side elsewhere is a little more or less
friction on parts of the paths. The linear response to that says which places are worth a fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Floats
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.fit import SessionFit, refit
from friction_estimation.discovery.model.friction_field import CARD
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.sensitivity import friction_along
from friction_estimation.discovery.tuning import NARROWEST_PATCH, PLACES_FITTED, SIDE_SHIFTS


def place_sides(fitted: SessionFit) -> SessionFit:
    """Move the sides of patches that run along the sheet to where they fit best."""
    for term in fitted.model.terms:
        if term.card.search.area is not None:
            fitted = place_sides_of(fitted, term.label)
    return fitted


def place_sides_of(fitted: SessionFit, label: str) -> SessionFit:
    """The same for the patch with a label."""
    for side in sides_along(fitted.model.term(label)):
        place = fitted.model.term(label).values[side]
        tried = (with_side(fitted.model, label, side, place + shift) for shift in SIDE_SHIFTS)
        models = [model for model in tried if model is not None]
        if not models:
            continue
        order = np.argsort(foreseen_deviances(fitted, models))
        for k in order[:PLACES_FITTED]:
            trial = refit(fitted, models[int(k)], iterations=5)
            if trial.deviance < fitted.deviance - 1.0:
                fitted = trial
    return fitted


def foreseen_deviances(fitted: SessionFit, models: Sequence[Model]) -> Floats:
    """Return F of models that differ little in friction, if all stays linear around a fit, (n,).

    Parameters
    ----------
    fitted : the fit
    models : models with the parameters of the fitted one
    """
    columns, paths, always = fitted.columns, fitted.paths, np.ones((len(fitted.paths.path), 1))
    moved = [
        paths.responses(
            friction_along(model, fitted.session, fitted.ln_factors, paths) - paths.friction, always
        )
        for model in models
    ]
    wide = np.concatenate([columns, *moved], axis=2)
    reduced = fitted.linear_in(fitted.model, wide, fitted.residuals).reduced
    count = columns.shape[2] - 6
    own = [*range(count), reduced.shape[1] - 1]
    found: list[float] = []
    for k in range(len(models)):
        # The residual from that model is the residual less what the change foresees.
        change = np.eye(reduced.shape[1])
        change[count + k, -1] = -1.0
        around = np.swapaxes(change, 0, 1) @ reduced @ change
        found.append(replace(fitted.linear, reduced=around[:, own][:, :, own]).least())
    return np.array(found)


def sides_along(term: Term) -> tuple[str, ...]:
    """Parameters of the two sides of a patch that run along the sheet; none for other effects."""
    return (term.card.search.area or ())[:2]


def with_side(model: Model, label: str, side: str, place: float) -> Model | None:
    """The model with one side of a patch elsewhere; None if the patch would be too narrow.

    A friction map takes over what the patch gives up, and gives back what the patch takes: a fit
    begins with the friction that was there.
    """
    edge = model.ice.sheet.width / 2
    before = model.term(label)
    moved = before.with_values(**{side: place})
    left, right = sides_along(moved)
    if abs(place) > edge or moved.values[right] - moved.values[left] < NARROWEST_PATCH:
        return None
    field = model.map_field
    if field is not None and moved.values.get("factor", 0.0) > 0.0:
        taken = _inside(moved, field.sheet) - _inside(before, field.sheet)
        kept = field.near(field.ln_mu - np.log(moved.values["factor"]) * taken)
        model = model.without(CARD.name).with_terms(Term(card=CARD, map_field=kept))
    return model.without(label).with_terms(moved)


def _inside(term: Term, sheet: Sheet) -> Floats:
    """1 in the cells whose centre lies in a patch, else 0, (rows, columns)."""
    x, y = np.meshgrid(sheet.x_centres, sheet.y_centres)
    x_min, x_max, y_min, y_max = (term.values[name] for name in term.card.search.area or ())
    inside = (x >= x_min) & (x <= x_max) & (y >= y_min) & (y <= y_max)
    return inside.astype(np.float64)
