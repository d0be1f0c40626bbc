"""Responses of paths to pushes, where they can be written down."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import Term, crossed_by, field_along, predict
from friction_estimation.discovery.model import sensitivity
from friction_estimation.discovery.model.friction_field import CARD
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.response import (
    Instants,
    LinearisedPaths,
    _solve,
    instants_of,
)
from friction_estimation.discovery.model.sensitivity import _merged, _moved, _step

from ..conftest import plain_session


def free_motion(session, speed=1.0):
    """Paths of stones on which nothing acts: positions change by velocities by the time."""
    instants = instants_of(session)
    n = len(instants.times)
    path, transition = np.zeros((n, 6)), np.tile(np.eye(6), (n, 1, 1))
    path[:, 3] = speed
    transition[:, 0, 2] = transition[:, 1, 3] = transition[:, 4, 5] = instants.times
    return LinearisedPaths(session, instants, path, transition, np.zeros((n, 3)))


def test_instants_are_a_tenth_of_a_second_apart_at_most():
    session = plain_session(throws=3, rows=3, spacing=0.55)
    times, starts = instants_of(session)
    assert starts.tolist() == [0, 12, 24, 36]
    assert times[12:24] == pytest.approx(np.linspace(0.0, 1.1, 12))
    single, starts = instants_of(plain_session(throws=2, rows=1))
    assert single.tolist() == [0.0, 0.0, 0.0, 0.0]
    assert starts.tolist() == [0, 2, 4]


def test_a_push_moves_a_free_stone_by_half_its_acceleration_and_the_square_of_the_time():
    """Between instants it is linear, and after the last one it stays."""
    session = plain_session(throws=2, rows=9, spacing=0.25)
    paths = free_motion(session)
    t, times = paths.instants.times, session.times
    pushes = np.tile([0.2, -0.4, 0.6], (len(t), 1))
    sizes = np.column_stack([np.ones(len(t)), 3.0 * t])
    moved = paths.responses(pushes, sizes)
    assert moved.shape == (18, 3, 2)
    even = np.outer(times**2 / 2, [0.2, -0.4, 0.6])
    growing = np.outer(times**3 / 2, [0.2, -0.4, 0.6])
    assert moved[:, :, 0] == pytest.approx(even, abs=1.5e-3)
    assert moved[:, :, 1] == pytest.approx(growing, abs=0.01)
    at_instants = np.isclose(times % 0.5, 0.0)
    assert moved[at_instants, :, 0] == pytest.approx(even[at_instants], abs=1e-12)
    assert not moved[times == 0.0].any()


def test_a_stone_that_hardly_moves_any_more_is_not_pushed():
    session = plain_session(throws=1, rows=5, spacing=0.5)
    paths = free_motion(session)
    t = paths.instants.times
    paths.path[t > 1.05, 3] = 0.029
    pushes = np.tile([1.0, 0.0, 0.0], (len(t), 1))
    moved = paths.responses(pushes, np.ones((len(t), 1)))[:, 0, 0]
    # A second of pushing, after which it goes on as fast as it then is.
    assert moved == pytest.approx([0.0, 0.125, 0.5, 1.0, 1.5])
    paths.path[:, 3] = 0.0
    assert not paths.responses(pushes, np.ones((len(t), 1))).any()


def test_displacements_of_rows_are_interpolated_to_the_instants():
    session = plain_session(throws=2, rows=3, spacing=0.2)
    paths = free_motion(session)
    rows = np.zeros((6, 3))
    rows[:3] = np.outer([0.0, 2.0, 4.0], [1.0, 10.0, 100.0])
    shown = paths.at_instants(rows)
    assert shown[:5, [0, 1, 4]] == pytest.approx(np.outer([0.0, 1.0, 2.0, 3.0, 4.0], [1, 10, 100]))
    assert not shown[5:].any()
    assert not shown[:, [2, 3, 5]].any()
    assert paths.xy.tolist() == paths.path[:, :2].tolist()


def test_where_a_derivative_is_singular_the_smallest_change_does():
    singular = np.diag([2.0, 0.0])[None]
    assert _solve(singular, np.array([[[4.0], [0.0]]]))[0, :, 0] == pytest.approx([2.0, 0.0])
    assert _solve(2.0 * np.eye(2)[None], np.ones((1, 2, 1)))[0, :, 0] == pytest.approx([0.5, 0.5])


def test_rows_and_instants_are_followed_in_the_order_of_time():
    session = plain_session(throws=2, rows=3, spacing=1.0)
    instants = Instants(np.array([0.5, 1.5, 0.2]), np.array([0, 2, 3]))
    times, starts, rows, at = _merged(session, instants)
    assert times.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0, 0.0, 0.2, 1.0, 2.0]
    assert starts.tolist() == [0, 5, 9]
    assert rows.tolist() == [0, 2, 4, 5, 7, 8]
    assert at.tolist() == [1, 3, 6]


def test_releases_are_moved_one_number_after_the_other_and_hardly():
    """By millimetres, parts of a millimetre per second, and milliradians."""
    states = np.arange(12.0).reshape(2, 6)
    moved = _moved(states)
    assert len(moved) == 6
    for j, other in enumerate(moved):
        change = other - states
        assert (change[:, j] > 1e-4).all()
        assert (change[:, j] < 3e-3).all()
        assert not np.delete(change, j, axis=1).any()


# --- steps of finite differences -----------------------------------------------------------------


@pytest.fixture
def step_of(monkeypatch):
    """The step of a parameter by whose unit paths move, and headings turn, by given amounts."""

    def find(moves, turns=0.0, value=0.0, low=-1.0, high=1.0, known=None):
        card = SimpleNamespace(parameter=lambda _: SimpleNamespace(low=low, high=high))

        class Linear:
            names = (("", "ln_mu"), ("curl", "strength"))
            steps = {} if known is None else {("curl", "strength"): known}

            @property
            def vector(self):
                return np.array([0.0, value])

            def term(self, _):
                return SimpleNamespace(card=card)

            def at(self, vector):
                return vector[1] - value

        model: Any = Linear()

        def predicted(change, *_):
            out = np.zeros((4, 6))
            out[2, 1], out[3, 4] = moves * change, turns * change
            return out

        monkeypatch.setattr(sensitivity, "predict", predicted)
        session: Any = None
        found = _step(model, session, np.zeros(1), np.zeros(1), np.zeros((4, 3)), 1)
        again = _step(model, session, np.zeros(1), np.zeros(1), np.zeros((4, 3)), 1)
        assert again == found  # it is found once
        assert _step(model, session, np.zeros(1), np.zeros(1), np.zeros((4, 3)), 0) == 0.01
        return found

    return find


@pytest.mark.parametrize("moves", [0.5, 20.0, 3000.0])
def test_a_step_moves_paths_by_a_few_millimetres(step_of, moves):
    assert 1e-3 < step_of(moves) * moves < 1e-2
    assert 1e-3 < step_of(-moves) * moves < 1e-2


def test_a_step_that_turns_stones_counts_a_tenth(step_of):
    assert 1e-2 < step_of(0.0, turns=5.0) * 5.0 < 1e-1
    assert 1e-3 < step_of(5.0, turns=5.0) * 5.0 < 1e-2


def test_a_step_is_a_small_part_of_what_a_parameter_may_be(step_of):
    """A fiftieth of the bounds, or of one without bounds, if nothing shows it."""
    assert step_of(0.0) == pytest.approx(0.02 * 2.0)
    assert step_of(0.0, low=-np.inf, high=np.inf) == pytest.approx(0.02)
    assert step_of(1e-9, low=0.0, high=0.5) == pytest.approx(0.02 * 0.5)


def test_a_step_leads_away_from_a_bound(step_of):
    assert step_of(20.0, value=1.0) < 0.0
    assert step_of(20.0, value=0.0) > 0.0
    assert abs(step_of(20.0, value=1.0)) == pytest.approx(step_of(20.0))
    assert step_of(20.0, known=0.25, value=0.5) == 0.25
    assert step_of(20.0, known=0.25, value=0.8) == -0.25


def test_columns_of_a_throw_stand_in_their_places(rng):
    """Those of a map are computed when they are asked for, and further ones follow."""
    session = plain_session(throws=2, rows=12)
    states = session.first_states
    y = np.linspace(-12.0, 12.0, 60)
    crossed = crossed_by(PAPER_SHEET, [np.column_stack([0 * y, y])])
    field = field_along(PAPER_SHEET, crossed, 9.0, np.inf)
    model = Model(ice=Ice.uniform(0.009), terms=(Term(card=CARD, map_field=field),))
    predicted, of_throw = sensitivity.sensitivities_by_throw(model, session, states, np.zeros(2))
    rows, further = session.rows(1), rng.normal(size=(12, 3, 1))
    columns = of_throw(1, further)
    assert columns.shape == (12, 3, 7 + len(model.vector) + 1)
    assert columns[:, :, -1:] == pytest.approx(further)
    assert columns[:, :, 6] == pytest.approx(columns[:, :, 7])
    for j in (0, 3, 7, 8, 9, 8 + len(field)):
        moved, vector, step = states.copy(), model.vector, 1e-5
        if j < 6:
            moved[:, j] += step
        else:
            vector[j - 7] += step
        there = predict(model.at(vector), session, moved, np.zeros(2))
        change = ((there - predicted)[rows][:, [0, 1, 4]]) / step
        assert columns[:, :, j] == pytest.approx(change, abs=0.01 * np.abs(change).max() + 1e-6)
