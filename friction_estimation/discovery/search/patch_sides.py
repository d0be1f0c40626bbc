"""The sides of patches that run along the sheet: where they fit best, and how surely.

The effect of such a side changes only when it passes a stone's path, so that no derivative finds
its place; the search for a patch left it on a grid. A side elsewhere is a little more or less
friction on parts of the paths. The linear response to that gives F at every place.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.fit import SessionFit, refit
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.sensitivity import friction_along
from friction_estimation.discovery.tuning import NARROWEST_PATCH, SIDE_SHIFTS


class SideScan(NamedTuple):
    """A side of a patch at several places, if all stays linear around a fit.

    Parameters
    ----------
    shifts : (n,) distances from where it is [m]
    deviances : (n,) F there
    steps : (n, P) steps of the shared parameters that are best there
    """

    shifts: Floats
    deviances: Floats
    steps: Floats


def place_sides(fitted: SessionFit) -> SessionFit:
    """Move the sides of patches that run along the sheet to where they fit best."""
    for label, side in sides_along(fitted.model):
        scan = scan_side(fitted, label, side)
        shift = float(scan.shifts[int(np.argmin(scan.deviances))])
        if shift != 0.0:
            trial = refit(fitted, _with_side(fitted.model, label, side, shift), iterations=5)
            fitted = trial if trial.deviance < fitted.deviance - 1.0 else fitted
    return fitted


def sides_along(model: Model) -> list[tuple[str, str]]:
    """Term and parameter of every side of a patch that runs along the sheet and is not fitted."""
    return [
        (term.label, side)
        for term in model.terms
        for side in (term.card.search.area or ())[:2]
        if side not in term.free
    ]


def scan_side(fitted: SessionFit, label: str, side: str) -> SideScan:
    """Return F with a side of a patch at several places.

    Parameters
    ----------
    fitted : fit with the patch
    label, side : as of `sides_along`
    """
    edge, term = fitted.model.ice.sheet.width / 2, fitted.model.term(label)
    models = {0.0: fitted.model}
    for shift in SIDE_SHIFTS:
        model = _with_side(fitted.model, label, side, shift)
        if abs(term.values[side] + shift) <= edge and _width(model.term(label)) >= NARROWEST_PATCH:
            models[shift] = model
    paths, always = fitted.paths, np.ones((len(fitted.paths.path), 1))
    moved = [
        paths.responses(
            friction_along(model, fitted.session, fitted.ln_factors, paths) - paths.friction, always
        )
        for model in models.values()
    ]
    wide = np.concatenate([fitted.columns, *moved], axis=2)
    grams = fitted.linear_in(fitted.model, wide, fitted.residuals).grams
    count = fitted.columns.shape[2]
    own = [*range(count), grams.shape[1] - 1]
    deviances: list[float] = []
    steps: list[Floats] = []
    for k in range(len(models)):
        # The residual from that model is the residual less what the change foresees.
        change = np.eye(grams.shape[1])
        change[count + k, -1] = -1.0
        around = change.T @ grams @ change
        linear = replace(fitted.linear, grams=around[:, own][:, :, own])
        deviances.append(linear.least())
        steps.append(linear.minimum().step)
    order = np.argsort(list(models))
    shifts = np.array(list(models))[order]
    return SideScan(shifts, np.array(deviances)[order], np.array(steps)[order])


def _width(term: Term) -> float:
    area = term.card.search.area
    assert area is not None
    return term.values[area[1]] - term.values[area[0]]


def _with_side(model: Model, label: str, side: str, shift: float) -> Model:
    """The model with one side of a patch elsewhere."""
    term = model.term(label)
    moved = term.with_values(**{side: term.values[side] + shift})
    return model.without(label).with_terms(moved)
