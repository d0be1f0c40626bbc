"""Models with which an estimate begins."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import catalogue
from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import CARD
from friction_estimation.discovery.data.session import Session
from friction_estimation.estimation import whole_ice
from friction_estimation.estimation.whole_ice import (
    _estimate,
    _fit,
    believed_model,
    estimate_ice,
    known_effects_model,
)

USUAL = {card.name for card in catalogue().values() if card.usual}
CURL = ActiveEffect(name="curl", parameters={"strength": 0.004, "speed_exponent": 0.7})


@pytest.fixture(scope="module")
def session() -> Session:
    """Two throws that slow down by 0.12 m/s²."""
    t = np.arange(0.0, 8.0, 0.5)
    y = np.concatenate([way * (-10.0 + 2.0 * t - 0.06 * t**2) for way in (1.0, -1.0)])
    rows = len(t)
    return Session(
        throws=np.arange(2), orders=np.arange(2), stones=np.zeros(2, dtype=np.intp),
        clocks=np.array([0.0, 60.0]), times=np.tile(t, 2), xy=np.column_stack([0 * y, y]),
        theta=np.tile(t, 2), swept=0 * y, sigma=np.ones((2 * rows, 2)),
        starts=np.array([0, rows, 2 * rows]), usual_spins=np.full(2, 1.5),
    )  # fmt: skip


def test_an_ice_begins_with_the_effects_of_every_rink_at_the_friction_of_the_throws(session):
    model = believed_model(Ice.uniform(0.03), session)
    assert {term.name for term in model.terms} == {*USUAL, CARD.name}
    assert model.ice.friction.mu == pytest.approx(0.12 / 9.80665)
    for term in model.terms:
        if term.map_field is None:
            assert term.free
            for name, value in catalogue()[term.name].usual.items():
                assert term.values[name] == value
    assert model.map_field is not None
    assert not model.map_field.values.any()
    assert model.map_field.known is None


def test_effects_of_the_start_take_the_place_of_the_usual_ones(session):
    model = believed_model(Ice.uniform(0.01, effects=(CURL,)), session)
    curls = [term for term in model.terms if term.name == "curl"]
    assert len(curls) == 1
    assert curls[0].values["strength"] == 0.004
    assert {term.name for term in model.terms} == {*USUAL, CARD.name, "curl"}


def test_the_map_of_another_day_holds_within_its_sigma(session):
    mu = np.full(PAPER_SHEET.shape, 0.02)
    mu[40:] = 0.01
    before = Ice.uniform(0.01)
    friction = replace(before.friction, mu=mu, sigma=0.1 * mu)
    model = believed_model(replace(before, friction=friction), session, from_map=True)
    assert model.ice.friction.mu == pytest.approx(mu)
    assert model.map_field is not None
    assert model.map_field.known == pytest.approx(np.full(mu.size, 0.1))
    # In the middle of the lengths and changes that are tried.
    assert 1.5 < model.map_field.length < 4.0
    assert 0.002 < model.map_field.amplitude < 0.1


def test_known_effects_stay_as_they_are_and_paths_bend_freely(session):
    slope = ActiveEffect(name="slope", parameters={"x": 1e-4, "y": 0.0})
    model = known_effects_model(Ice.uniform(0.01, effects=(slope,)), session)
    free = {term.name: term.free for term in model.terms}
    assert free == {"slope": (), "curl": catalogue()["curl"].first, CARD.name: ()}
    assert all(not term.beliefs for term in model.terms)
    assert model.term("slope").values["x"] == 1e-4
    # Known curl is known.
    model = known_effects_model(Ice.uniform(0.01, effects=(CURL,)), session, uniform=True)
    assert {term.name: term.free for term in model.terms} == {"curl": ()}
    assert model.map_field is None
    assert model.ice.friction.mu == pytest.approx(0.12 / 9.80665)


@dataclass(frozen=True)
class GivenModel:
    ripple: Any = None


@pytest.fixture
def steps(monkeypatch):
    """Steps of a fit in words, and the ripple that a search finds."""
    ripple: list[Any] = [None]

    def fitted(model, session, noise=None):
        words = f"fit{' with a ripple' if model.ripple else ''}{' again' if noise else ''}"
        return SimpleNamespace(model=model, noise="noise", steps=[words])

    def renewed(fit):
        return SimpleNamespace(**{**vars(fit), "steps": [*fit.steps, "renewed"]})

    monkeypatch.setattr(whole_ice, "fit_with_noise", fitted)
    monkeypatch.setattr(whole_ice, "renew_map", renewed)
    monkeypatch.setattr(whole_ice, "find_ripple", lambda _: SimpleNamespace(ripple=ripple[0]))

    def run(bias="auto", *, uniform=False, found=None):
        ripple[0] = found
        model: Any = GivenModel()
        session: Any = None
        fit, search = _fit(model, session, bias, uniform=uniform)
        return fit.steps, search is not None

    return run


def test_a_bias_is_searched_with_a_map_and_fitted_if_it_is_found(steps):
    assert steps() == (["fit", "renewed"], True)
    assert steps("off") == (["fit", "renewed"], False)
    assert steps(uniform=True) == (["fit"], False)
    assert steps(found="ripple") == (["fit with a ripple again", "renewed"], True)


def test_the_level_of_an_estimate_is_the_mean_logarithm_where_stones_ran(monkeypatch):
    """Its slides are those of the fit and of exceptional throws."""
    slides = [SimpleNamespace(track=SimpleNamespace(throw=k)) for k in (1, 2, 3, 4)]
    monkeypatch.setattr(whole_ice, "free_slides", lambda _: (slides, ["throw 9: too short"]))
    session = SimpleNamespace(
        gates=None, throws=np.array([1, 3]), left_out=("throw 9: too short", "throw 8: off")
    )
    fitted: Any = SimpleNamespace(session=session)
    mu, observed = np.full(PAPER_SHEET.shape, 0.5), np.zeros(PAPER_SHEET.shape, dtype=bool)
    mu[3, :2], observed[3, :2] = [0.004, 0.016], True
    level = SimpleNamespace(sigma=0.05)
    friction = replace(Ice.uniform(0.01).friction, mu=mu, observed=observed)
    ice: Any = SimpleNamespace(
        friction=SimpleNamespace(mu=friction.mu, observed=friction.observed, level=level)
    )
    found = _estimate(ice, fitted, None, [])
    assert found.mu == pytest.approx(0.008)
    assert found.sigma == pytest.approx(0.0004)
    assert [slide.track.throw for slide in found.slides] == [1, 3]
    assert found.skipped == ("throw 9: too short", "throw 8: off")
    assert found.fit is fitted
    assert found.camera_bias is None
    discovery: Any = SimpleNamespace(events=[4], seen="seen")
    odd = _estimate(ice, fitted, None, [], discovery=discovery)
    assert [slide.track.throw for slide in odd.slides] == [1, 3, 4]
    assert odd.fit == "seen"
    level.sigma = 0.0
    assert np.isnan(_estimate(ice, fitted, None, [], uniform=True).sigma)
    assert _estimate(ice, fitted, None, [], uniform=True).mu == 0.5


def test_a_prior_goes_with_no_other_ice_and_with_no_single_friction():
    ice = Ice.uniform(0.01)
    for others in ({"start": ice}, {"uniform": True}):
        with pytest.raises(InputError, match="expected one of a prior map, a uniform ice"):
            estimate_ice([], prior=ice, **others)
