"""Gate-timed throws beside their predictions, on ice of one friction and in given numbers."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from curling_env.errors import TrackTooShortError
from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.throw import MAX_SPEED
from curling_env.trajectory import Trajectory
from friction_estimation.comparison import gate_times as module
from friction_estimation.comparison.gate_times import (
    GateComparison,
    GateRethrow,
    compare_gate_times,
    write_gate_comparison,
)

MU, G = 0.009, 9.80665
EDGES = np.array([-0.13, 0.13])


def timed(
    *, speed: float = 2.4, way: float = 1.0, throw: int = 0, lines: tuple[float, ...] = ()
) -> Trajectory:
    """Times of both edges of a stone of even friction at some lines, from the first hog line."""
    lines = lines or (-HOG_LINE_Y, HOG_LINE_Y, TEE_Y)
    along = np.concatenate([line + EDGES for line in lines])
    # From the place at which its front breaks the first beam.
    run = along + HOG_LINE_Y - EDGES[0]
    drag = MU * G
    t = (speed - np.sqrt(np.maximum(speed**2 - 2 * drag * run, 0.0))) / drag
    return Trajectory(
        t=10.0 + t,
        xy=np.column_stack([0 * along, way * along]),
        sigma_t=np.full(len(t), 0.003),
        throw=throw,
    )


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_on_its_own_ice_a_throw_keeps_what_the_school_formula_says(way: float) -> None:
    """A turning stone feels a little less of the friction than a straight one."""
    (found,) = compare_gate_times([timed(way=way, throw=7)], Ice.uniform(MU)).rethrows
    assert found.throw == 7
    assert found.direction == ("away" if way > 0 else "home")
    assert found.speed == pytest.approx(2.4, rel=0.01)
    run = 2 * HOG_LINE_Y
    second = np.sqrt(2.4**2 - 2 * MU * G * run)
    assert found.kept == pytest.approx(second / 2.4, rel=0.01)
    assert found.predicted_kept == pytest.approx(found.kept, rel=0.02)
    # Each beam is broken for 0.26 m over the speed, and both times of it err by 3 ms.
    relative = np.sqrt(2) * 0.003 * np.hypot(2.4, second) / 0.26
    assert found.kept_sigma == pytest.approx(found.kept * relative, rel=0.02)
    assert found.hog_to_hog_s == pytest.approx((2.4 - second) / (MU * G), rel=0.01)
    last = np.sqrt(second**2 - 2 * MU * G * (TEE_Y - HOG_LINE_Y))
    assert found.hog_to_tee_s == pytest.approx((second - last) / (MU * G), rel=0.02)
    assert found.predicted_hog_to_tee_s == pytest.approx(found.hog_to_tee_s, rel=0.02)


def test_on_heavier_ice_it_is_faster_at_first_and_keeps_less() -> None:
    (found,) = compare_gate_times([timed()], Ice.uniform(1.3 * MU)).rethrows
    assert found.speed > 2.45
    assert found.predicted_kept is not None
    assert found.kept is not None
    assert found.predicted_kept < found.kept - 0.03
    # On ice on which no stone could be so quick it is thrown as fast as a stone can be.
    (fastest,) = compare_gate_times([timed(speed=7.0)], Ice.uniform(0.09)).rethrows
    assert fastest.speed == MAX_SPEED
    assert fastest.predicted_hog_to_tee_s is None


def test_throws_that_were_not_timed_at_both_hog_lines_are_skipped() -> None:
    half = timed(throw=3, lines=(-HOG_LINE_Y, TEE_Y))
    other = timed(throw=4, lines=(HOG_LINE_Y, TEE_Y))
    whole = timed(throw=5, lines=(-HOG_LINE_Y, HOG_LINE_Y))
    found = compare_gate_times([half, whole, other], Ice.uniform(MU))
    assert [one.throw for one in found.rethrows] == [5]
    assert found.skipped == tuple(f"throw {k} was not timed at both hog lines" for k in (3, 4))
    assert found.rethrows[0].hog_to_tee_s is None
    assert found.rethrows[0].predicted_hog_to_tee_s is None
    with pytest.raises(TrackTooShortError, match="no throw can be thrown again: throw 3 was not"):
        compare_gate_times([half, other], Ice.uniform(MU))


def given(kept: float | None, predicted: float | None = None, **other: object) -> GateRethrow:
    words = {"throw": 1, "direction": "away", "hog_to_hog_s": 14.0, "speed": 2.0, **other}
    return GateRethrow(kept=kept, predicted_kept=predicted, **words)


def test_means_are_over_the_throws_of_a_direction_that_have_both_numbers() -> None:
    home = given(0.5, 0.8, direction="home", hog_to_tee_s=5.0, predicted_hog_to_tee_s=4.0)
    throws = (
        given(0.60, 0.65),
        given(0.70, 0.71, hog_to_tee_s=4.5, predicted_hog_to_tee_s=4.9),
        given(None, hog_to_tee_s=9.0),
        home,
    )
    found = GateComparison(throws, ("throw 9 was not timed",)).summary()
    assert found["throws"] == 4
    away = found["directions"]["away"]
    assert away["throws"] == 3
    assert away["kept"] == pytest.approx(0.65)
    assert away["predicted_kept"] == pytest.approx(0.68)
    assert away["kept_less_predicted"] == pytest.approx(-0.03)
    assert away["kept_less_predicted_sd"] == pytest.approx(0.04 / np.sqrt(2))
    assert away["hog_to_tee_less_predicted_s"] == pytest.approx(-0.4)
    back = found["directions"]["home"]
    assert back["kept_less_predicted_sd"] is None
    assert back["hog_to_tee_less_predicted_s"] == pytest.approx(1.0)
    assert found["skipped"] == ["throw 9 was not timed"]
    assert [each["direction"] for each in found["each"]] == ["away"] * 3 + ["home"]
    alone = GateComparison((home,), ()).summary()
    assert list(alone["directions"]) == ["home"]
    assert "skipped" not in alone


def test_a_sentence_counts_both_directions_alike() -> None:
    away, home = given(0.6, 0.7), given(0.8, 0.9, direction="home")
    both = GateComparison((away, away, away, home), ())
    assert both.in_words() == (
        "4 throws kept 0.70 of their speed from hog line to hog line, and would keep 0.80 on "
        "this ice"
    )
    assert GateComparison((away,), ()).in_words().startswith("one throw kept 0.60 of its speed")
    neither = GateComparison((given(None), given(None)), ())
    assert neither.in_words() == "2 throws: no beam was broken at both hog lines measurably"


def test_a_table_has_a_row_for_each_throw(tmp_path: Path) -> None:
    write_gate_comparison(GateComparison((given(0.6, 0.7), given(None, throw=2)), ()), tmp_path)
    with (tmp_path / "throws.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["throw"] for row in rows] == ["1", "2"]
    assert float(rows[0]["predicted_kept"]) == 0.7


@pytest.fixture
def releases(monkeypatch):
    """The releases that were thrown, and the positions at which each was stopped."""
    thrown = []
    whole = module.slide

    def throw(ice, release, *, bounds, fps):
        thrown.append((release, bounds))
        return whole(ice, release, bounds=bounds, fps=fps)

    monkeypatch.setattr(module, "slide", throw)
    return thrown


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_throw_begins_before_the_first_hog_line_and_is_stopped_past_the_tee(releases, way):
    track = replace(timed(way=way), stone=3, clock=77.0)
    compare_gate_times([track, replace(track, throw=1)], Ice.uniform(MU))
    release, bounds = releases[0]
    assert (release.x, release.y) == (0.0, pytest.approx(-way * (HOG_LINE_Y + 0.3)))
    assert (release.vx, release.theta, release.omega) == (0.0, 0.0, 0.9)
    assert np.sign(release.vy) == way
    assert (release.stone, release.clock, release.order) == (3, 77.0, 0)
    assert bounds[3 if way > 0 else 2] == pytest.approx(way * (TEE_Y + 1.0))
    # The last throw is to rest, wherever that is, and of the second in play.
    release, bounds = releases[-1]
    assert release.order == 1
    assert np.isinf(bounds).all()


def test_its_speed_takes_the_measured_time_from_hog_line_to_hog_line(releases):
    """Coulomb friction: v takes v² − 2as to slow over s, and the rest by the school formula."""
    lines = (-HOG_LINE_Y, HOG_LINE_Y)
    (found,) = compare_gate_times([timed(speed=2.6, lines=lines)], Ice.uniform(2 * MU)).rethrows
    drag = 2 * MU * G

    def seconds(speed: float) -> float:
        times = [
            (speed - np.sqrt(speed**2 - 2 * drag * (along + HOG_LINE_Y + 0.3))) / drag
            for line in lines
            for along in line + EDGES
        ]
        return (times[2] + times[3] - times[0] - times[1]) / 2

    speed = brentq(lambda v: seconds(v) - found.hog_to_hog_s, 2.87, 6.0)
    assert found.speed == pytest.approx(speed, rel=0.002)


def test_only_times_within_thirty_centimetres_of_a_line_are_of_its_gate():
    near, far = timed(), timed()
    moved = far.xy.copy()
    moved[2, 1] = HOG_LINE_Y - 0.31
    (found,) = compare_gate_times([replace(far, xy=moved)], Ice.uniform(MU)).rethrows
    assert found.kept is found.kept_sigma is found.predicted_kept is None
    assert found.hog_to_hog_s == pytest.approx(near.t[3] - near.t[:2].mean())
    assert found.hog_to_tee_s == pytest.approx(near.t[4:].mean() - near.t[3])
    # Three times at a line are no width of a stone.
    third = near.only(np.array([0, 1, 2, 3]))
    more = replace(
        third,
        t=np.insert(third.t, 3, third.t[2:].mean()),
        xy=np.insert(third.xy, 3, third.xy[2:].mean(axis=0), axis=0),
        **{"theta": np.full(5, np.nan), "swept": np.zeros(5), "sigma_t": np.full(5, 0.003)},
    )
    (found,) = compare_gate_times([more], Ice.uniform(MU)).rethrows
    assert found.kept is None
    assert found.hog_to_hog_s == pytest.approx(more.t[2:].mean() - more.t[:2].mean())


def test_throws_wear_the_ice_for_those_after():
    wear = ActiveEffect(name="pebble_wear", parameters={"rate": 0.0, "along_path": -0.1})
    found = compare_gate_times([timed(), timed(throw=1)], Ice.uniform(MU, effects=(wear,)))
    first, second = found.rethrows
    assert second.predicted_kept > first.predicted_kept + 0.005
    assert second.speed < first.speed
