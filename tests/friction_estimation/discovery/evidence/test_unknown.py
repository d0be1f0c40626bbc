"""What an unexplained discrepancy follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.discovery.data.session import open_session
from friction_estimation.discovery.evidence.unknown import (
    PUSHES,
    _powers,
    _tents,
    find_dependences,
    responses,
    variables,
)
from friction_estimation.discovery.model.baseline import base_model
from friction_estimation.discovery.search.selection import fit_with_noise

from ..conftest import effect


@pytest.fixture
def fitted_to(make_session):
    def make(*effects, **options):
        session = open_session(make_session(effects, **options))
        return fit_with_noise(base_model(None, session), session)

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


def test_variables_are_centred_and_those_that_do_not_vary_left_out(fitted_to):
    fitted = fitted_to(throws=6)
    functions = variables(fitted)
    assert set(functions) == {
        *("speed", "t", "y", "x", "spin", "theta", "clock", "order", "swept", "stone")
    }
    rows = len(fitted.predicted)
    for name, columns in functions.items():
        assert columns.shape[0] == rows
        assert columns.mean(axis=0) == pytest.approx(0, abs=1e-9), name
    theta, spin = fitted.predicted[:, 4], fitted.predicted[:, 5]
    assert functions["theta"] == pytest.approx(
        np.column_stack(
            [np.sin(theta) - np.sin(theta).mean(), np.cos(theta) - np.cos(theta).mean()]
        )
    )
    assert functions["spin"].shape == (rows, 4)
    side = np.tanh(spin / 0.1)
    assert functions["spin"][:, 0] == pytest.approx(side - side.mean())
    swept = fitted.session.swept
    assert functions["swept"][:, 0] == pytest.approx(swept - swept.mean())
    assert functions["x"].shape == (rows, 3)
    assert functions["y"].shape == (rows, 21)
    assert functions["speed"].shape == functions["t"].shape == (rows, 5)
    one = fitted.session.only([0])
    alone = replace(fitted, session=one, predicted=fitted.predicted[fitted.session.rows(0)])
    assert not {"clock", "order", "stone", "swept"} & set(variables(alone))


def test_a_constant_push_moves_a_stone_by_half_its_square_of_time(fitted_to):
    fitted = fitted_to(throws=4)
    moved = responses(fitted, np.ones((len(fitted.predicted), 1)))
    assert moved.shape == (len(fitted.predicted), 3, len(PUSHES))
    for i in range(4):
        rows = fitted.session.rows(i)
        path, t = fitted.predicted[rows], fitted.session.times[rows]
        gone = (t - t[0])[: len(t) // 2]
        half_square = 0.5 * gone * (gone + t[1] - t[0])  # as sums make it
        early = slice(0, len(gone))
        speed = np.hypot(path[early, 2], path[early, 3])
        travel = path[early, 2:4] / speed[:, None]
        along, left = moved[rows][early, :2, 0], moved[rows][early, :2, 1]
        assert (along * travel).sum(axis=1) == pytest.approx(half_square, rel=1e-6)
        normal = np.column_stack([-travel[:, 1], travel[:, 0]])
        # A push to the left turns the travel; friction then acts along the new travel.
        turned = np.cumsum(np.diff(t, prepend=t[0])[early] / speed)
        expected = np.cumsum(speed * turned * np.diff(t, prepend=t[0])[early])
        assert (left * normal).sum(axis=1) == pytest.approx(expected, rel=1e-6)
        assert moved[rows][early, 2, 2] == pytest.approx(half_square, rel=1e-6)
        side = 1.0 if path[0, 3] > 0 else -1.0
        assert moved[rows][:, :2, 3] == pytest.approx(side * moved[rows][:, :2, 0])
        assert moved[rows][:, :2, 4] == pytest.approx(side * moved[rows][:, :2, 1])


def test_a_push_that_follows_the_spin_is_found_to_follow_the_spin(fitted_to, rng):
    found = find_dependences(fitted_to(effect("curl", strength=0.006), throws=12), rng)
    assert found
    assert (found[0].variable, found[0].push) == ("spin", "left")
    assert 0.5 < found[0].share <= 1.0
    assert found[0].p < 0.01
    assert len(found) <= 3


def test_nothing_is_followed_where_nothing_is_missing(fitted_to, rng):
    assert find_dependences(fitted_to(throws=10), rng) == []
