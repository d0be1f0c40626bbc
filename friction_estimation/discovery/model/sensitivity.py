"""How what a model predicts responds: to releases, to its parameters, and to pushes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.physics.state import State
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.forward import friction_of_session, new_workspace
from friction_estimation.discovery.model.model import (
    Model,
    predict,
    throw_inputs,
    true_states,
)
from friction_estimation.discovery.model.response import MEASURED, LinearisedPaths, instants_of
from friction_estimation.discovery.tuning import PATH_STEP

STATE_STEPS = (1e-3, 1e-3, 2e-4, 2e-4, 2e-3, 1e-3)
"""Steps of finite differences in x, y, vx, vy, theta, omega."""
LN_MU_STEP = 2e-4
"""Step of finite differences in ln μ."""


def linearised_paths(
    model: Model, session: Session, states: Floats, ln_factors: Floats
) -> LinearisedPaths:
    """How the paths of a session respond to pushes, from seven paths of every throw.

    Parameters
    ----------
    model, session, states, ln_factors : as of `predict`
    """
    instants = instants_of(session)

    def slide(releases: Floats) -> Floats:
        return true_states(model, session, releases, ln_factors, instants.times, instants.starts)

    true = slide(states)
    transition = np.empty((len(true), 6, 6))
    for j, step in enumerate(STATE_STEPS):
        moved = states.copy()
        moved[:, j] += step
        transition[:, :, j] = (slide(moved) - true) / step
    paths = LinearisedPaths(
        session=session,
        instants=instants,
        path=true,
        transition=transition,
        friction=np.empty((len(true), 3)),
    )
    return paths._replace(friction=friction_along(model, session, ln_factors, paths))


def friction_along(
    model: Model, session: Session, ln_factors: Floats, paths: LinearisedPaths
) -> Floats:
    """Part of the accelerations on paths that is proportional to a model's friction, (n, 3).

    Parameters
    ----------
    model, session, ln_factors : as of `predict`
    paths : paths, with their instants
    """
    law = model.law
    friction = np.empty((len(paths.path), 3))
    friction_of_session(
        law._replace(mu=np.empty_like(law.mu)),
        law.mu,
        model.wear(session),
        np.exp(ln_factors),
        throw_inputs(session, paths.instants.times, paths.instants.starts),
        paths.path,
        friction,
        new_workspace(),
    )
    return friction


@dataclass(frozen=True, kw_only=True, eq=False)
class Sensitivities:
    """Derivatives of x, y and theta by releases, ln μ of the throws and shared parameters.

    All throws at once would be a table of many megabytes, and few need it.

    Parameters
    ----------
    predicted : (rows, 6) states
    differences : place of the first column -> (rows, 3, ·) derivatives
    patterns : (n, r) of the friction map at the instants of `paths`; None for a model without
    map_place : place of their first column
    paths : how the paths respond to friction; None for a model without a map
    """

    predicted: Floats
    differences: dict[int, Floats]
    patterns: Floats | None = None
    map_place: int = 0
    paths: LinearisedPaths | None = None

    def of_throw(self, rows: slice, i: int) -> Floats:
        """Columns for the rows of the i-th throw, as of `sensitivities`."""
        own = {place: part[rows] for place, part in self.differences.items()}
        if self.paths is not None and self.patterns is not None:
            at = self.paths.instants_of_throw(i)
            own[self.map_place] = self.paths.responses_of_throw(
                i, self.paths.friction[at], self.patterns[at]
            )
        return np.concatenate([own[place] for place in sorted(own)], axis=2)


def sensitivities(
    model: Model, session: Session, states: Floats, ln_factors: Floats
) -> tuple[Floats, Floats]:
    """Prediction and its derivatives by finite differences.

    Parameters
    ----------
    model, session, states, ln_factors : as of `predict`

    Returns
    -------
    predicted : (rows, 6) states
    columns : (rows, 3, 7 + P) derivatives of x, y, theta by the six numbers of the release, by ln μ
        of the throw, and by the P shared parameters
    """
    found = sensitivities_by_throw(model, session, states, ln_factors)
    throws = [found.of_throw(session.rows(i), i) for i in range(len(session))]
    return found.predicted, np.concatenate(throws)


def sensitivities_by_throw(
    model: Model, session: Session, states: Floats, ln_factors: Floats
) -> Sensitivities:
    """The same as `sensitivities`, for one throw after the other."""
    base = predict(model, session, states, ln_factors)
    measured = base[:, MEASURED]
    vector = model.vector

    def derivative(other: Model, releases: Floats, factors: Floats, step: float) -> Floats:
        change = predict(other, session, releases, factors)[:, MEASURED] - measured
        return change[:, :, None] / step

    found: dict[int, Floats] = {}
    for j, step in enumerate(STATE_STEPS):
        moved = states.copy()
        moved[:, j] += step
        found[j] = derivative(model, moved, ln_factors, step)
    for place, shift in model.camera_fields:
        shifts = shift.columns(base[:, :2], base[:, State.THETA])
        found[7 + place.start] = np.concatenate([shifts, np.zeros_like(shifts[:, :1])], axis=1)
    for j in (1, *range(model.map_slice.stop, len(vector))):
        step = _step(model, session, states, ln_factors, measured, j)
        changed = vector.copy()
        changed[j] += step
        found[7 + j] = derivative(model.at(changed), states, ln_factors, step)
    if model.map_field is None:
        # Friction everywhere acts as that of every throw.
        found[6] = found[7] = derivative(model, states, ln_factors + LN_MU_STEP, LN_MU_STEP)
        return Sensitivities(predicted=base, differences=found)
    paths = linearised_paths(model, session, states, ln_factors)
    # It is also a map, of one height. Computed in two ways, the difference of the two would look
    # like something that the throws tell, and fits would creep along it.
    found[6] = found[7] = paths.responses_to_friction(np.ones((len(paths.xy), 1)))
    return Sensitivities(
        predicted=base,
        differences=found,
        patterns=model.map_field.patterns_at(paths.xy),
        map_place=7 + model.map_slice.start,
        paths=paths,
    )


def _step(
    model: Model, session: Session, states: Floats, ln_factors: Floats, measured: Floats, j: int
) -> float:
    """A step of parameter j that moves the paths by millimetres and stays within its bounds."""
    label, name = model.names[j]
    value = model.vector[j]
    if not label:
        return 0.01
    p = model.term(label).card.parameter(name)
    known = model.steps.get((label, name))
    if known is None:
        width = p.high - p.low if np.isfinite(p.high - p.low) else 1.0
        known = 1e-3 * width
        for _ in range(3):
            if value + known > p.high:
                known = -known
            moved = model.vector
            moved[j] += known
            change = predict(model.at(moved), session, states, ln_factors)[:, MEASURED] - measured
            reach = float(np.abs(change[:, :2]).max())
            turn = float(np.abs(change[:, 2]).max())
            scale = PATH_STEP / max(reach, 0.1 * turn, 1e-9)
            known *= float(np.clip(scale, 1e-3, 30.0))
            if 0.3 < scale < 3.0:
                break
        known = float(np.clip(known, -0.02 * width, 0.02 * width))
        model.steps[label, name] = abs(known)
    return -abs(known) if value + abs(known) > p.high else abs(known)
