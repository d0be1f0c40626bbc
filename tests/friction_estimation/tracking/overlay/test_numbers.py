"""An overlay says each number from the moment on at which a coach would know it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.sheet import HOG_LINE_Y
from curling_env.units import Units
from friction_estimation.tracking import RunningNumbers


@pytest.fixture
def draw(sliding):
    """A draw that curls to the left and rests, with what a film's track has beside its path."""
    rng = np.random.default_rng(1)
    start = np.array([[0.3, -HOG_LINE_Y, 0.0, 2.25, 1.5]])
    (track,) = sliding.measured_throws(
        sliding.uniform(0.0088), start, rng, noise=0.0, curl=0.005, rest=1.5
    )
    return SimpleNamespace(
        trajectory=track,
        velocity=track.velocity,
        spin=np.gradient(track.theta, track.t),
        contacts=(),
    )


def row_at(draw, y):
    return int(np.searchsorted(draw.trajectory.xy[:, 1], y))


def test_weight_comes_first_and_the_time_from_hog_line_to_hog_line_later(draw):
    numbers = RunningNumbers(draw)
    early, late = (" | ".join(numbers.at(row_at(draw, y))) for y in (0.0, HOG_LINE_Y + 0.5))
    assert "hog line 2.25 m/s" in early
    assert "hog to hog" not in early
    t = np.interp([-HOG_LINE_Y, HOG_LINE_Y], draw.trajectory.xy[:, 1], draw.trajectory.t)
    assert f"hog to hog {t[1] - t[0]:.2f} s" in late


def test_the_curl_grows_and_the_end_says_where_it_stopped(draw):
    numbers = RunningNumbers(draw)
    middle, end = numbers.at(row_at(draw, 5.0)), numbers.at(len(draw.trajectory) - 1)
    assert any(line.startswith("curl ") and line.endswith("left") for line in middle)
    assert "at rest" in end
    assert any(line.startswith("stops ") for line in end)
    assert "out-turn" in " | ".join(end)
    result = RunningNumbers(draw, Units.FEET).at(len(draw.trajectory) - 1)
    assert any(" in " in line and line.startswith("stops") for line in result)
    assert result[-1].endswith("ft")


def test_a_stone_that_only_lies_has_its_place(draw):
    still = SimpleNamespace(
        trajectory=type(draw.trajectory)(t=np.arange(30) / 30, xy=np.ones((30, 2))),
        velocity=np.zeros((30, 2)),
        spin=np.full(30, np.nan),
        contacts=(),
    )
    assert RunningNumbers(still).at(3) == ["at rest", "x +1.00  y +1.00 m"]
    assert RunningNumbers(still).before(seen=False) == ["no stone yet"]
