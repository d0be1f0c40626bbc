"""The ice as its page tells it."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from agents.app import EarlierIce, change_of_maps, ice_document
from agents.coaching.draw_weight import centre_of
from curling_env.ice import load_ice

STANDARD = load_ice("standard")


def ice(factor=1.0, sigma=2e-5, where=None):
    friction = STANDARD.friction
    mu = friction.mu * factor
    if where is not None:
        mu[where] *= 1.04
    return replace(STANDARD, friction=replace(friction, mu=mu, sigma=np.full_like(mu, sigma)))


def friday_of(ice):
    return EarlierIce(id=7, name="Friday", ice=ice, centre=centre_of(ice))


def test_a_keener_ice_takes_longer_and_is_reported():
    result = ice_document(ice(0.95), earlier=[friday_of(ice())])
    (friday,) = result["earlier"]
    assert friday["words"].startswith("keener today: 0.")
    change, further = re.search(
        r"today: ([\d.]+) s longer .* ([\d.]+) m further", friday["words"]
    ).groups()
    assert float(change) > 0.2
    # A tenth of a second of a draw is some 40 cm.
    assert 2.5 < float(further) / float(change) < 5.0
    back = ice_document(ice(), earlier=[friday_of(ice(0.95))])
    assert back["earlier"][0]["words"].startswith("heavier today")
    same = ice_document(ice(), earlier=[friday_of(ice())])
    assert same["earlier"][0]["words"] == "of the same weight"
    json.dumps([result["cells"], result["earlier"]], allow_nan=False)


def test_ice_that_has_changed_at_one_end_is_compared_end_by_end():
    # Only stones that are thrown to the away end run beyond its hog line.
    result = ice_document(ice(where=np.s_[67:, :]), earlier=[friday_of(ice())])
    (words,) = (one["words"] for one in result["earlier"])
    away, home = words.split("; ")[:2]
    assert re.match(r"to the away end heavier today: 0\.\d\d s shorter .* \d\d cm shorter", away)
    assert home == "to the home end of the same weight"


def test_numbers_have_errors_where_the_ice_has_them():
    known = ice_document(STANDARD)["lanes"][0]["draws"]
    assert all(draw.seconds_sigma is None for draw in known)
    unsure = ice_document(ice(sigma=1e-4))["lanes"]
    assert [end["to"] for end in unsure] == ["away", "home"]
    assert all(draw.seconds_sigma > 0 for end in unsure for draw in end["draws"])


def test_the_map_changes_where_it_changed():
    part = np.s_[:30, :4]
    change = change_of_maps(ice(where=part), ice())
    assert change is not None
    shown = np.array(change["relative"], dtype=float)
    # The sheet's own level rises a little with the part that changed.
    assert shown[part] == pytest.approx(0.034, abs=0.003)
    assert not shown[40:].any()
    hidden = change_of_maps(ice(where=part, sigma=4e-4), ice(sigma=4e-4))
    assert hidden is not None
    assert not np.array(hidden["relative"], dtype=float).any()
    assert change_of_maps(ice(), load_ice("fcv1")) is None


def test_keen_and_heavy_are_in_seconds():
    result = ice_document(ice(where=np.s_[:30, :4]))
    assert "%" not in result["sentence"]
    (slow,) = re.findall(r"[Hh]eavy at [^(]+\(([\d.]+) s\)", result["sentence"])
    # 4 % more friction, less the sheet's own level: half of that of some 14 s.
    assert 0.1 < float(slow) < 0.3
