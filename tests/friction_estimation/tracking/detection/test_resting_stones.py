"""Stones at rest lie between the boards."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.sheet import Sheet
from friction_estimation.tracking.detection.resting_stones import lies_within

SHEET, RADIUS = Sheet(), 0.14


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_stone_may_touch_the_boards_and_does_not_reach_into_them(axis, side):
    board = side * np.array([SHEET.width, SHEET.length]) / 2
    at = np.zeros(2)
    at[axis] = board[axis] - side * RADIUS
    assert lies_within(SHEET, at, RADIUS)
    at[axis] = board[axis] - side * 0.02
    assert not lies_within(SHEET, at, RADIUS)
