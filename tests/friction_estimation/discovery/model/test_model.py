"""Parts of a model: its law, its camera, and the ice that it writes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import catalogue
from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import (
    CARD,
    Term,
    base_model,
    crossed_by,
    field_along,
    first_friction,
    neutral_values,
)
from friction_estimation.discovery.model.gaussian_field import CameraRipple, GatePlaces
from friction_estimation.discovery.model.model import Model, reported, throw_inputs

from ..conftest import effect, plain_session

EVEN = Ice.uniform(0.009)


def of_effect(name: str, *free: str, **values: float) -> Term:
    card = catalogue()[name]
    return Term(card=card, values=neutral_values(card, **values), free=free or card.first)


def lane() -> list[np.ndarray]:
    y = np.linspace(-8.0, 8.0, 40)
    return [np.column_stack([0 * y, y])]


def test_the_law_has_the_friction_and_the_coupling_of_the_model():
    law = Model(ice=EVEN).law
    assert law.mu == pytest.approx(np.array([[0.009]]))
    assert not law.patterned
    moved = Model(ice=EVEN, ln_mu=0.2, ln_coupling=-0.3).law
    assert moved.mu == pytest.approx(0.009 * np.exp(0.2))
    assert moved.turning == pytest.approx(law.turning * np.exp(-0.3))
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, lane()), 8.0, np.inf)
    field = field.at(0.05 * np.ones(len(field)))
    mapped = Model(ice=EVEN, ln_mu=0.2, terms=(Term(card=CARD, map_field=field),)).law
    assert mapped.patterned
    assert mapped.mu == pytest.approx(0.009 * np.exp(0.2 + field.ln_mu))


def test_the_camera_displaces_places_one_effect_after_the_other():
    true = np.zeros((3, 6))
    true[:, 1], true[:, 4] = [-5.0, 0.0, 5.0], [0.0, np.pi / 2, np.pi]
    offset = of_effect("tracking_offset", forward=0.01, left=0.0)
    gates = GatePlaces(
        places=np.array([-5.0, 5.0]), amplitude=0.01, values=np.array([0.002, -0.003])
    )
    shown = reported(Model(ice=EVEN, terms=(offset,), systematic_error=gates), true)
    assert shown[:, 0] == pytest.approx([0.01, 0.0, -0.01], abs=1e-12)
    assert shown[:, 1] - true[:, 1] == pytest.approx([0.002, 0.012, -0.003])
    assert shown[:, 2:] == pytest.approx(true[:, 2:])
    ripple = CameraRipple(
        nodes=np.linspace(-6.0, 6.0, 6), length=1.5, values=np.array([0, 0, 0.1, 0, 0, 0])
    )
    alone = reported(Model(ice=EVEN, ripple=ripple), true)
    assert alone[:, :2] - true[:, :2] == pytest.approx(ripple.displacement(true[:, :2], true[:, 4]))
    assert true[0, 0] == 0.0  # what was given stays as it was


def test_throws_bring_along_what_they_had():
    session = plain_session(throws=3, stones=np.array([4, 5, 6]))
    inputs = throw_inputs(session, np.array([0.0, 1.0, 2.0]), np.array([0, 1, 2, 3]))
    assert inputs.stones.tolist() == [4, 5, 6]
    assert inputs.orders.tolist() == [0, 1, 2]
    assert inputs.clocks.tolist() == [0.0, 60.0, 120.0]
    assert inputs.ran.tolist() == [0, 0, 0]
    assert inputs.times.tolist() == [0.0, 1.0, 2.0]
    assert len(inputs.pushes.sizes) == 0


def test_an_ice_file_has_the_errors_of_level_and_effects_together():
    sigma = np.full(PAPER_SHEET.shape, 3e-4)
    ice = replace(EVEN, friction=replace(EVEN.friction, sigma=sigma))
    curl = of_effect("curl", "strength", strength=0.01)
    model = Model(ice=ice, terms=(curl,), ln_mu=0.1, ln_coupling=0.2)
    sigma = {("", "ln_mu"): 4e-4 / 0.009, ("curl", "strength"): 1e-3, ("slope", "x"): 9.0}
    common = {("curl", "strength"): (0.5,)}
    found = model.improved_ice(sigma, common=common)
    assert found.friction.mu == pytest.approx(0.009 * np.exp(0.1))
    assert found.friction.sigma == pytest.approx(5e-4 * np.exp(0.1))  # 3 and 4 at right angles
    assert found.stone.inertia == pytest.approx(ice.stone.inertia * np.exp(-0.2))
    (bends,) = found.effects
    assert (bends.name, bends.parameters["strength"]) == ("curl", 0.01)
    assert bends.sigma == {"strength": 1e-3}
    assert bends.common == {"strength": (0.5,)}
    bare = model.improved_ice({})
    assert bare.friction.sigma == pytest.approx(3e-4 * np.exp(0.1))
    assert not bare.effects[0].sigma
    assert not bare.effects[0].common


def test_an_ice_file_of_a_map_knows_where_stones_ran():
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, lane()), 8.0, np.inf)
    field = field.at(0.05 * np.ones(len(field)))
    model = Model(ice=EVEN, terms=(Term(card=CARD, map_field=field),), ln_mu=-0.1)
    errors = np.full(PAPER_SHEET.shape, 0.02)
    found = model.improved_ice({("", "ln_mu"): 9.0}, errors)
    mu = 0.009 * np.exp(field.ln_mu - 0.1)
    assert found.friction.mu == pytest.approx(mu)
    assert found.friction.sigma == pytest.approx(0.02 * mu)
    assert np.flatnonzero(found.friction.observed).tolist() == field.crossed.tolist()
    assert not found.effects


def test_terms_are_added_found_and_taken_out_by_their_labels():
    curl, slope = of_effect("curl"), of_effect("slope")
    model = Model(ice=EVEN, terms=(curl,)).with_terms(slope)
    assert [term.label for term in model.terms] == ["curl", "slope"]
    assert model.term("slope") is slope
    assert [term.label for term in model.without("curl").terms] == ["slope"]
    assert model.without("curl", "slope").terms == ()
    held = GatePlaces(places=np.zeros(2), amplitude=0.01, values=np.zeros(2), held=True)
    assert Model(ice=EVEN, systematic_error=held).fields == ()
    assert len(Model(ice=EVEN, systematic_error=held, terms=(curl,)).vector) == 3


def test_an_effect_of_an_ice_file_is_fitted_from_its_values_there():
    ice = Ice.uniform(0.009, effects=(effect("curl", strength=0.004, speed_exponent=0.7),))
    (term,) = base_model(ice, plain_session()).terms
    card = term.card
    assert (term.values["strength"], term.values["speed_exponent"]) == (0.004, 0.7)
    spreads = {p.name: p.spread for p in card.parameters if p.spread is not None}
    assert {name: b.sd for name, b in term.beliefs.items()} == spreads
    assert term.beliefs["speed_exponent"].mean == 0.7
    assert term.free[0] == "strength"
    assert set(term.free) >= set(spreads)
    assert len(set(term.free)) == len(term.free)
    remarked = Ice.uniform(0.009, effects=(effect("scale_error", factor=1.01),))
    assert base_model(remarked, plain_session()).terms == ()


@pytest.mark.parametrize(("drag", "mu"), [(0.09, 0.09 / 9.80665), (4.0, 0.1), (-0.5, 1e-3)])
def test_a_fit_begins_with_the_deceleration_of_the_throws_within_what_ice_can_be(drag, mu):
    t = plain_session(throws=3).times
    session = plain_session(throws=3)
    ways = np.where(session.owner % 2 == 0, 1.0, -1.0)
    y = ways * (-10.0 + 8.0 * t - drag * t**2 / 2)
    xy = np.column_stack([0 * t, y])
    if drag > 1.0:
        xy[:, 1] = ways * (-10.0 + 30.0 * t - drag * t**2 / 2)
    assert first_friction(replace(session, xy=xy)) == pytest.approx(mu)


def test_throws_seen_for_less_than_half_as_long_do_not_say_how_they_slow_down():
    def of(seconds):
        session = plain_session(throws=2, rows=9, spacing=1.0)
        times = session.times.copy()
        own = session.rows(1)
        times[own] *= seconds / 8.0
        t = times[own]
        xy = session.xy.copy()
        xy[own, 1] = 10.0 - 2.0 * t + 0.5 * 0.3 * t**2
        return first_friction(replace(session, times=times, xy=xy)) * 9.80665

    assert of(3.9) == pytest.approx(0.09)
    assert of(4.1) == pytest.approx((0.09 + 0.3) / 2)


def test_any_fit_has_the_same_places_of_fields():
    model: Any = Model(ice=SimpleNamespace())
    assert (model.ripple_slice, model.map_slice) == (slice(2, 2), slice(2, 2))
    assert model.fields == ()
    assert model.vector.tolist() == [0.0, 0.0]
    assert model.spread == 0.0
