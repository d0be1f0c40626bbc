"""The one linearisation of a session: what it says at a fit."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

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
from friction_estimation.discovery.model.linearisation import (
    Linearisation,
    eliminate_factor,
    release_steps,
)
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.tuning import RELEASE_SIGMA, SPREADS

from ..conftest import effect, plain_session

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


@pytest.fixture
def by_hand(rng):
    """Four throws of thirty rows by random columns, which share three parameters."""
    columns = rng.normal(size=(4, 30, 6 + 1 + 3 + 1))
    columns[:, :, 6] *= 20.0
    grams = np.einsum("kni,knj->kij", columns, columns)
    ice: Any = SimpleNamespace()
    model = Model(ice=ice, ln_coupling=0.1, spread=0.02)
    return Linearisation(model=model, ln_factors=0.01 * rng.normal(size=4), grams=grams)


@pytest.mark.parametrize("kept", [None, [0, 2], [1], []])
def test_the_least_deviance_is_that_of_the_best_spread_and_the_free_parameters(by_hand, kept):
    """Against every spread of a fine grid; the others stay where they are."""
    chosen = [*(range(3) if kept is None else kept), 3]

    def deviance(spread):
        grams, log_terms = eliminate_factor(by_hand.reduced, by_hand.ln_factors, spread)
        whole = grams.sum(axis=0) + by_hand.prior
        part = whole[np.ix_(chosen, chosen)]
        return float(minimum_of(part).value) + float(log_terms.sum())

    best = min(deviance(spread) for spread in np.geomspace(SPREADS[0], SPREADS[-1], 600))
    assert by_hand.least(kept) == pytest.approx(best, abs=0.01)


def test_the_deviance_at_a_point_has_the_best_releases_and_factors_and_the_prior(by_hand):
    grams, log_terms = eliminate_factor(by_hand.reduced, by_hand.ln_factors, 0.02)
    prior = (0.1 / 0.15) ** 2
    expected = grams[:, -1, -1].sum() + log_terms.sum() + prior
    assert by_hand.deviance() == pytest.approx(expected)
    total = grams.sum(axis=0)
    total[1, 1] += 0.15**-2
    total[1, 3] -= 0.1 / 0.15**2
    total[3, 1] -= 0.1 / 0.15**2
    total[3, 3] += prior
    assert by_hand.total() == pytest.approx(total)
    assert by_hand.minimum().step == pytest.approx(np.linalg.solve(total[:3, :3], total[:3, 3]))
    other, _ = by_hand.each(0.3)
    assert other == pytest.approx(eliminate_factor(by_hand.reduced, by_hand.ln_factors, 0.3)[0])


def test_the_best_release_after_a_change_is_that_of_least_squares(rng):
    columns = rng.normal(size=(2, 20, 6 + 1 + 3 + 1))
    grams = np.einsum("kni,knj->kij", columns, columns)
    changes = rng.normal(size=(5, 2, 4))
    found = release_steps(grams, changes)
    assert found.shape == (5, 2, 6)
    for n in range(5):
        for k, block in enumerate(columns):
            left = block[:, -1] - block[:, 6:-1] @ changes[n, k]
            weak = np.vstack([block[:, :6], np.diag(1.0 / RELEASE_SIGMA)])
            expected = np.linalg.lstsq(weak, np.append(left, np.zeros(6)))[0]
            assert found[n, k] == pytest.approx(expected)


def test_gates_leave_the_place_across_the_sheet_as_it_is():
    gates: Any = SimpleNamespace()
    session = plain_session(throws=2, rows=3, gates=gates)
    ice: Any = SimpleNamespace()
    columns = [np.zeros((3, 3, 10)) for _ in range(2)]
    linear = Linearisation.of(
        session, WHITE, Model(ice=ice), session.first_states, np.zeros(2), columns
    )
    frozen = np.einsum("kii->ki", linear.grams) > 1e12
    # x and its velocity; the heading too, which no gate sees.
    assert frozen.tolist() == [[k in (0, 2, 4) for k in range(10)]] * 2
