"""The map of curl: lanes that are straight, and ice that falls."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from agents.coaching.measured_ice import change_of_weight, curl_map
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


def timed(number: int, seconds: float, past: float = 0.0, **more: Any) -> ThrowMeasures:
    """A draw with its time between the hog lines, which came to rest past the tee."""
    numbers = {"hog_to_hog": seconds, "past": past, "from_tee": abs(past)}
    measured = {name: Measured(value, 0.02) for name, value in numbers.items()}
    direction = Direction.AWAY
    return ThrowMeasures(
        throw=number, stone=0, clock=0.0, direction=direction, **{**measured, **more}
    )


def test_ice_that_becomes_keener_during_the_evening_is_noticed():
    scatter = [0.1, -0.1, -0.1, 0.1] * 5
    keener = [timed(k, 14.0 + 0.03 * k + scatter[k]) for k in range(20)]
    words = change_of_weight(keener)["words"]
    assert words.startswith("keener by 0.6 ± 0.2 s")
    assert change_of_weight(keener[::-1])["words"].startswith("heavier by 0.6")
    same = [timed(k, 14.0 + scatter[k]) for k in range(20)]
    assert change_of_weight(same)["words"].startswith("no clear change")
    assert change_of_weight(keener[:7]) is None


def test_weight_is_that_of_a_draw_to_the_tee():
    # At 0.09 m/s²: a draw 2 m past the tee line is quicker than one on it.
    def hog_to_hog(far: float) -> float:
        speed = (2 * 0.09 * far) ** 0.5
        return (speed - (speed**2 - 2 * 0.09 * 21.945) ** 0.5) / 0.09

    draws = [timed(k, hog_to_hog(28.346 + past), past) for k, past in enumerate([2.0, -2.0] * 4)]
    assert change_of_weight(draws)["seconds"] == pytest.approx([hog_to_hog(28.346)] * 8, abs=0.011)
    short = [timed(k, 14.0, -8.0) for k in range(9)]
    touched = [timed(k, 14.0, touched=True) for k in range(9)]
    assert change_of_weight(short) is None
    assert change_of_weight(touched) is None
