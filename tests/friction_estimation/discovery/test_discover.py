from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import friction_estimation.discovery.discover as discovery
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
def test_one_hidden_effect_is_named_and_sized(make_session, hidden):
    found = discover(make_session([hidden]))
    assert named(found) == [hidden.name]
    assert not found.unknown
    term = found.final.model.term(found.effects[0].label)
    for name, value in hidden.parameters.items():
        assert abs(term.values[name] / value - 1) < SIZED_WITHIN
    gaps = found.gaps
    assert gaps["after"].rest_error < 0.6 * gaps["before"].rest_error


def test_nothing_missing_nothing_named(make_session):
    found = discover(make_session(seed=7))
    assert named(found) == []
    assert not found.unknown
    assert document(found)["effects"] == []


def test_two_effects_are_both_named(make_session):
    hidden = [effect("slope", x=1.5e-4, y=-1e-4), effect("curl", strength=0.004)]
    assert named(discover(make_session(hidden))) == ["curl", "slope"]


def test_few_throws_name_nothing_and_say_so(make_session):
    found = discover(make_session([effect("curl", strength=0.008)], throws=6))
    report = document(found)
    assert report["effects"] == []
    assert "fewer than 8" in report["verdict"]


def test_outside_the_catalogue_is_unknown_and_not_a_name(make_session, without_effects):
    tracks = make_session([effect("curl", strength=0.004)], throws=16)
    with without_effects("curl"):
        found = discover(tracks)
    assert named(found) == []
    assert found.unknown
    assert "spin" in [d.variable for d in found.dependences]
    # The ice file says so, or carries a table of what the unknown does.
    ice = found.improved_ice()
    assert (ice.effect("unknown") is None) == (found.residual_term is not None)
    assert (ice.effect("residual") is None) == (found.residual_term is None)


@pytest.mark.parametrize("white", [True, False])
def test_no_throw_is_odd_where_an_unknown_explains_them_all(monkeypatch, white):
    """Odd throws are looked for around effects alone, and a search without them takes as long."""
    found = SimpleNamespace(dependences=["x"], final=None, selection=SimpleNamespace(best=None))
    asked: list[str] = []
    monkeypatch.setattr(discovery, "renew_map", lambda fitted: fitted)
    monkeypatch.setattr(discovery, "_search", lambda *_: found)
    monkeypatch.setattr(discovery, "misfit_of", lambda _: SimpleNamespace(white=white))
    monkeypatch.setattr(discovery, "exceptional_throws", lambda *_: asked.append("odd") or [])
    everything = SimpleNamespace(model=SimpleNamespace(terms=()), session=range(9))
    assert discovery.search_session(everything, None, None) is found
    assert bool(asked) is not white


def test_what_happened_once_is_an_event_and_spoils_nothing(make_session):
    tracks = make_session([effect("curl", strength=0.005)], throws=9)
    picked = tracks[4]
    kick = np.maximum(picked.t - 6.0, 0.0) * 0.05
    tracks[4] = replace(picked, xy=picked.xy + np.column_stack([kick, 0 * kick]))
    found = discover(tracks)
    assert found.events == [4]
    assert named(found) == ["curl"]


def test_discovery_on_its_own_output_finds_nothing_more(make_session):
    tracks = make_session([effect("slope", x=2e-4, y=1e-4)])
    ice = discover(tracks).improved_ice()
    again = discover(tracks, ice)
    assert named(again) == []
    assert not again.unknown


def test_throws_without_heading(make_session):
    tracks = [
        replace(track, theta=np.full(len(track), np.nan))
        for track in make_session([effect("slope", x=2e-4, y=1e-4)])
    ]
    found = discover(tracks)
    assert named(found) == ["slope"]
    assert "No heading" in document(found)["verdict"]
