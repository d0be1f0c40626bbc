"""Matching of stones, compared with the true factors."""

from __future__ import annotations

import numpy as np
import pytest
import simulated_club as club

from agents.coaching import Place, match_stones, rests
from curling_env.errors import InputError
from friction_estimation.tracks import ThrowNote

STONES = {3: (1.02, 1.0), 5: (1.0, 1.25), 8: (0.98, 1.0), 9: (1.0, 0.98)}


@pytest.fixture(scope="module")
def matched():
    """Four stones thrown eight times each, two of which differ by 2 % from one step to the next."""
    rng = np.random.default_rng(11)
    evening = club.evening(rng, throws=32, stones=STONES, own=0.004, hairs=0.05)
    ice = evening.ice.as_ice(rng, sigma=0.003)
    return evening, ice, match_stones(evening.tracks, ice, evening.notes)


def test_stones_two_per_cent_apart_are_ordered_rightly(matched):
    _, _, found = matched
    order = [one.number for one in found.stones]
    assert order[0] == 8
    assert order[-1] == 3
    assert [one.throws for one in found.stones] == [8] * 4


def test_intervals_hold_the_true_factors(matched):
    _, _, found = matched
    friction = {
        k: f / np.exp(np.mean(np.log([f for f, _ in STONES.values()])))
        for k, (f, _) in STONES.items()
    }
    curl = {
        k: c / np.exp(np.mean(np.log([c for _, c in STONES.values()])))
        for k, (_, c) in STONES.items()
    }
    for one in found.stones:
        assert one.friction.low < friction[one.number] < one.friction.high
        assert one.curl.low < curl[one.number] < one.curl.high
        assert one.friction.high - one.friction.low < 0.03
    assert np.prod([one.friction.value for one in found.stones]) == pytest.approx(1.0, abs=1e-6)


def test_carry_is_the_extra_distance_of_a_draw(matched):
    _, ice, found = matched
    keen = found.stones[0]
    assert keen.carry.low < keen.carry.value < keen.carry.high
    throw = np.array([[2.25, 0.0, 1.3, 0.0]])
    plain = rests(ice, throw, Place(stone=77))
    with_stone = rests(found.on(ice), throw, Place(stone=keen.number))
    assert (with_stone - plain)[0, 1] == pytest.approx(keen.carry.value, rel=0.25)


def test_the_stone_that_curls_differs_and_is_paired_with_none_before_the_alike(matched):
    _, _, found = matched
    between = {frozenset((p.first, p.second)): p for p in found.all_pairs}
    assert between[frozenset("59")].verdict == "differ"  # by their curl
    assert between[frozenset("59")].curl.low > 1.05 or between[frozenset("59")].curl.high < 0.95
    used = [name for pair in found.pairs for name in (pair.first, pair.second)]
    assert sorted(used) == ["3", "5", "8", "9"]
    best = min(
        sum(between[frozenset(p)].apart ** 2 for p in pairs)
        for pairs in (("35", "89"), ("38", "59"), ("39", "58"))
    )
    assert sum(pair.apart**2 for pair in found.pairs) == pytest.approx(best)


def test_undecided_stones_report_the_number_of_throws_needed():
    rng = np.random.default_rng(3)
    stones = {0: (1.0, 1.0), 1: (1.006, 1.03), 2: (0.998, 1.0)}
    evening = club.evening(rng, throws=9, stones=stones, own=0.01)
    found = match_stones(evening.tracks, evening.ice.as_ice(), evening.notes)
    assert found.undecided
    for pair in found.undecided:
        low, high = pair.friction.low, pair.friction.high
        assert low < 1 < high or pair.curl.low < 1 < pair.curl.high
        assert pair.more >= 1
    assert set(found.more_throws) == {n for p in found.undecided for n in (p.first, p.second)}
    assert not any(pair.verdict == "differ" for pair in found.undecided)


def test_names_are_those_that_were_noted(matched):
    evening, ice, _ = matched
    notes = {
        k: ThrowNote(stone={"3": "red 1"}.get(n.stone, n.stone)) for k, n in evening.notes.items()
    }
    found = match_stones(evening.tracks[:8], ice, notes)
    assert "red 1" in {one.stone for one in found.stones}


def test_one_stone_is_no_set(matched):
    evening, ice, _ = matched
    with pytest.raises(InputError, match="found 1: enter the stone of each throw in throws.csv"):
        match_stones(evening.tracks[:1], ice, evening.notes)
