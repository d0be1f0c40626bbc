"""Throws and releases."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from curling_env.errors import InputError, OutOfRangeError
from curling_env.sheet import HACK_Y, HOG_LINE_Y, Direction
from curling_env.throw import (
    FROM_HACK,
    Delivery,
    Release,
    Throw,
    read_releases,
    write_releases,
)


@given(st.floats(0.1, 6), st.floats(-1.5, 1.5), st.floats(-20, 20), st.floats(-2, 2))
@example(6.0, 0.22320598798250746, 0.0, 0.0)  # whose components round to a little more than 6 m/s
def test_the_two_directions_differ_by_half_a_turn(speed, angle, spin, x):
    throw = Throw(speed=speed, angle=angle, spin=spin, x=x)
    away, home = throw.release(Direction.AWAY), throw.release(Direction.HOME)
    assert (home.x, home.y, home.vx, home.vy) == (-away.x, -away.y, -away.vx, -away.vy)
    assert home.omega == away.omega == spin
    assert away.speed == pytest.approx(speed)
    assert (away.direction, home.direction) == (Direction.AWAY, Direction.HOME)


def test_a_throw_starts_on_the_hog_line_and_a_positive_angle_goes_left():
    release = Throw(speed=2.0, angle=0.1, x=0.3).release()
    assert (release.x, release.y) == (0.3, -HOG_LINE_Y)
    assert release.vx == pytest.approx(-2 * np.sin(0.1))
    assert release.vy == pytest.approx(2 * np.cos(0.1))


def test_a_throw_from_the_hack_starts_there():
    release = Throw(speed=2.4, x=0.1).release(Direction.HOME, delivery=FROM_HACK)
    assert (release.x, release.y, release.vy) == (-0.1, HACK_Y, -2.4)
    assert FROM_HACK.start_y == pytest.approx(-38.405)


@pytest.mark.parametrize(
    "delivery",
    [{"line_y": -1.0}, {"line_y": 30.0}, {"line_y": float("nan")}, {"spin": 0}, {"max_speed": 9}],
)
def test_impossible_deliveries_are_refused(delivery):
    with pytest.raises(InputError, match="got"):
        Delivery(**delivery)


@pytest.mark.parametrize(
    "throw",
    [
        {"speed": 0},
        {"speed": -1},
        {"speed": 6.1},
        {"speed": float("nan")},
        {"speed": 2, "angle": 1.6},
        {"speed": 2, "angle": float("nan")},
        {"speed": 2, "spin": -21},
        {"speed": 2, "x": float("inf")},
    ],
)
def test_impossible_throws_are_refused(throw):
    with pytest.raises(OutOfRangeError):
        Throw(**throw)


def test_a_sweep_cannot_end_before_it_begins():
    with pytest.raises(InputError, match="sweep_end"):
        Release(x=0, y=0, vx=0, vy=1, sweep_start=3, sweep_end=2)


def test_releases_survive_their_file(tmp_path):
    releases = [
        Release(x=0.1, y=-11, vx=0.01, vy=2.1, theta=0.3, omega=1.1, stone=4, clock=12.5,
                sweep_start=1, sweep_end=4, throw=8),
        Release(x=-0.1, y=11, vx=0.0, vy=-2.0, theta=-0.3, omega=-1.0, order=1, throw=9),
    ]  # fmt: skip
    write_releases(tmp_path / "r.csv", releases)
    assert read_releases(tmp_path / "r.csv") == releases


def test_releases_without_numbers_are_counted(tmp_path):
    write_releases(tmp_path / "r.csv", [Throw(speed=2).release(), Throw(speed=2.1).release()])
    assert [r.throw for r in read_releases(tmp_path / "r.csv")] == [0, 1]


def test_optional_columns_may_be_missing_or_blank(tmp_path):
    (tmp_path / "r.csv").write_text(
        "throw,x,y,vx,vy,theta,omega,stone,clock\n0,0,-11,0,2,0,1,,\n1,0,-11,0,2,0,1,3,60\n"
    )
    first, second = read_releases(tmp_path / "r.csv")
    assert (first.stone, first.clock, first.order) == (0, 0.0, 0)
    assert (second.stone, second.clock, second.order) == (3, 60.0, 1)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("throw,x,y\n", "vx"),
        ("throw,x,y,vx,vy,theta,omega\n", "no release"),
        ("throw,x,y,vx,vy,theta,omega\n0,0,-11,0,2,0,\n", "row 2, column omega"),
        ("throw,x,y,vx,vy,theta,omega\n0,0,-11,0,7,0,0\n", "row 2.*speed"),
        ("throw,x,y,vx,vy,theta,omega\n1,0,-11,0,2,0,0\n1,0,-11,0,2,0,0\n", "row 3.*twice"),
    ],
)
def test_bad_files_are_refused_with_the_place(tmp_path, text, says):
    (tmp_path / "r.csv").write_text(text)
    with pytest.raises(InputError, match=says):
        read_releases(tmp_path / "r.csv")
