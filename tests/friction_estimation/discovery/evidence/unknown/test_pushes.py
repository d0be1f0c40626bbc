"""Pushes that something unknown may give: what they follow, and how paths respond."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.physics import GRAVITY
from friction_estimation.discovery import MEASURED, candidates, predict
from friction_estimation.discovery.evidence.unknown.pushes import (
    PUSHES,
    directions,
    pushes_over_time,
    response_to,
    responses,
    variables,
    ways,
)
from friction_estimation.discovery.model.response import Instants
from friction_estimation.discovery.model.sensitivity import linearised_paths

from ...conftest import plain_session


@pytest.fixture
def paths_of(fitted_to):
    def make(**options):
        fitted = fitted_to(**options)
        place = fitted.session, fitted.states, fitted.ln_factors
        return fitted, linearised_paths(fitted.model, *place)

    return make


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
    unit = (np.abs(spin) - np.abs(spin).mean()) / np.abs(spin).std()
    assert functions["spin"] == pytest.approx(np.column_stack([unit, unit**2]))
    # Tents share every value between two neighbours.
    speed, tents = np.hypot(paths.path[:, 2], paths.path[:, 3]), functions["speed"]
    assert tents.sum(axis=1) == pytest.approx(np.ones(len(tents)))
    assert tents @ np.linspace(speed.min(), speed.max(), 5) == pytest.approx(speed)
    assert (tents > 0).sum(axis=1).max() == 2
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


def test_stones_are_pushed_as_by_the_effects_that_push_so(paths_of):
    """However much: by a slope of half the friction, and by a third more friction."""
    fitted, paths = paths_of(throws=4)
    place = fitted.states, fitted.ln_factors
    slope = next(term for term in candidates(fitted.session) if term.label == "slope")
    even = np.ones(len(paths.path))

    def beside(**sizes):
        pushed = pushes_over_time(paths, sizes)
        return predict(fitted.model, replace(fitted.session, pushes=pushed), *place)

    tilted = fitted.model.with_terms(slope.with_values(x=0.004))
    across = beside(**{"across the sheet": GRAVITY * 0.004 * even})
    assert across == pytest.approx(predict(tilted, fitted.session, *place), abs=3e-4)
    heavier = replace(fitted.model, ln_mu=fitted.model.ln_mu + 0.3)
    expected = predict(heavier, fitted.session, *place)
    assert beside(along=0.3 * even) == pytest.approx(expected, abs=3e-4)
    assert beside(left=0.0 * even) == pytest.approx(
        predict(fitted.model, fitted.session, *place), abs=3e-4
    )
    away = np.hypot(*(beside(left=0.01 * even)[:, :2] - fitted.predicted[:, :2]).T)
    assert away.max() > 1.0
    turned = beside(turn=0.01 * even)[:, 5] - fitted.predicted[:, 5]
    moving = fitted.session.times < 5.0
    assert turned[moving] == pytest.approx(0.01 * fitted.session.times[moving], rel=0.3, abs=1e-4)


def test_the_pushes_of_some_throws_are_those_that_they_had(paths_of):
    fitted, paths = paths_of(throws=4)
    sizes = {"along": 0.1 * np.sin(paths.instants.times), "turn": 1e-3 * paths.path[:, 1]}
    pushed = replace(fitted.session, pushes=pushes_over_time(paths, sizes))
    whole = predict(fitted.model, pushed, fitted.states, fitted.ln_factors)
    chosen = np.array([2, 0])
    some = pushed.only(chosen)
    alone = predict(fitted.model, some, fitted.states[chosen], fitted.ln_factors[chosen])
    rows = np.concatenate([np.arange(len(whole))[pushed.rows(i)] for i in chosen])
    assert alone == pytest.approx(whole[rows])
    own = paths.instants_of_throw(2)
    at = pushed.pushes.at(2, paths.instants.times[own])
    assert at[:, 3] == pytest.approx(sizes["turn"][own])
    # The response to pushes so small is what they do.
    little = {push: 1e-4 * size for push, size in sizes.items()}
    moved = response_to(paths, pushes_over_time(paths, little))
    pushed = replace(fitted.session, pushes=pushes_over_time(paths, little))
    there = predict(fitted.model, pushed, fitted.states, fitted.ln_factors)
    before = predict(fitted.model, fitted.session, fitted.states, fitted.ln_factors)
    moving = np.hypot(there[:, 2], there[:, 3]) > 0.1
    assert moved[moving, :2] == pytest.approx((there - before)[moving, :2], rel=0.05, abs=2e-6)


def given_paths(rows: int = 3, spacing: float = 1.0, **columns: Any) -> Any:
    """Two throws, the second of which comes back, at three instants each."""
    path = np.zeros((6, 6))
    path[:, 2:4] = [[0.6, 0.8], [0.3, 0.4], [0.0, 0.0], [0.0, -2.0], [-1.0, 0.0], [0.0, 0.5]]
    instants = Instants(np.tile([0.0, 1.0, 2.0], 2), np.array([0, 3, 6]))
    friction = np.arange(18.0).reshape(6, 3)
    session = plain_session(throws=2, rows=rows, spacing=spacing, **columns)
    return SimpleNamespace(path=path, instants=instants, friction=friction, session=session)


def test_pushes_act_along_beside_and_across_the_travel():
    paths = given_paths()
    assert ways(paths).tolist() == [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]  # of whole throws
    found = directions(paths)
    assert list(found) == list(PUSHES)
    assert found["along"] is paths.friction
    assert found["along the sheet"][:3] == pytest.approx(paths.friction[:3])
    assert found["along the sheet"][3:] == pytest.approx(-paths.friction[3:])
    left = [[-0.8, 0.6], [-0.8, 0.6], [0.0, 0.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]]
    assert found["left"][:, :2] == pytest.approx(np.array(left))
    assert not found["left"][:, 2].any()
    assert found["turn"].tolist() == [[0.0, 0.0, 1.0]] * 6
    assert found["across the sheet"].tolist() == [[1.0, 0.0, 0.0]] * 6


def test_variables_of_a_session_are_scaled_and_those_it_lacks_are_dropped():
    swept = np.array([0.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    paths = given_paths(swept=swept, stones=np.array([4, 7]))
    paths.path[:, 1], paths.path[:, 5] = np.arange(6), [1.0, 1.0, 0.05, -2.0, -2.0, 0.0]
    found = variables(paths)
    assert found["order"][:, 0].tolist() == [-1.0] * 3 + [1.0] * 3
    assert found["clock"][:, 0].tolist() == [-1.0] * 3 + [1.0] * 3
    assert found["stone"].tolist() == [[1.0]] * 3 + [[0.0]] * 3  # the last is the others' opposite
    assert found["swept"][:, 0].tolist() == swept.tolist()
    assert found["y"].shape == (6, 21)
    assert found["y"] @ np.arange(21) == pytest.approx(4.0 * np.arange(6))
    assert found["t"].shape == (6, 5)
    assert found["t"] @ np.arange(5) == pytest.approx([0.0, 2.0, 4.0] * 2)
    assert "x" not in found  # all ran on one line
    assert not {"theta", "spin", "spin side"} & set(found)  # three rows show no heading
    turning = given_paths(rows=21, spacing=0.1)
    turning.path[:, 5] = paths.path[:, 5]
    side = variables(turning)["spin side"]
    assert side[:, 0] == pytest.approx(np.tanh(10.0 * paths.path[:, 5]))
    assert side[:, 1] == pytest.approx(paths.path[:, 5])
    timed = given_paths(gates=SimpleNamespace())
    timed.path[:, 0] = np.arange(6)
    assert "x" not in variables(timed)
    assert "stone" not in variables(timed)
