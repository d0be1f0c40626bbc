"""The joint Bayesian bound: its responses against throws made again, and its limits."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from blind.bound import bound_of, field_basis, free_places
from blind.hidden import log_map
from blind.law import MAP_LENGTH, MAP_SD, SQUARES
from blind.linearised import WIDE, respond, whitened
from blind.sessions import make_session, release_of

from curling_env.trajectory import Trajectory

NONE_BEFORE = np.zeros(SQUARES)


@pytest.fixture(scope="module")
def session():
    hidden = ("friction_map", "curl", "slope")
    columns, truth = make_session(hidden, np.random.default_rng(3), throws=6)
    numbers, t = np.array(columns["throw"]), np.array(columns["t"])
    xy = np.column_stack([columns["x"], columns["y"]])
    tracks = [Trajectory(t=t[numbers == k], xy=xy[numbers == k]) for k in range(6)]
    return json.loads(json.dumps(truth, default=float)), tracks


@pytest.fixture(scope="module")
def throw(session):
    sealed, _ = session
    q, pattern = np.array(sealed["numbers"]), np.array(sealed["pattern"])
    release = release_of(sealed["throws"][0])
    path = release.path(q, pattern, NONE_BEFORE)
    basis = field_basis(q[MAP_SD], q[MAP_LENGTH])
    places = free_places(sealed)
    response = respond(release, path, q, pattern, NONE_BEFORE, places, basis)
    return q, pattern, release, places, basis, response


def late(path):
    """Place and heading of the first throw after most of its way."""
    return path[6000][[0, 1, 4]]


def test_a_path_answers_to_parameters_as_throws_made_again_do(throw):
    q, pattern, release, places, _, response = throw
    for j, place in enumerate(places):
        more, less = q.copy(), q.copy()
        step = 1e-3 * WIDE[place]
        more[place] += step
        less[place] -= step
        again = late(release.path(more, pattern, NONE_BEFORE))
        again = (again - late(release.path(less, pattern, NONE_BEFORE))) / (2 * step)
        ours = response.parameters[600, [0, 1, 4], 2 + j]
        np.testing.assert_allclose(ours, again, rtol=2e-3, atol=2e-3 * np.abs(again).max())


def test_a_path_answers_to_its_release_as_throws_made_again_do(throw):
    q, pattern, release, _, _, response = throw
    for j, step in enumerate(1e-3 * np.eye(6)):
        more, less = (replace(release, start=release.start + s) for s in (step, -step))
        again = late(more.path(q, pattern, NONE_BEFORE)) - late(less.path(q, pattern, NONE_BEFORE))
        np.testing.assert_allclose(
            response.release[600, [0, 1, 4], j], again / 2e-3, rtol=2e-3, atol=5e-3
        )


def test_a_path_answers_to_the_field_as_throws_made_again_do(throw):
    q, pattern, release, _, basis, response = throw
    unit = log_map(q, pattern).ravel() / q[MAP_SD]
    weights = np.linalg.lstsq(basis.reshape(len(unit), -1), unit, rcond=None)[0]
    more, less = q.copy(), q.copy()
    more[MAP_SD] += 1e-3
    less[MAP_SD] -= 1e-3
    again = late(release.path(more, pattern, NONE_BEFORE))
    again = (again - late(release.path(less, pattern, NONE_BEFORE))) / 2e-3
    ours = (response.field[600] @ weights)[[0, 1, 4]]
    np.testing.assert_allclose(ours, again, rtol=0.01, atol=0.002)


def test_noise_with_a_memory_is_made_white():
    t = np.cumsum([0.0, 0.1, 0.1, 0.3, 0.1])
    covariance = 0.005**2 * np.exp(-np.abs(t[:, None] - t) / 0.4)
    white = whitened(np.eye(5), t, 0.005, 0.4)
    np.testing.assert_allclose(white @ covariance @ white.T, np.eye(5), atol=1e-9)


def test_the_bound_is_between_zero_and_the_field_itself(session):
    sealed, tracks = session
    best = bound_of(sealed, tracks)
    fewer = bound_of(sealed, tracks[:3])
    blind = bound_of({**sealed, "sigma": 1e4, "scatter": 1e4}, tracks)
    field = field_basis(sealed["numbers"][MAP_SD], sealed["numbers"][MAP_LENGTH])[best.crossed]
    spread = np.sqrt(((field - field.mean(axis=0)) ** 2).sum(axis=1).mean())
    assert 0.0 < best.rmse < 0.5 * spread
    assert blind.rmse == pytest.approx(spread, rel=0.1)
    assert fewer.crossed.sum() < best.crossed.sum()
