"""Where stones should be after they touch each other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_estimation.tracking.several.expected_path import (
    ExtrapolatedPath,
    after_contact,
    time_to_touch,
)

TOUCHING = 0.29


def seen_along(start, velocity, times):
    path = ExtrapolatedPath(np.array(start), 0.0)
    for t in times:
        path.add(t, np.array(start) + t * np.array(velocity))
    return path


@given(st.floats(-0.28, 0.28), st.floats(0.3, 3.0), st.floats(0.1, 1.0))
def test_stones_touch_when_their_centres_are_a_width_apart(aside, pace, before):
    at = np.array([aside, -(before + TOUCHING)])
    wait = time_to_touch(at, np.array([0.0, pace]), TOUCHING)
    assert np.linalg.norm(at + np.array([0.0, pace * wait])) == pytest.approx(TOUCHING)
    assert time_to_touch(at + np.array([0.6, 0.0]), np.array([0.0, pace]), TOUCHING) is None
    assert time_to_touch(at, np.array([0.0, 0.01]), TOUCHING) is None


@given(st.floats(0.0, 6.28), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_a_contact_keeps_momentum_and_gains_no_energy(angle, vx, vy):
    velocity = np.array([vx, vy])
    hit = TOUCHING * np.array([np.cos(angle), np.sin(angle)])
    onward, given_on = after_contact(np.zeros(2), hit, velocity)
    assert onward + given_on == pytest.approx(velocity)
    assert onward @ onward + given_on @ given_on <= velocity @ velocity + 1e-12
    assert given_on @ hit >= 0


def test_a_stone_that_comes_meets_one_that_lies_there_in_time_only():
    path = seen_along((0.0, 0.0), (0.0, 1.0), np.arange(0, 0.5, 0.1))
    there = np.array([0.0, 0.4 + 0.2 + TOUCHING])
    assert path.meets(there, TOUCHING, 0.7) == pytest.approx(0.6)
    assert path.meets(there, TOUCHING, 0.55) is None
    assert path.meets(there + np.array([0.4, 0.0]), TOUCHING, 0.7) is None


def test_a_stone_that_is_hit_sets_out_slows_down_and_stops():
    path = ExtrapolatedPath(np.array([0.0, 5.0]), 3.0)
    assert path.at(4.0) == pytest.approx([0.0, 5.0])
    path.set_out(3.0, np.array([0.0, 5.0]), np.array([0.0, 0.6]))
    assert path.at(3.5)[1] == pytest.approx(5.3, abs=0.02)
    assert path.at(20.0) == pytest.approx(path.at(30.0))
    assert 5.5 < path.at(30.0)[1] < 8.0
