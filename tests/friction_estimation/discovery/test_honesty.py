"""Verdicts list alternatives and limits, and the throws that would decide."""

from __future__ import annotations

import re

import numpy as np
import pytest

from friction_estimation import discover
from friction_estimation.discovery import document
from friction_estimation.discovery.verdict import readable

from .conftest import effect

CURL = effect("curl", strength=0.006)


def test_a_set_comes_with_the_throw_that_would_settle_it(make_session):
    tracks = [
        track
        for track in make_session([effect("curl", strength=1e-4)], throws=36, seed=4, fps=8)
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
    assert "at the home end" in throw or "in-turn" in throw
    assert re.match(r"\w[\w ]* weight \(\d+\.\d s hog to hog\), ", throw)
    report = document(found)
    assert f"{readable(named['name'])} or else {readable(other)}: fresh throws" in report["verdict"]
    assert throw in report["doubts"][0]
    (rival,) = [a for a in found.alternatives[named["name"]] if a.name == other]
    assert rival.strength > 12.0  # of −2 ln likelihood: that throw would rule it out


@pytest.mark.parametrize(
    ("hidden", "throws"), [([], 8), ([], 5), ([CURL], 8)], ids=["nothing", "too few", "named"]
)
def test_every_verdict_says_how_small_an_effect_would_have_shown(make_session, hidden, throws):
    report = document(discover(make_session(hidden, throws=throws, fps=8)))
    smallest = report["smallest_detectable"]
    named = {e["name"] for e in report["effects"]}
    assert set(smallest) | named >= {"curl", "slope", "air_drag", "pebble_wear", "time_drift"}
    assert all(0 < value < np.inf for sizes in smallest.values() for value in sizes.values())
