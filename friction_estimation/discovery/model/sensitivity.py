"""Response of a model's predictions to releases, to its parameters, and to pushes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curling_env.physics.state import State
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.forward import friction_of_session
from friction_estimation.discovery.model.gaussian_field import CameraField
from friction_estimation.discovery.model.model import (
    Model,
    predict,
    reported,
    throw_inputs,
    true_states,
)
from friction_estimation.discovery.model.response import (
    MEASURED,
    Instants,
    LinearisedPaths,
    instants_of,
)
from friction_estimation.discovery.tuning import PATH_STEP

STATE_STEPS = (1e-3, 1e-3, 2e-4, 2e-4, 2e-3, 1e-3)
"""Steps of finite differences in x, y, vx, vy, theta, omega."""
LN_MU_STEP = 2e-4
"""Step of finite differences in ln μ."""


def linearised_paths(
    model: Model, session: Session, states: Floats, ln_factors: Floats
) -> LinearisedPaths:
    """Return the paths of a session with their response to pushes, from seven of every throw.

    Parameters
    ----------
    model, session, states, ln_factors : as of `predict`
    """
    instants = instants_of(session)

    def slide(releases: Floats) -> Floats:
        return true_states(model, session, releases, ln_factors, instants.times, instants.starts)

    path = slide(states)
    moved = [slide(releases) for releases in _moved(states)]
    return _linearised(model, session, ln_factors, instants, path, moved)


def _moved(states: Floats) -> list[Floats]:
    """Releases (k, 6) with one number after the other moved by its step."""
    return [states + step * np.eye(6)[j] for j, step in enumerate(STATE_STEPS)]


def _linearised(
    model: Model,
    session: Session,
    ln_factors: Floats,
    instants: Instants,
    path: Floats,
    moved: list[Floats],
) -> LinearisedPaths:
    """Linearised paths from the states at the instants, and those of moved releases."""
    steps = zip(moved, STATE_STEPS, strict=True)
    paths = LinearisedPaths(
        session=session,
        instants=instants,
        path=path,
        transition=np.stack([(other - path) / step for other, step in steps], axis=2),
        friction=np.empty((len(path), 3)),
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
    friction = np.empty((len(paths.path), 3))
    friction_of_session(
        model.law_in(session),
        model.wear(session),
        np.exp(ln_factors),
        throw_inputs(session, paths.instants.times, paths.instants.starts),
        paths.path,
        friction,
    )
    return friction


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
    predicted, of_throw = sensitivities_by_throw(model, session, states, ln_factors)
    return predicted, np.concatenate([of_throw(i) for i in range(len(session))])


def sensitivities_by_throw(
    model: Model, session: Session, states: Floats, ln_factors: Floats
) -> tuple[Floats, Callable[..., Floats]]:
    """Return the same as `sensitivities`, for one throw after the other.

    A table of all throws at once would have many megabytes.

    Returns
    -------
    predicted : (rows, 6) states
    of_throw : number of a throw, and further columns of its rows -> its columns, then these
    """
    instants = Instants(np.empty(0), np.zeros(len(session) + 1, dtype=np.intp))
    if model.map_field is not None:
        instants = instants_of(session)
    times, starts, rows, at_instants = _merged(session, instants)

    def slide(releases: Floats) -> Floats:
        return true_states(model, session, releases, ln_factors, times, starts)

    true, moved = slide(states), [slide(releases) for releases in _moved(states)]
    base = reported(model, true[rows])
    measured = base[:, MEASURED]
    vector = model.vector

    def derivative(changed: Floats, step: float) -> Floats:
        return ((changed[:, MEASURED] - measured) / step)[:, :, None]

    found: dict[int, Floats] = {}
    for j, step in enumerate(STATE_STEPS):
        found[j] = derivative(reported(model, moved[j][rows]), step)
    for place, shift in model.fields:
        if not isinstance(shift, CameraField):
            continue
        shifts = shift.columns(base[:, :2], base[:, State.THETA])
        found[7 + place.start] = np.concatenate([shifts, np.zeros_like(shifts[:, :1])], axis=1)
    for j in (1, *range(model.map_slice.stop, len(vector))):
        step = _step(model, session, states, ln_factors, measured, j)
        changed = vector.copy()
        changed[j] += step
        found[7 + j] = derivative(predict(model.at(changed), session, states, ln_factors), step)
    field = model.map_field
    paths = patterns = None
    if field is None:
        # Overall friction acts like that of every throw.
        heavier = predict(model, session, states, ln_factors + LN_MU_STEP)
        found[6] = found[7] = derivative(heavier, LN_MU_STEP)
    else:
        elsewhere = [other[at_instants] for other in moved]
        paths = _linearised(model, session, ln_factors, instants, true[at_instants], elsewhere)
        patterns = field.patterns_at(paths.xy)

    def of_throw(i: int, *further: Floats) -> Floats:
        own = {place: part[session.rows(i)] for place, part in found.items()}
        if paths is not None and patterns is not None:
            at = paths.instants_of_throw(i)
            # Overall friction is also a constant map. If it were differentiated in another way, the
            # difference of the two would act as information, and fits would drift along it.
            sizes = np.insert(patterns[at], 0, 1.0, axis=1)
            response = paths.responses_of_throw(i, paths.friction[at], sizes)
            own[6] = own[7] = response[:, :, :1]
            own[7 + model.map_slice.start] = response[:, :, 1:]
        return np.concatenate([*(own[place] for place in sorted(own)), *further], axis=2)

    return base, of_throw


def _merged(session: Session, instants: Instants) -> tuple[Floats, Indices, Indices, Indices]:
    """Return times of rows and instants in one order, so that each path is integrated once.

    Returns
    -------
    times, starts : as of `Session`
    rows, at_instants : places of the rows and of the instants among them
    """
    owners = np.repeat(np.arange(len(session)), np.diff(instants.starts))
    owner = np.concatenate([session.owner, owners])
    times = np.concatenate([session.times, instants.times])
    order = np.lexsort((times, owner))
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    starts = np.searchsorted(owner[order], np.arange(len(session) + 1))
    return times[order], starts, place[: len(session.times)], place[len(session.times) :]


def _step(
    model: Model, session: Session, states: Floats, ln_factors: Floats, measured: Floats, j: int
) -> float:
    """Return a step of parameter j that moves the paths by millimetres and stays within its
    bounds.
    """
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
