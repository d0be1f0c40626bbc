"""Grades of shots whose outcomes are laid out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing import SHOT_TYPES, grade, shot_type
from agents.playing.ends.grades import HIT_TYPES
from agents.playing.search.shots import KINDS

OWN, THEIRS, SHOOTER = 0, 8, 3


def position(**places):
    found = np.full((16, 2), np.nan)
    for slot, place in ((OWN, "own"), (THEIRS, "theirs"), (9, "other"), (SHOOTER, "shooter")):
        if place in places:
            found[slot] = places[place]
    return found


@pytest.mark.parametrize(
    ("off", "points"), [(0.0, 4), (0.44, 4), (0.46, 3), (1.2, 2), (1.9, 1), (2.1, 0)]
)
def test_a_draw_is_graded_by_its_distance_from_the_call(off, points):
    called, made = position(shooter=(0.0, 0.5)), position(shooter=(0.0, 0.5 - off))
    assert grade("draw", position(), called, made, SHOOTER) == points
    assert grade("come-around", position(), called, made, SHOOTER) == points
    assert grade("cover", position(), called, made, SHOOTER) == points


def test_a_stone_before_an_empty_house_may_lie_farther_from_the_call_than_a_guard_of_a_stone():
    called, made = position(shooter=(0.0, -2.6)), position(shooter=(0.3, -3.1))
    assert grade("guard", position(), called, made, SHOOTER) == 4
    assert grade("cover", position(), called, made, SHOOTER) == 3


def test_a_draw_that_leaves_play_is_a_miss_and_a_freeze_is_graded_more_strictly():
    called = position(shooter=(0.0, 0.0))
    assert grade("guard", position(), called, position(), SHOOTER) == 0
    near = position(shooter=(0.0, -0.4))
    assert grade("freeze", position(), called, near, SHOOTER) == 3
    assert grade("draw", position(), called, near, SHOOTER) == 4


def test_a_tap_is_graded_by_the_stone_that_it_moves_too():
    before = position(own=(0.0, -1.0))
    called = position(own=(0.0, 0.5), shooter=(0.0, -1.0))
    short = position(own=(0.0, -0.3), shooter=(0.0, -1.2))
    assert grade("tap", before, called, called, SHOOTER) == 4
    assert grade("tap", before, called, short, SHOOTER) == 2
    assert grade("tap", before, called, position(own=(0.0, -1.0)), SHOOTER) == 0


BEFORE = position(theirs=(0.0, 0.3))
STAY, ROLL = position(shooter=(0.1, 0.3)), position(shooter=(1.2, 0.8))


@pytest.mark.parametrize(
    ("made", "stays", "rolls"),
    [
        (position(shooter=(0.1, 0.3)), 4, 3),  # does not roll
        (position(shooter=(1.3, 0.9)), 4, 4),
        (position(), 2, 2),  # rolls out
        (position(theirs=(0.6, 0.9), shooter=(0.0, 0.0)), 1, 1),  # moved, not removed
        (position(theirs=(0.0, 0.3)), 0, 0),  # missed
    ],
)
def test_a_takeout_that_stays_in_play_is_perfect_wherever_unless_a_roll_was_called(
    made, stays, rolls
):
    assert shot_type("hit", BEFORE, STAY, SHOOTER) == "takeout"
    assert grade("hit", BEFORE, STAY, made, SHOOTER) == stays
    assert shot_type("peel", BEFORE, ROLL, SHOOTER) == "hit and roll"
    assert grade("peel", BEFORE, ROLL, made, SHOOTER) == rolls


def test_a_peel_need_not_stay_a_double_counts_whole_and_a_lost_stone_of_ones_own_costs():
    single = position(theirs=(0.0, -2.5))
    assert shot_type("firm hit", single, position(), SHOOTER) == "peel"
    assert grade("firm hit", single, position(), position(), SHOOTER) == 4
    assert grade("peel", single, position(), single, SHOOTER) == 0
    both = position(theirs=(0.0, 0.3), other=(0.5, 0.5), own=(-1.0, 1.0))
    kept = position(own=(-1.0, 1.0), shooter=(0.2, 0.4))
    assert grade("hit", both, kept, kept, SHOOTER) == 4
    assert grade("hit", both, kept, position(own=(-1.0, 1.0)), SHOOTER) == 4
    one_left = position(other=(0.5, 0.5), own=(-1.0, 1.0))
    assert grade("hit", both, kept, one_left, SHOOTER) == 2
    assert grade("hit", both, kept, position(), SHOOTER) == 2


def test_a_run_back_is_graded_by_the_stone_behind_and_a_hit_that_takes_nothing_out_by_places():
    before = position(own=(0.0, -2.5), theirs=(0.0, 0.3))
    called = position(shooter=(0.0, -2.4), own=(0.1, 0.2))
    assert shot_type("hit", before, called, SHOOTER) == "run-back"
    assert grade("hit", before, called, position(own=(0.9, 0.2)), SHOOTER) == 4
    assert grade("hit", before, called, position(shooter=(0.0, -2.4)), SHOOTER) == 2  # both out
    assert grade("hit", before, called, before, SHOOTER) == 0
    nudged = position(shooter=(0.3, -2.4), own=(-0.8, -1.0), theirs=(0.0, 0.3))
    assert shot_type("hit", before, nudged, SHOOTER) == "other hit"
    assert grade("hit", before, nudged, nudged, SHOOTER) == 4
    assert grade("hit", before, nudged, before, SHOOTER) == 0


def test_every_shot_of_search_has_a_type_but_the_one_thrown_away():
    types = {shot_type(name, BEFORE, STAY, SHOOTER) for name in KINDS}
    assert types == {*SHOT_TYPES, None} - {*HIT_TYPES} | {"takeout"}
    both = position(theirs=(0.0, 0.3), other=(0.5, 0.5))
    assert shot_type("hit", both, position(), SHOOTER) == "double"
    assert grade("through the house", BEFORE, BEFORE, BEFORE, SHOOTER) is None
