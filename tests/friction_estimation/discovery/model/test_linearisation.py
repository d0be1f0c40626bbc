"""The one linearisation of a session: what it says at a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.physics import State
from friction_estimation.discovery import (
    SessionNoise,
    base_model,
    candidates,
    fit,
    fit_with_noise,
    open_session,
    predict,
)
from friction_estimation.discovery.model.linearisation import Linearisation

from ..conftest import effect

WHITE = SessionNoise(white=(0.004, 0.004, 0.02), fading=(0.0,) * 3, memory=(0.1,) * 3)


@pytest.fixture
def fitted(make_session):
    session = open_session(make_session([effect("curl", strength=0.006)], throws=8, scatter=0.01))
    model = base_model(None, session)
    (curl,) = [term for term in candidates(session) if term.label == "curl"]
    return fit_with_noise(model.with_terms(curl), session)


def test_at_a_fit_nothing_is_left_to_gain(fitted):
    assert fitted.linear.least() == pytest.approx(fitted.deviance, abs=0.2)
    step = np.linalg.solve(fitted.linear.total()[:-1, :-1], fitted.linear.total()[:-1, -1])
    sigma = np.sqrt(np.diag(np.linalg.inv(fitted.linear.total()[:-1, :-1])))
    assert (np.abs(step) < 0.2 * sigma).all()


def test_columns_whitened_again_are_the_same(fitted):
    again = fitted.linear_in(fitted.model, fitted.columns, fitted.residuals)
    scale = np.sqrt(np.einsum("kii->ki", fitted.linear.reduced)).max(axis=0)
    difference = (again.reduced - fitted.linear.reduced) / np.outer(scale, scale)
    assert np.abs(difference).max() < 1e-3


def test_columns_are_what_paths_do_after_a_small_change(fitted):
    """Of each number of the releases, of the frictions of throws, and of shared parameters."""
    model, session = fitted.model, fitted.session
    numbers = 7 + len(model.vector)

    def measured(j, step):
        moved = step * np.eye(numbers)[j]
        place = fitted.states + moved[:6], fitted.ln_factors + moved[6]
        return predict(model.at(model.vector + moved[7:]), session, *place)[:, [0, 1, 4]]

    moving = np.hypot(*fitted.predicted[:, 2:4].T) > 0.3
    for j in range(numbers):
        step = 1e-5 if j == numbers - 1 else 1e-4  # the strength of curl is a hundredth
        change = (measured(j, step) - measured(j, -step)) / (2 * step)
        size = np.abs(change).max(axis=0) + 1e-3
        off = np.abs(fitted.columns[:, :, j] - change)[moving] / size
        assert off.max() < 0.03, j


def test_at_a_fit_one_step_is_enough(fitted):
    begin = {"states": fitted.states, "ln_factors": fitted.ln_factors}
    again = fit(fitted.model, fitted.session, fitted.noise, iterations=1, **begin)
    assert again.deviance == pytest.approx(fitted.deviance, abs=0.2)


def test_a_spin_that_was_not_seen_costs_what_its_prior_says(make_session):
    """Of columns of zeros nothing else is left."""
    session = open_session(make_session(throws=3))
    theta = session.theta.copy()
    theta[session.rows(1)] = np.nan
    session = replace(session, theta=theta, usual_spins=np.array([1.5, -1.5, 1.5]))
    model, states = base_model(None, session), session.first_states
    columns = [np.zeros((len(session.times[session.rows(i)]), 3, 10)) for i in range(3)]
    linear = Linearisation.of(session, WHITE, model, states, np.zeros(3), columns)
    seen, blind, other = linear.grams
    assert not seen.any()
    assert not other.any()
    for step in (-1.0, 0.0, 0.5):
        move = np.zeros(10)
        move[State.OMEGA], move[-1] = -step, 1.0
        off = states[1, State.OMEGA] + step + 1.5
        assert move @ blind @ move == pytest.approx((off / 0.6) ** 2)
    move[State.THETA] = 1e-4  # nothing shows the heading, which stays
    assert move @ blind @ move > 1e4
