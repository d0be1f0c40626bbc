"""The map in words, on maps that were made for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import Ice
from friction_estimation.reports import in_a_sentence, relative_map, zones

EVEN = Ice.uniform(0.009)


def ice(change=1.0, where=None, sigma=0.0, observed=None) -> Ice:
    mu = EVEN.friction.mu.copy()
    if where is not None:
        mu[where] *= change
    seen = np.ones_like(mu, dtype=bool) if observed is None else observed
    friction = replace(EVEN.friction, mu=mu, sigma=np.full_like(mu, sigma), observed=seen)
    return replace(EVEN, friction=friction)


def away_left():
    sheet = EVEN.sheet
    return np.ix_(sheet.y_centres > 10.9, sheet.x_centres < -0.7)


def test_even_ice_has_no_places():
    parts = zones(ice())
    assert len(parts) == 12
    assert not any(zone.stands_out for zone in parts)
    assert in_a_sentence(ice()) == "No part of the sheet stands out."


def test_a_heavy_corner_is_named_with_its_size():
    heavy = {zone.name: zone for zone in zones(ice(1.05, away_left()))}
    corner = heavy["the away end, left"]
    assert corner.stands_out
    assert corner.words.startswith("heavy")
    assert corner.relative == pytest.approx(0.045, abs=0.006)  # the sheet's mean rises a little
    assert [zone.name for zone in heavy.values() if zone.stands_out] == ["the away end, left"]
    assert in_a_sentence(ice(1.05, away_left())).startswith("Heavy at the away end, left (+4.")
    assert "Keen at the away end, left (−" in in_a_sentence(ice(0.95, away_left()))


def test_uncertain_differences_are_not_reported():
    unsure = {z.name: z for z in zones(ice(1.05, away_left(), sigma=0.0003))}
    assert not unsure["the away end, left"].stands_out


def test_cells_that_no_stone_crossed_say_nothing():
    seen = np.ones_like(EVEN.friction.mu, dtype=bool)
    seen[away_left()] = False
    blank = ice(3.0, away_left(), observed=seen)
    parts = {zone.name: zone for zone in zones(blank)}
    assert parts["the away end, left"].relative is None
    assert parts["the away end, left"].words == "no throw has passed there"
    assert np.isnan(relative_map(blank)[away_left()]).all()
    assert np.nanmax(np.abs(relative_map(blank))) < 1e-9
    assert in_a_sentence(blank).endswith("No throw has passed 1 of its 12 parts.")
    nothing = ice(observed=np.zeros_like(seen))
    assert in_a_sentence(nothing) == "Nothing is known of the places of this sheet."
