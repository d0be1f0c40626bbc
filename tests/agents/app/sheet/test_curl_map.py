"""The map of curl: lanes that are straight, and ice that falls."""

from __future__ import annotations

import numpy as np
import pytest

from agents.app.sheet.curl_map import curl_map
from curling_env.sheet import PAPER_SHEET, Direction
from friction_estimation.tracks.measured import Measured
from friction_estimation.tracks.throw_table import ThrowMeasures


def draw(x: float, spin: float, curl: float, direction: Direction) -> ThrowMeasures:
    """A draw at x of the sheet, which came to rest to the left of its line."""
    right = x * direction
    numbers = {"spin": spin, "curl": curl, "line": right, "right": right, "past": 0.0}
    measured = {name: Measured(value, 0.02) for name, value in numbers.items()}
    return ThrowMeasures(
        throw=0, stone=0, clock=0.0, direction=direction, from_tee=Measured(0.5, 0.02), **measured
    )


def test_a_straight_lane_and_a_fall_are_seen_where_they_are():
    throws = []
    for x, curl in ((-1.5, 1.0), (0.0, 1.3), (1.5, 1.3)):
        for direction in Direction:
            fall = 0.2 if direction is Direction.AWAY and x > 1 else 0.0  # to the right
            throws += [draw(x, 1.5, curl - fall, direction)] * 3
            throws += [draw(x, -1.5, -curl - fall, direction)] * 3
    found = curl_map(PAPER_SHEET, throws)
    less = np.array(found["relative"], dtype=float)
    assert found["usual"] == pytest.approx(1.2, abs=1e-3)
    assert (less[:, 0] > 0.19).all()  # straight on the left, at both ends
    assert (less[:, 4] < -0.09).all()
    fall = np.array(found["fall"], dtype=float)
    assert fall[80, 8] == pytest.approx(0.2, abs=1e-3)
    assert fall[8, 8] == pytest.approx(0.0, abs=1e-3)
    assert curl_map(PAPER_SHEET, throws[:6]) is None  # one lane alone says nothing


def test_draws_of_another_weight_and_touched_stones_do_not_count():
    far = [draw(x, 1.5, 1.0, Direction.AWAY) for x in (-1.5, 0.0, 1.5) for _ in range(2)]
    assert curl_map(PAPER_SHEET, far) is not None
    short = [
        ThrowMeasures(
            **{
                name: getattr(one, name)
                for name in (
                    "throw",
                    "stone",
                    "clock",
                    "direction",
                    "spin",
                    "curl",
                    "line",
                    "right",
                )
            },
            past=Measured(-6.0, 0.02),
            from_tee=Measured(6.0, 0.02),
        )
        for one in far
    ]
    assert curl_map(PAPER_SHEET, short) is None
