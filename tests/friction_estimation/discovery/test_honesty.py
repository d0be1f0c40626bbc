"""What a verdict owes its reader beside a name: doubts, limits, and what would settle them."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation import discover
from friction_estimation.discovery import (
    Dependence,
    base_model,
    document,
    fit_with_noise,
    forecast,
    open_session,
    try_table,
)

from .conftest import effect

CURL = effect("curl", strength=0.006)


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
    assert doubt.strength > 12.0  # of −2 ln likelihood: that throw would rule it out


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
    make_session,
):
    hidden = effect("speed_dependent_friction", exponent=0.3)
    session = open_session(make_session([hidden], throws=16))
    fitted = fit_with_noise(base_model(None, session), session)
    unseen = fitted.session.only([2, 5, 9, 14])
    training = fitted.session.only(np.setdiff1d(np.arange(16), [2, 5, 9, 14]))
    named = fit_with_noise(fitted.model, training, fitted.noise)
    dependences = [
        Dependence(variable=variable, share=0.5, p=0.001, push="along")
        for variable in ("clock", "speed")
    ]
    # What the unknown does not follow forecasts nothing better and is passed over.
    assert try_table(named, dependences[:1], unseen) is None
    kept = try_table(named, dependences, unseen)
    assert kept is not None
    assert kept[0].model.term("residual").values["variable"] == 0.0  # the speed
    plain = forecast(named.model, unseen, named.noise)
    assert kept[1].rest_error < 0.5 * plain.rest_error
