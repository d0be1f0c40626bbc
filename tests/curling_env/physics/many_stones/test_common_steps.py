"""Contact is found on the paths of stones, where it happens."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.physics.many_stones.common_steps import Segment, first_touch, new_joint_workspace
from curling_env.physics.tuning import CREEP, CREEP_OVERLAP, OVERLAPPING_CREEP
from curling_env.sheet import RULE_BOOK_STONE

REACH = 2 * RULE_BOOK_STONE.radius
H = 0.1


def moving(x: float, y: float, vx: float, vy: float) -> Segment:
    """A stone that keeps its velocity for a step."""
    begin = np.array([x, y, vx, vy, 0.0, 0.0])
    end = begin + np.array([H * vx, H * vy, 0.0, 0.0, 0.0, 0.0])
    return Segment(begin, np.zeros(3), end, np.zeros(3), vx != 0.0 or vy != 0.0)


def touch(first: Segment, second: Segment) -> float:
    return first_touch(first, second, H, REACH, new_joint_workspace(2))


@pytest.mark.parametrize("gap", [0.001, 0.05, 0.0999])
def test_a_head_on_approach_touches_after_its_gap(gap):
    found = touch(moving(0.0, 0.0, 0.0, 1.0), moving(0.0, REACH + gap, 0.0, 0.0))
    assert found == pytest.approx(gap / H, abs=1e-9)
    both = touch(moving(0.0, 0.0, 0.0, 1.0), moving(0.0, REACH + 2 * gap, 0.0, -1.0))
    assert both == pytest.approx(gap / H, abs=1e-9)


def test_what_is_out_of_reach_or_parts_does_not_touch():
    assert touch(moving(0, 0, 0, 1.0), moving(0, REACH + 0.11, 0, 0)) == 2.0
    assert touch(moving(0, 0, 0, -1.0), moving(0, REACH + 1e-6, 0, 0)) == 2.0


@pytest.mark.parametrize(("offset", "touches"), [(-1e-6, True), (1e-6, False)])
def test_a_graze_within_a_piece_of_a_step_is_found(offset, touches):
    passing = moving(REACH + offset, -0.031, 0.0, 0.6)
    found = touch(passing, moving(0.0, 0.0, 0.0, 0.0))
    assert (found < 1.0) is touches


def test_touching_stones_may_creep_but_not_into_one_another():
    slow, slower = 0.5 * CREEP, 0.5 * OVERLAPPING_CREEP
    shallow, deep = REACH - 0.5 * CREEP_OVERLAP, REACH - 2.0 * CREEP_OVERLAP
    rest = moving(0.0, 0.0, 0.0, 0.0)
    assert touch(moving(0, -shallow, 0, 2 * CREEP), rest) == 0.0
    assert touch(moving(0, -deep, 0, slow), rest) == 0.0
    assert touch(moving(0, -deep, 0, slower), rest) == 2.0
    # It closes by more than may overlap within the step, and is stopped there.
    assert 0.0 < touch(moving(0, -shallow, 0, slow), rest) <= 1.0
    assert touch(moving(0, -shallow, 0, slower), rest) == 2.0
