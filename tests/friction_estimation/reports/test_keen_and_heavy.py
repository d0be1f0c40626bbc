"""The map in words, on maps that were made for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.sheet import HOG_LINE_Y
from friction_estimation.reports import in_a_sentence, relative_map, zones
from friction_estimation.reports.keen_and_heavy import Zone

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


@pytest.mark.parametrize(
    ("relative", "sigma", "words"),
    [
        (0.0099, 0.0, "like the rest of the sheet"),
        (0.0101, 0.0, "heavy, 1.0 % more friction than the sheet"),
        (-0.0234, 0.0, "keen, 2.3 % less friction than the sheet"),
        (-0.0234, 0.0118, "like the rest of the sheet"),  # less than two standard errors
        (-0.0234, 0.0116, "keen, 2.3 % less friction than the sheet"),
        (None, 0.0, "no throw has passed there"),
    ],
)
def test_a_part_stands_out_by_a_per_cent_and_by_two_standard_errors(relative, sigma, words):
    zone = Zone(name="", x=(0.0, 1.0), y=(0.0, 1.0), relative=relative, sigma=sigma, seen=1.0)
    assert zone.words == words
    assert zone.stands_out == (", " in words)


def test_parts_cover_the_sheet_between_its_lines():
    """From the home end to the away end, each from left to right."""
    sheet, parts = EVEN.sheet, zones(ice(sigma=0.00018))
    assert [zone.name for zone in parts[:4]] == [
        *("the home end, left", "the home end, in the middle", "the home end, right"),
        "the home half, left",
    ]
    assert parts[0].y == (-sheet.length / 2, -HOG_LINE_Y)
    assert parts[3].y == (-HOG_LINE_Y, 0.0)
    assert parts[-1].y == (HOG_LINE_Y, sheet.length / 2)
    assert parts[-1].x == (0.61, sheet.width / 2)  # beside the four-foot ring
    assert parts[-2].x == (-0.61, 0.61)
    assert all(zone.seen == 1.0 for zone in parts)
    assert all(zone.sigma == pytest.approx(0.02) for zone in parts)


def test_a_part_is_known_from_a_fifth_of_its_cells():
    y, x = np.meshgrid(EVEN.sheet.y_centres, EVEN.sheet.x_centres, indexing="ij")
    inside = np.flatnonzero(((y >= HOG_LINE_Y) & (x >= 0.61)).ravel())
    for share, known in ((0.19, False), (0.21, True)):
        seen = np.ones(y.size, dtype=bool)
        seen[inside[int(share * len(inside)) :]] = False
        last = zones(ice(observed=seen.reshape(y.shape)))[-1]
        assert (last.relative is not None) == known
        assert last.seen == pytest.approx(share, abs=0.02)


def test_the_two_keenest_and_the_two_heaviest_parts_are_named():
    y, x = np.meshgrid(EVEN.sheet.y_centres, EVEN.sheet.x_centres, indexing="ij")
    changes = {
        (0, 0): -0.04, (0, 2): -0.08, (1, 0): -0.06, (2, 0): 0.05, (2, 2): 0.09, (3, 1): 0.07
    }  # fmt: skip
    mu = EVEN.friction.mu.copy()
    rows = np.digitize(y, [-HOG_LINE_Y, 0.0, HOG_LINE_Y])
    columns = np.digitize(x, [-0.61, 0.61])
    for (row, column), change in changes.items():
        mu[(rows == row) & (columns == column)] *= 1.0 + change
    seen = np.ones_like(mu, dtype=bool)
    friction = replace(EVEN.friction, mu=mu, sigma=np.zeros_like(mu), observed=seen)
    words = in_a_sentence(replace(EVEN, friction=friction))
    keen, heavy = words.split("; heavy at ")
    assert keen.startswith("Keen at the home end, right (−8.")
    assert " and at the home half, left (−6." in keen
    assert heavy.startswith("the away half, right (+8.")
    assert " and at the away end, in the middle (+6." in heavy
    assert words.endswith(").")
    assert words.count(" and at ") == 2


def test_the_difference_of_a_named_part_is_in_per_cent_of_the_mean_cell():
    """The corner is five per cent heavier than all else, but the mean is a little higher."""
    corner = away_left()
    share = EVEN.friction.mu[corner].size / EVEN.friction.mu.size
    y, x = np.meshgrid(EVEN.sheet.y_centres, EVEN.sheet.x_centres, indexing="ij")
    part = (y >= HOG_LINE_Y) & (x < -0.61)
    changed = np.zeros(part.shape, dtype=bool)
    changed[corner] = True
    relative = (1 + 0.05 * changed[part].mean()) / (1 + 0.05 * share) - 1
    words = f"Heavy at the away end, left (+{100 * relative:.1f} %)."
    assert in_a_sentence(ice(1.05, corner)) == words
    relative = (1 - 0.05 * changed[part].mean()) / (1 - 0.05 * share) - 1
    words = f"Keen at the away end, left (−{-100 * relative:.1f} %)."
    assert in_a_sentence(ice(0.95, corner)) == words
