"""The data that a picture of a comparison shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Circle

from curling_env.ice import Ice
from curling_env.throw import Release
from curling_env.units import FOOT, INCH, Units
from friction_estimation.comparison import Comparison, Rethrow
from friction_estimation.reports import rethrow_figures as module

ICE = Ice.uniform(0.009)


def thrown(throw: int = 4, *, way: float = 1.0, rows: int = 100, rest=(0.1, 17.0)) -> Rethrow:
    """A throw whose prediction is ahead by a hundredth of its distance, and 2 cm to the left."""
    t = np.linspace(0.0, 9.9, rows)
    measured = way * np.column_stack([0 * t, -11.0 + 2.0 * t])
    return Rethrow(
        throw=throw,
        stone=2,
        release=Release(x=0.0, y=-way * 11, vx=0.0, vy=way * 2.0),
        t=t,
        measured=measured,
        predicted=measured + way * np.column_stack([-0.02 + 0 * t, 0.02 * t]),
        tested=t >= 5,
        rest=None if rest is None else way * np.array(rest),
        predicted_rest=way * np.array([0.4, 16.6]),
        rest_time=None,
        predicted_time=20.0,
    )


@pytest.fixture
def drawn(monkeypatch):
    """A function that draws throws and returns the three axes and the title."""

    def draw(*throws: Rethrow, units: Units = Units.METRES):
        saved = []
        monkeypatch.setattr(module, "save_figure", lambda *given: saved.append(given))
        comparison = Comparison(rethrows=throws, skipped=(), window=2.5)
        module.save_comparison(comparison, ICE, Path("picture.png"), units)
        ((figure, path, title),) = saved
        assert path == Path("picture.png")
        return *figure.axes, title

    return draw


def test_both_paths_are_drawn_on_the_sheet_and_where_they_rest(drawn):
    one, other = thrown(4), thrown(5, rest=None)
    top, *_ = drawn(one, other)
    curves = [line.get_xydata() for line in top.lines if len(line.get_xydata()) == 100]
    assert len(curves) == 4
    for curve, xy in zip(
        curves, (one.measured, one.predicted, other.measured, other.predicted), strict=True
    ):
        assert curve == pytest.approx(np.column_stack([xy[:, 1], -xy[:, 0]]))
    stones = [p for p in top.patches if isinstance(p, Circle) and p.radius == ICE.stone.radius]
    assert [stone.center for stone in stones] == [(17.0, -0.1), (16.6, -0.4)]
    assert [stone.get_facecolor()[3] > 0 for stone in stones] == [True, False]


@pytest.mark.parametrize(("units", "unit"), [(Units.METRES, 1.0), (Units.FEET, FOOT)])
def test_misses_are_seen_from_the_thrower(drawn, units, unit):
    _, misses, _, _ = drawn(thrown(4), thrown(5, way=-1.0), thrown(6, rest=None), units=units)
    points = [line.get_xydata().tolist() for line in misses.lines if line.get_marker() == "o"]
    assert points == [[pytest.approx([0.3 / unit, -0.4 / unit])]] * 2
    assert [text.get_text() for text in misses.texts] == ["4", "5"]
    assert [text.xy for text in misses.texts] == [pytest.approx((0.3 / unit, -0.4 / unit))] * 2
    assert misses.get_xlim() == misses.get_ylim() == pytest.approx((-0.5 / unit, 0.5 / unit))
    (stone,) = misses.patches
    assert stone.radius == pytest.approx(ICE.stone.radius / unit)


def test_small_misses_are_shown_beside_the_whole_stone(drawn):
    _, misses, _, _ = drawn(thrown(rest=(0.41, 16.6)))
    assert misses.get_xlim()[1] == pytest.approx(1.3 * ICE.stone.radius)
    _, misses, _, _ = drawn(thrown(rest=None))
    assert [text.get_text() for text in misses.texts] == ["no throw was seen to rest"]
    assert not misses.lines


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("units", "small", "large"), [(Units.METRES, 0.01, 1.0), (Units.FEET, INCH, FOOT)]
)
def test_the_distance_between_paths_is_along_the_play(drawn, way, units, small, large):
    *_, parting, _ = drawn(thrown(way=way), units=units)
    curve, bar, _ = (line.get_xydata() for line in parting.lines)
    t = np.linspace(0.0, 9.9, 100)
    assert curve == pytest.approx(np.column_stack([2.02 * t / large, 0.02 * t / small])[10:-10])
    first = t[t >= 5][0]
    assert bar == pytest.approx(np.array([[2.02 * first / large, 0.02 * first / small]]))


def test_single_frames_do_not_part_the_paths(drawn):
    jumped = thrown()
    jumped.measured[40:49, 1] += 0.5
    *_, parting, _ = drawn(jumped)
    assert np.abs(parting.lines[0].get_ydata()).max() < 25
    # Few rows are shown whole.
    *_, parting, _ = drawn(thrown(rows=60))
    assert len(parting.lines[0].get_xydata()) == 60
    *_, parting, _ = drawn(thrown(rows=61))
    assert len(parting.lines[0].get_xydata()) == 41


def test_its_title_has_the_errors(drawn):
    """Tested are 4.9 s at 0.02 m/s ahead of the stone, and 2 cm beside it."""
    t = np.linspace(0.0, 9.9, 100)
    apart = np.sqrt(((0.02 * t[t >= 5]) ** 2 + 0.02**2).mean())
    *_, title = drawn(thrown(4), thrown(5))
    assert title == (
        f"2 throws thrown again: paths {100 * apart:.1f} cm apart (rms), rest 50.0 cm apart (rms)"
    )
    *_, title = drawn(thrown(rest=None))
    assert title == f"1 throws thrown again: paths {100 * apart:.1f} cm apart (rms)"
    *_, title = drawn(thrown(), units=Units.FEET)
    assert title == (
        f"1 throws thrown again: paths {apart / INCH:.0f} in apart (rms), rest 1 ft 8 in apart "
        "(rms)"
    )
    assert module._distance(None, Units.METRES) == "–"
