"""Grades of shots whose outcomes are laid out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing.ends.grades import SHOT_TYPES, grade, hit_meaning, shot_type
from agents.playing.search.shots import KINDS

OWN, THEIRS, SHOOTER = 0, 8, 3


def position(**places):
    found = np.full((16, 2), np.nan)
    for slot, place in ((OWN, "own"), (THEIRS, "theirs"), (9, "other"), (SHOOTER, "shooter")):
        if place in places:
            found[slot] = places[place]
    return found


@pytest.mark.parametrize(
    ("off", "points"), [(0.0, 4), (0.59, 4), (0.61, 3), (1.4, 2), (2.1, 1), (2.3, 0)]
)
def test_a_draw_is_graded_by_its_distance_from_the_call(off, points):
    called, made = position(shooter=(0.0, 0.5)), position(shooter=(0.0, 0.5 - off))
    assert grade("draw", position(), called, made, SHOOTER) == points
    assert grade("come-around", position(), called, made, SHOOTER) == points


def test_a_draw_that_leaves_play_is_a_miss_and_a_freeze_is_graded_more_strictly():
    called = position(shooter=(0.0, 0.0))
    assert grade("guard", position(), called, position(), SHOOTER) == 0
    near = position(shooter=(0.0, -0.5))
    assert grade("freeze", position(), called, near, SHOOTER) == 3
    assert grade("draw", position(), called, near, SHOOTER) == 4


def test_a_tap_is_graded_by_the_stone_that_it_moves_too():
    before = position(own=(0.0, -1.0))
    called = position(own=(0.0, 0.5), shooter=(0.0, -1.0))
    short = position(own=(0.0, -0.3), shooter=(0.0, -1.2))
    assert grade("tap", before, called, called, SHOOTER) == 4
    assert grade("tap", before, called, short, SHOOTER) == 2
    assert grade("tap", before, called, position(own=(0.0, -1.0)), SHOOTER) == 0


STAY, OUT = position(shooter=(0.1, 0.3)), position()


@pytest.mark.parametrize(
    ("made", "points"),
    [
        (position(shooter=(0.1, 0.3)), 4),
        (position(shooter=(1.4, 0.9)), 3),  # rolls
        (position(), 2),  # rolls out
        (position(theirs=(0.6, 0.9), shooter=(0.0, 0.0)), 1),  # moved, not removed
        (position(theirs=(0.0, 0.3)), 0),  # missed
    ],
)
def test_a_takeout_is_graded_by_the_stone_it_removes_and_where_it_stays(made, points):
    before = position(theirs=(0.0, 0.3))
    assert grade("hit", before, STAY, made, SHOOTER) == points


def test_a_peel_need_not_stay_a_double_counts_whole_and_a_lost_stone_of_ones_own_costs():
    single, rolled = position(theirs=(0.0, -2.5)), position(shooter=(0.0, -2.0))
    assert grade("peel", single, rolled, position(), SHOOTER) == 4
    assert grade("hit", single, rolled, position(), SHOOTER) == 2
    both = position(theirs=(0.0, 0.3), other=(0.5, 0.5), own=(-1.0, 1.0))
    kept = position(own=(-1.0, 1.0))
    assert grade("peel", both, kept, kept, SHOOTER) == 4
    one_left = position(other=(0.5, 0.5), own=(-1.0, 1.0))
    assert grade("peel", both, kept, one_left, SHOOTER) == 2
    assert grade("peel", both, kept, position(), SHOOTER) == 2


def test_every_shot_of_search_has_a_type_but_the_one_thrown_away():
    types = [shot_type(name) for name in KINDS]
    assert {t for t in types if t} == set(SHOT_TYPES)
    assert [name for name, t in zip(KINDS, types, strict=True) if t is None] == [
        "through the house"
    ]
    assert grade("through the house", position(), position(), position(), SHOOTER) is None


def test_hits_are_told_by_what_they_were_meant_to_take_out():
    both = position(theirs=(0.0, 0.3), other=(0.5, 0.5), own=(-1.0, 1.0))
    double = position(own=(-1.0, 1.0))
    single = position(own=(-1.0, 1.0), other=(0.5, 0.5), shooter=(0.0, 0.2))
    behind = position(own=(-1.0, 1.0), other=(0.9, 1.5), shooter=(0.0, 0.2))
    told = [hit_meaning(both, called, SHOOTER) for called in (double, single, behind, both)]
    assert told == ["two stones or more", "one stone", "one stone by another", "none"]
