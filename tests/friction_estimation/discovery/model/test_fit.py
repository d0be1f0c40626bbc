from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import State, catalogue, slide
from curling_env.throw import Throw
from friction_estimation.discovery import (
    Term,
    base_model,
    candidates,
    fit,
    fit_with_noise,
    linearise,
    misfit_of,
    neutral_values,
    open_session,
    refit,
    standard_errors,
)
from friction_estimation.discovery.model.linearisation import Linearisation

from ..conftest import effect


def test_friction_scatter_and_errors(make_session):
    session = open_session(make_session(scatter=0.004, throws=16))
    fitted = fit_with_noise(base_model(None, session), session)
    mu = fitted.model.ice.friction.mu[0, 0] * np.exp(fitted.model.ln_mu)
    sigma = standard_errors(fitted)["", "ln_mu"]
    assert abs(np.log(mu / 0.009)) < 4 * sigma
    assert 0.002 < fitted.model.spread < 0.008
    assert misfit_of(fitted).white


def test_a_spin_that_was_not_seen_stays_near_the_usual_one(make_session):
    """Only the last metres tell of it, and not more than the prior does."""
    tracks = [replace(track, theta=np.full(len(track), np.nan)) for track in make_session(throws=4)]
    session = open_session(tracks)
    fitted = fit_with_noise(base_model(None, session), session)
    spins = np.abs(fitted.states[:, State.OMEGA])
    usual = np.abs(session.usual_spins)
    assert np.abs(spins - usual).max() < 1.2
    assert np.abs(spins - usual).max() > 1e-3  # they tell something
    faster = fitted.states.copy()
    faster[:, State.OMEGA] *= 2.0
    again = fit(fitted.model, fitted.session, fitted.noise, states=faster)
    assert np.abs(again.states[:, State.OMEGA]) == pytest.approx(spins, abs=0.05)


def test_a_spin_that_was_not_seen_does_not_change_its_side():
    """The end of a path that is off asks for any spin, and a fit that tries them gets lost."""
    path = slide(Ice.uniform(0.0087), Throw(speed=2.13, spin=1.1).release(), fps=15).trajectory
    share = path.t / path.t[-1]
    off = np.column_stack([0 * share, -0.02 - 0.06 * share**8])
    rng = np.random.default_rng(11)
    seen = replace(
        path,
        xy=path.xy + off + rng.normal(0, 1e-4, path.xy.shape),
        theta=np.full(len(path), np.nan),
    )
    session = open_session([seen])
    fitted = fit_with_noise(base_model(None, session), session)
    assert np.sign(session.usual_spins) * fitted.states[:, State.OMEGA] > 0.2


def test_a_missing_effect_shows_as_slow_misfit(make_session):
    session = open_session(make_session([effect("slope", x=2e-4, y=0.0)]))
    left = misfit_of(fit_with_noise(base_model(None, session), session))
    assert not left.white
    assert left.ratio > 5


def test_of_a_stones_friction_and_curl_in_an_ice_file_what_it_has_is_fitted(make_session):
    session = open_session(make_session(throws=4))

    def terms(**parameters):
        ice = Ice.uniform(0.009, effects=(effect("stone_bias", stone=1, **parameters),))
        return [(term.label, term.free) for term in base_model(ice, session).terms]

    assert terms(factor=1.02) == [("stone_bias[1]", ("factor",))]
    assert terms(curl_factor=1.2) == [("stone_bias[1, curl_factor]", ("curl_factor",))]
    assert terms(factor=1.02, curl_factor=1.2) == [("stone_bias[1]", ("factor", "curl_factor"))]


def test_what_only_differs_between_throws_is_fitted_where_nothing_else_does(make_session):
    """Without a scatter the spread falls to nothing with the step that explains it."""
    tracks = make_session([effect("stone_bias", stone=1, factor=1.07)], scatter=0.0)
    session = open_session(tracks)
    plain = fit_with_noise(base_model(None, session), session)
    assert plain.model.spread > 0.02
    card = catalogue()["stone_bias"]
    term = Term(card=card, values=neutral_values(card, stone=1.0), free=("factor",))
    fitted = refit(plain, plain.model.with_terms(term))
    assert fitted.model.terms[0].values["factor"] == pytest.approx(1.07, abs=2e-3)
    assert fitted.model.spread < 2e-3
    assert plain.deviance - fitted.deviance > 50


def test_base_ice_is_scaled_to_the_throws(make_session):
    session = open_session(make_session())
    base = Ice.uniform(0.012)
    fitted = fit_with_noise(base_model(base, session), session)
    mu = fitted.model.improved_ice({}).friction.mu
    assert mu.shape == base.friction.mu.shape
    assert abs(mu[0, 0] / 0.009 - 1) < 0.01


def test_a_step_after_which_the_numbers_overflow_is_refused(make_session, monkeypatch):
    session = open_session(make_session(throws=3))
    calls = []

    def flying_off(*args):
        calls.append(args)
        predicted, linear = linearise(*args)
        if len(calls) > 1:
            linear = replace(linear, grams=linear.grams.copy())
            linear.grams[:, 6:, 6:] = -1e250
        return predicted, linear

    start = fit_with_noise(base_model(Ice.uniform(0.007), session), session)
    monkeypatch.setattr("friction_estimation.discovery.model.fit.linearise", flying_off)
    found = fit(start.model, session, start.noise)
    assert len(calls) > 1
    assert np.isfinite(found.deviance)
    assert np.isfinite(found.predicted).all()


@pytest.fixture
def far_from_its_law(make_session):
    """A fit with friction of another law than the ice, and a model far from that law."""
    law = effect("speed_dependent_friction", exponent=1.0, share=0.25, speed_offset=0.06)
    session = open_session(make_session([law], throws=8, seed=1))
    plain = fit_with_noise(base_model(None, session), session)
    term = next(t for t in candidates(session) if t.label == law.name)
    begin = term.with_values(exponent=1.0, share=0.7, speed_offset=0.06)
    return plain, plain.model.with_terms(begin.freed("share", "speed_offset"))


def test_a_fit_that_cannot_reach_its_goal_ends_early(far_from_its_law, monkeypatch):
    plain, model = far_from_its_law
    taken: list[float] = []
    counted = Linearisation.deviance

    def deviance(linear: Linearisation) -> float:
        taken.append(counted(linear))
        return taken[-1]

    monkeypatch.setattr(Linearisation, "deviance", deviance)
    free = refit(plain, model, iterations=20)
    steps = len(taken)
    assert free.deviance < plain.deviance - 1e5
    # While steps are shortened the deviance falls unevenly, and says little about its end.
    reached = refit(plain, model, iterations=20, goal=free.deviance + 1.0)
    assert reached.deviance == free.deviance
    assert len(taken) == 2 * steps
    hopeless = refit(plain, model, iterations=20, goal=free.deviance - 1e5)
    assert hopeless.deviance > free.deviance
    assert len(taken) < 3 * steps


def test_the_last_step_needs_no_linearisation(make_session):
    session = open_session(make_session([effect("curl", strength=0.006)], throws=8))
    card = catalogue()["curl"]
    term = Term(card=card, values=neutral_values(card), free=card.first)
    found = fit_with_noise(base_model(None, session).with_terms(term), session)
    point = found.states, found.ln_factors
    _, linear = linearise(found.model, found.session, found.noise, *point)
    assert found.deviance == pytest.approx(linear.deviance(), abs=0.1)
    assert found.linear.minimum().step == pytest.approx(linear.minimum().step, abs=1e-4)
    assert found.linear.grams[:, -1, -1] == pytest.approx(linear.grams[:, -1, -1], rel=1e-3)
