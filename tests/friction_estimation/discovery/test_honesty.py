"""What a verdict owes its reader beside a name: doubts, limits, and what would settle them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from curling_env.physics import effects
from curling_env.physics.compiled import effect_kernel
from curling_env.physics.effects import EffectCard, Parameter, register
from curling_env.physics.effects.motion import PUSH_X, X
from friction_estimation.discovery.data.session import open_session
from friction_estimation.discovery.discover import discover
from friction_estimation.discovery.evidence.hold_out import forecast
from friction_estimation.discovery.evidence.residual_term import NAME, try_table
from friction_estimation.discovery.evidence.unknown import Follows
from friction_estimation.discovery.model import candidates
from friction_estimation.discovery.model.baseline import base_model
from friction_estimation.discovery.report import document, improved_ice
from friction_estimation.discovery.search.selection import RULED_OUT, fit_with_noise

from .conftest import effect

CURL = effect("curl", strength=0.006)


@effect_kernel
def _trough(motion: Any, theta: Any, push: Any) -> None:
    push[PUSH_X] -= theta[0] * motion[X]


@pytest.fixture
def trough():
    """An effect that a user registers: ice that is lower in the middle."""
    rate = Parameter(
        name="rate", unit="1/s²", meaning="pull to the middle", low=-0.1, high=0.1, neutral=0.0
    )
    card = register(
        EffectCard(
            name="trough",
            title="Trough",
            formula="dvx/dt = -rate·x",
            parameters=(rate,),
            source="a user",
            validity="a sheet flooded from its sides",
            evidence="stones drift to the centre line",
            acts="motion",
            kernel=_trough,
            dissipative=False,
        )
    )
    yield card
    effects._cards().pop("trough")  # pyright: ignore[reportPrivateUsage]


def test_an_effect_that_a_user_registers_is_a_candidate_at_once(make_session, trough):
    tracks = make_session([effect("trough", rate=0.002)])
    found = discover(tracks)
    (named,) = document(found)["effects"]
    assert named["name"] == "trough"
    assert abs(named["parameters"]["rate"]["value"] / 0.002 - 1) < 0.15
    assert improved_ice(found).effect("trough") is not None


def test_a_set_comes_with_the_throw_that_would_settle_it(make_session):
    tracks = [
        track
        for track in make_session([effect("curl", strength=1e-4)], throws=36, seed=4)
        if track.throw % 2 == 0 and track.theta[-1] > track.theta[0]
    ]
    assert len(tracks) >= 8
    found = discover(tracks)
    (named,) = document(found)["effects"]
    either = {"curl", "slope"}
    assert {named["name"], *named["alternatives"]} >= either
    (other,) = either - {named["name"]}
    throw = named["evidence"]["separating_throws"][other]
    # Played were stones towards the away end that turned counter-clockwise.
    assert "towards the home end" in throw or " clockwise" in throw
    (doubt,) = [a for a in found.alternatives[named["name"]] if a.name == other]
    assert doubt.strength > RULED_OUT


@pytest.mark.parametrize(
    ("hidden", "throws"), [([], 8), ([], 5), ([CURL], 8)], ids=["nothing", "too few", "named"]
)
def test_every_verdict_says_how_small_an_effect_would_have_shown(make_session, hidden, throws):
    report = document(discover(make_session(hidden, throws=throws)))
    smallest = report["smallest_detectable"]
    named = {e["name"] for e in report["effects"]}
    assert set(smallest) | named >= {"curl", "slope", "air_drag", "pebble_wear", "time_drift"}
    assert all(0 < value < np.inf for sizes in smallest.values() for value in sizes.values())


def test_a_table_for_the_unknown_stays_only_if_throws_held_out_are_forecast_better(
    make_session, monkeypatch
):
    known = candidates.catalogue()
    for name in ("speed_dependent_friction", "air_drag"):
        known.pop(name)
    monkeypatch.setattr(candidates, "catalogue", lambda: known)
    hidden = effect("speed_dependent_friction", exponent=0.3)
    session = open_session(make_session([hidden], throws=16))
    fitted = fit_with_noise(base_model(None, session), session)
    unseen = fitted.session.only([2, 5, 9, 14])
    training = fitted.session.only(np.setdiff1d(np.arange(16), [2, 5, 9, 14]))
    named = fit_with_noise(fitted.model, training, fitted.noise)
    follows = [
        Follows(variable=variable, share=0.5, p=0.001, push="along")
        for variable in ("clock", "speed")
    ]
    # What the unknown does not follow forecasts nothing better and is passed over.
    assert try_table(named, follows[:1], unseen) is None
    kept = try_table(named, follows, unseen)
    assert kept is not None
    assert kept[0].model.term(NAME).values["variable"] == 0.0  # the speed
    plain = forecast(named.model, unseen, named.noise)
    assert kept[1].rest_error < 0.5 * plain.rest_error
