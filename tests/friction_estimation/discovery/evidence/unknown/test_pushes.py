"""Pushes that something unknown may give: what they follow, and how paths respond."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.physics.motion import GRAVITY
from friction_estimation.discovery.evidence.unknown.pushes import (
    PUSHES,
    _powers,
    _tents,
    responses,
    variables,
)
from friction_estimation.discovery.model.candidates import candidates
from friction_estimation.discovery.model.model import predict
from friction_estimation.discovery.model.response import MEASURED
from friction_estimation.discovery.model.sensitivity import linearised_paths


@pytest.fixture
def paths_of(fitted_to):
    def make(**options):
        fitted = fitted_to(**options)
        place = fitted.session, fitted.states, fitted.ln_factors
        return fitted, linearised_paths(fitted.model, *place)

    return make


def test_tents_share_every_value_between_two_neighbours():
    values = np.linspace(3.0, 7.0, 33)
    tents = _tents(values, 5)
    assert tents.sum(axis=1) == pytest.approx(np.ones(33))
    assert tents @ np.linspace(3.0, 7.0, 5) == pytest.approx(values)
    assert (tents > 0).sum(axis=1).max() == 2


def test_powers_are_of_the_standardised_value():
    values = np.array([1.0, 2.0, 6.0])
    unit = (values - 3.0) / values.std()
    assert _powers(values, 3) == pytest.approx(np.column_stack([unit, unit**2, unit**3]))


def test_variables_are_those_that_vary(paths_of):
    _, paths = paths_of(throws=6)
    functions = variables(paths)
    assert {name.partition(" ")[0] for name in functions} == {
        *("speed", "t", "y", "x", "spin", "theta", "clock", "order", "swept", "stone")
    }
    assert all(len(columns) == len(paths.path) for columns in functions.values())
    x, theta, spin = paths.path[:, 0], paths.path[:, 4], paths.path[:, 5]
    assert functions["x"] == pytest.approx(np.column_stack([x, x**2, x**3]))
    assert functions["theta"] == pytest.approx(np.column_stack([np.sin(theta), np.cos(theta)]))
    assert functions["spin side"][:, 0] == pytest.approx(np.tanh(spin / 0.1))
    assert np.ptp(functions["swept"]) == 1.0
    moved = variables(paths, np.array([0.5, 0, 0, 0, 0, 0]))
    assert moved["x"][:, 0] == pytest.approx(x + 0.5)
    session = paths.session.only([0])
    own = paths.instants_of_throw(0)
    alone = paths._replace(
        session=session,
        path=paths.path[own],
        instants=paths.instants._replace(
            times=paths.instants.times[own], starts=np.array([0, own.stop])
        ),
    )
    assert not {"clock", "order", "stone", "swept"} & set(variables(alone))


def test_paths_respond_to_pushes_as_to_the_effects_that_push_so(paths_of):
    fitted, paths = paths_of(throws=4)
    moved = responses(paths, np.ones((len(paths.path), 1)))
    assert moved.shape == (len(fitted.predicted), 3, len(PUSHES))
    place = fitted.session, fitted.states, fitted.ln_factors
    before = predict(fitted.model, *place)
    terms = {term.label: term for term in candidates(fitted.session)}

    def change(label, **values):
        model = fitted.model.with_terms(terms[label].with_values(**values))
        return (predict(model, *place) - before)[:, MEASURED]

    little = 1e-6
    across = change("slope", x=little) / (GRAVITY * little)
    assert moved[:, :2, PUSHES.index("across the sheet")] == pytest.approx(
        across[:, :2], rel=0.02, abs=0.05
    )
    heavier = replace(fitted.model, ln_mu=fitted.model.ln_mu + little)
    along = (predict(heavier, *place) - before)[:, MEASURED] / little
    assert moved[:, :, 0] == pytest.approx(along, rel=0.02, abs=0.05)
    way = np.sign(fitted.states[fitted.session.owner, 3])[:, None]
    assert moved[:, :, PUSHES.index("along the sheet")] == pytest.approx(way * moved[:, :, 0])
