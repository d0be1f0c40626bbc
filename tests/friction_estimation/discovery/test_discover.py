from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from friction_estimation import discover
from friction_estimation.discovery import document

from .conftest import effect

HIDDEN = [
    effect("curl", strength=0.005, speed_exponent=0.2),
    effect("speed_dependent_friction", exponent=0.2),
    effect("tracking_offset", forward=0.012, left=-0.01),
    effect("time_drift", rate=4e-5),
]
SIZED_WITHIN = 0.15
"""Error of a parameter over its true value up to which it counts as sized."""


def named(found):
    return sorted({e.label.partition("[")[0] for e in found.effects})


@pytest.mark.parametrize("hidden", HIDDEN, ids=lambda hidden: hidden.name)
def test_one_hidden_effect_is_named_and_sized(make_session, hidden, unchanged):
    found = discover(make_session([hidden], fps=5))
    assert named(found) == [hidden.name]
    assert not found.unknown
    term = found.final.model.term(found.effects[0].label)
    for name, value in hidden.parameters.items():
        assert abs(term.values[name] / value - 1) < SIZED_WITHIN
    gaps = found.gaps
    assert gaps["after"].rest_error < 0.6 * gaps["before"].rest_error
    unchanged.document(document(found))


def test_nothing_missing_nothing_named(make_session, unchanged):
    found = discover(make_session(seed=7))
    assert named(found) == []
    assert not found.unknown
    report = document(found)
    assert report["effects"] == []
    cm = r"[\d.]+"
    stop = f"fresh throws (now )?stop {cm} cm from the forecast, "
    off = f"(and a perfect model would be off by|not) {cm}\\."
    assert re.fullmatch(f"Nothing is missing: {stop}{off}", report["verdict"])
    unchanged.document(document(found))


def test_two_effects_are_both_named(make_session, unchanged):
    hidden = [effect("slope", x=1.5e-4, y=-1e-4), effect("curl", strength=0.004)]
    shares: list[float] = []
    found = discover(
        make_session(hidden, throws=8),
        progress=lambda _, done, total=1.0: shares.append(done / total),
    )
    assert named(found) == ["curl", "slope"]
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert 0.9 < shares[-1] <= 1.0
    unchanged.document(document(found))


def test_few_throws_name_nothing_and_say_so(make_session, unchanged):
    found = discover(make_session([effect("curl", strength=0.008)], throws=6))
    report = document(found)
    assert report["effects"] == []
    assert "8 or more" in report["verdict"]
    unchanged.document(document(found))


def test_outside_the_catalogue_is_unknown_and_not_a_name(make_session, without_effects, unchanged):
    tracks = make_session([effect("curl", strength=0.004)], throws=8, fps=5)
    with without_effects("curl"):
        found = discover(tracks)
    assert named(found) == []
    assert found.unknown
    assert "spin" in [d.variable for d in found.dependences]
    assert found.events == []  # no throw is odd where one unknown explains them all
    verdict = document(found)["verdict"]
    assert verdict.startswith("The model lacks something unknown that follows the ")
    assert verdict.count(".") <= 3  # one sentence, with two numbers at most
    assert found.improved_ice().effect("unknown") is not None
    unchanged.document(document(found))


def test_what_happened_once_is_an_event_and_spoils_nothing(make_session, unchanged):
    tracks = make_session([effect("curl", strength=0.005)], throws=9, fps=5)
    picked = tracks[4]
    kick = np.maximum(picked.t - 6.0, 0.0) * 0.02
    tracks[4] = replace(picked, xy=picked.xy + np.column_stack([kick, 0 * kick]))
    found = discover(tracks)
    assert found.events == [4]
    assert named(found) == ["curl"]
    verdict = document(found)["verdict"]
    assert verdict.startswith("The model lacks curl, and a single event disturbed throw 4: fresh ")
    unchanged.document(document(found))


def test_discovery_on_its_own_output_finds_nothing_more(make_session, unchanged):
    tracks = make_session([effect("slope", x=2e-4, y=1e-4)], throws=8)
    ice = discover(tracks).improved_ice()
    again = discover(tracks, ice)
    assert named(again) == []
    assert not again.unknown
    unchanged.document(document(again))


def test_throws_without_heading(make_session, unchanged):
    tracks = [
        replace(track, theta=np.full(len(track), np.nan))
        for track in make_session([effect("slope", x=2e-4, y=1e-4)], throws=8)
    ]
    found = discover(tracks)
    assert named(found) == ["slope"]
    assert any("No heading" in remark for remark in document(found)["remarks"])
    unchanged.document(document(found))
