"""Candidate effects, by their cards and by the columns of a session."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.physics import catalogue, register, unregister
from friction_estimation.discovery import (
    Term,
    candidates,
    effect_of,
    neutral_values,
    open_session,
    way_of,
)

from ..conftest import plain_session


def labels(session, terms=()):
    return {term.label for term in candidates(session, terms)}


@pytest.fixture
def tracks(make_session):
    return make_session(throws=9)


def test_a_full_session_asks_for_every_effect_but_patches_and_tables(tracks):
    assert {label.partition("[")[0] for label in labels(open_session(tracks))} == {
        *("air_drag", "curl", "pebble_wear", "slope", "speed_dependent_friction", "spin_drag"),
        *("stone_bias", "sweeping", "time_drift", "tracking_offset", "lens_distortion"),
    }


def test_what_a_session_lacks_is_not_asked_for(tracks):
    def asked(change):
        return labels(open_session([replace(track, **change(track)) for track in tracks]))

    assert "sweeping" not in asked(lambda track: {"swept": np.zeros(len(track))})
    unseen = asked(lambda track: {"theta": np.full(len(track), np.nan)})
    assert not {"curl", "spin_drag", "tracking_offset"} & unseen
    assert "time_drift" not in asked(lambda _: {"clock": 0.0})
    assert not any(label.startswith("stone_bias") for label in asked(lambda _: {"stone": 4}))


def test_what_scales_a_push_is_asked_for_only_where_something_pushes_so(tracks):
    session = open_session(tracks)
    card = catalogue()["curl"]
    curl = Term(card=card, values=neutral_values(card), free=("strength",))

    def sweeping(*terms):
        return next(t for t in candidates(session, terms) if t.name == "sweeping").free

    assert sweeping() == ("friction_factor",)
    assert sweeping(curl) == ("friction_factor", "curl_factor")


def test_each_stone_is_a_candidate_of_its_own(tracks):
    session = open_session(tracks)
    biases = [term for term in candidates(session) if term.name == "stone_bias"]
    assert [term.label for term in biases] == ["stone_bias[0]", "stone_bias[1]", "stone_bias[2]"]
    assert [term.stone for term in biases] == [0, 1, 2]
    assert all(term.between_throws for term in biases)
    assert effect_of("stone_bias[2]") == "stone_bias"


def test_the_curl_of_each_stone_is_asked_for_beside_its_friction_once_something_curls(tracks):
    session = open_session(tracks)
    curl = Term(card=catalogue()["curl"], values={"strength": 0.01}, free=("strength",))
    assert not any("curl_factor" in label for label in labels(session))
    asked = {t.label: t for t in candidates(session, (curl,)) if t.name == "stone_bias"}
    assert set(asked) == {
        *(f"stone_bias[{stone}]" for stone in (0, 1, 2)),
        *(f"stone_bias[{stone}, curl_factor]" for stone in (0, 1, 2)),
    }
    own = asked["stone_bias[1, curl_factor]"]
    assert own.free == ("curl_factor",)
    assert own.values == {"stone": 1.0, "factor": 1.0, "curl_factor": 1.0}
    assert not own.between_throws
    assert effect_of(own.label) == "stone_bias[curl_factor]"
    assert effect_of(effect_of(own.label)) == "stone_bias[curl_factor]"
    assert way_of(own.label) is own.variant
    assert way_of("stone_bias[1]") is own.card
    assert way_of("unheard of") is None
    left = labels(session, (curl, own))
    assert own.label not in left
    assert {"stone_bias[1]", "stone_bias[0, curl_factor]"} <= left
    # A stone whose friction and curl are both fitted by one term is asked for neither.
    both = own.with_values().freed("factor")
    assert {label for label in labels(session, (curl, both)) if "stone_bias[1" in label} == set()
    unseen = [replace(track, theta=np.full(len(track), np.nan)) for track in tracks]
    assert not any("curl_factor" in label for label in labels(open_session(unseen), (curl,)))


def test_a_variant_has_a_name_a_scope_and_evidence_of_its_own(tracks):
    session = open_session(tracks)
    both = {t.label: t for t in candidates(session) if t.name == "pebble_wear"}
    assert both["pebble_wear"].between_throws
    along = both["pebble_wear[along_path]"]
    assert not along.between_throws
    assert along.wears_map
    assert not both["pebble_wear[under_contacts]"].wears_map
    assert effect_of(along.label) == along.label
    assert way_of(along.label) is along.variant
    assert along.variant is not None
    assert "where stones have run" in along.variant.readable


def test_an_effect_of_the_measurement_that_a_user_registers_is_asked_for(tracks):
    card = replace(catalogue()["tracking_offset"], name="reflection")
    register(card)
    try:
        assert "reflection" in labels(open_session(tracks))
    finally:
        unregister("reflection")


def test_a_side_that_is_freed_stays_near_its_place_and_is_not_called_believed():
    card = catalogue()["friction_patch"]
    sides = {"x_min": -1.0, "x_max": 0.5, "y_min": 2.0, "y_max": 6.0}
    term = Term(card=card, values=neutral_values(card, **sides), free=("factor",))
    freed = term.freed("x_min", "edge")
    assert freed.free == ("factor", "x_min", "edge")
    assert set(freed.beliefs) == {"x_min"}
    assert freed.beliefs["x_min"].mean == -1.0
    # No stone ran there, so that its error is the one that was assumed.
    assert freed.effect({"x_min": freed.beliefs["x_min"].sd}).believed == ()


def test_a_strength_as_large_as_no_ice_has_it_is_at_a_limit():
    card = catalogue()["slope"]
    term = Term(card=card, values={"x": 1e-4, "y": -0.005}, free=("x", "y"))
    assert term.at_a_limit
    assert not term.with_values(y=-0.004).at_a_limit
    assert not replace(term, free=("x",)).at_a_limit
    drag = Term(card=catalogue()["air_drag"], values={"coefficient": 0.0}, free=("coefficient",))
    assert not drag.at_a_limit
    assert drag.with_values(coefficient=0.02).at_a_limit


@pytest.mark.parametrize(
    ("clocks", "shown"),
    [
        ([0.0, 20.0, 40.0, 61.0, 61.0], False),  # four times
        ([0.0, 20.0, 40.0, 55.0, 61.0], True),
        ([0.0, 20.0, 40.0, 50.0, 60.0], False),  # within a minute
    ],
)
def test_a_drift_shows_at_five_times_over_more_than_a_minute(clocks, shown):
    session = plain_session(throws=5, clocks=np.array(clocks))
    assert ("time_drift" in labels(session)) == shown


def test_runs_over_the_same_ice_need_a_later_throw_than_the_first():
    from friction_estimation.discovery.data.wear_tracks import WearTracks

    y = np.linspace(-9.0, 9.0, 40)
    run = np.column_stack([0 * y, y])
    session = plain_session(throws=3, wear_tracks=WearTracks.of([(1, run)]))
    along = "pebble_wear[along_path]"
    assert along in labels(session)
    assert along not in labels(session.only([0, 1]))
    assert along not in labels(replace(session, wear_tracks=WearTracks()))


def test_a_term_that_adapts_less_than_its_prior_is_believed():
    card = catalogue()["curl"]
    term = Term(card=card, values=neutral_values(card), free=("strength",))
    assert term.freed("strength", "spin_exponent").free == ("strength", "spin_exponent")
    assert term.with_values(strength=0.5).values["strength"] == 0.5
    assert term.values["strength"] != 0.5
    plain = term.effect()
    assert (plain.sigma, plain.believed, plain.common) == ({}, (), {})
    assert plain.parameters == dict(term.values)


def test_values_without_a_neutral_or_usual_one_are_in_the_middle():
    card = catalogue()["friction_patch"]
    values = neutral_values(card, factor=1.3)
    assert values["factor"] == 1.3
    for p in card.parameters:
        if p.neutral is None and p.default is None:
            assert values[p.name] == (p.low + p.high) / 2
