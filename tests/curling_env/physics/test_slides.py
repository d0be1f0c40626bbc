"""A lone stone's path against closed forms and an independent integration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice, load_ice
from curling_env.physics import FINE_TOLERANCE, QUICK_TOLERANCE, SlideEnd, play_bounds, slide
from curling_env.sheet import HOG_LINE_Y, Direction
from curling_env.throw import Release, Throw

G = 9.80665
SLOWEST_SLIP = 0.01
"""Slip below which friction no longer rises [m/s]."""
FAR = np.array([-50.0, 50.0, -500.0, 500.0])


@pytest.mark.parametrize("exponent", [0.0, 0.25, 0.5])
@pytest.mark.parametrize("speed", [0.5, 2.0, 3.5])
def test_straight_line_closed_forms(exponent: float, speed: float) -> None:
    mu = 0.0085
    effect = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": exponent})
    path = slide(
        Ice.uniform(mu, effects=(effect,)),
        Throw(speed=speed, angle=0, spin=0).release(),
        bounds=FAR,
        fps=200,
    )
    # Friction stops rising below 1 cm/s of slip: the last bit is uniform deceleration.
    n, slow = exponent, SLOWEST_SLIP
    brake = mu * G * slow**-n
    distance = (speed ** (2 + n) - slow ** (2 + n)) / ((2 + n) * mu * G) + slow**2 / (2 * brake)
    time = (speed ** (1 + n) - slow ** (1 + n)) / ((1 + n) * mu * G) + slow / brake
    assert path.y + HOG_LINE_Y == pytest.approx(distance, abs=2e-5)
    assert path.time == pytest.approx(time, abs=1e-3)
    if distance > 28.346:
        assert path.trajectory is not None
        y, t = path.trajectory.xy[:, 1] + HOG_LINE_Y, path.trajectory.t
        full = speed ** (2 + n) / ((2 + n) * mu * G)
        left = (1 - np.array([21.945, 28.346]) / full) ** ((1 + n) / (2 + n))
        gone = (1 - left) * speed ** (1 + n) / ((1 + n) * mu * G)
        assert np.interp([21.945, 28.346], y, t) == pytest.approx(gone, abs=1e-4)


def test_a_lateral_slope_drifts_as_it_should() -> None:
    slope, mu = 1e-3 / 4.75, 0.0090
    ice = Ice.uniform(mu).with_effect(ActiveEffect(name="slope", parameters={"x": slope, "y": 0}))
    path = slide(ice, Throw(speed=2.2, angle=0, spin=0).release(), bounds=FAR)
    distance = path.y + HOG_LINE_Y
    assert path.x == pytest.approx(slope * distance / (2 * mu), rel=5e-3)


@pytest.mark.parametrize("seed", range(24))
def test_rest_on_rough_ice_is_that_of_plain_small_steps(
    seed: int, slide_finely, draw_ice, draw_release
) -> None:
    rng = np.random.default_rng(seed)
    ice, release = draw_ice(rng), draw_release(rng)
    expected = slide_finely(ice, release, FAR)
    assert expected.rests
    for tolerance in (FINE_TOLERANCE, QUICK_TOLERANCE):
        path = slide(ice, release, bounds=FAR, tolerance=tolerance)
        assert np.hypot(path.x - expected.x, path.y - expected.y) < tolerance
        assert path.time == pytest.approx(expected.time, abs=0.02)
        assert path.theta == pytest.approx(expected.theta, abs=10 * tolerance)


def test_samples_are_on_the_path_and_do_not_change_it() -> None:
    release = Throw(speed=2.05, angle=0.01, spin=1.2).release()
    path, sampled = (
        slide(load_ice("standard"), release),
        slide(load_ice("standard"), release, fps=60),
    )
    assert (path.x, path.y, path.theta, path.time) == (
        sampled.x,
        sampled.y,
        sampled.theta,
        sampled.time,
    )
    track = sampled.trajectory
    assert track is not None
    assert np.diff(track.t[:-1]) == pytest.approx(1 / 60, abs=1e-9)
    assert track.xy[-1] == pytest.approx([path.x, path.y], abs=1e-12)
    jerk = np.diff(track.xy[:-1], n=3, axis=0)
    assert np.abs(jerk).max() < 1e-4  # no jumps where steps meet


@given(st.floats(0.05, 3.0), st.floats(-4, 4), st.floats(-0.03, 0.03))
def test_the_stone_only_loses_energy(speed: float, spin: float, angle: float) -> None:
    ice = replace(
        load_ice("standard"),
        effects=(load_ice("standard").effects[0], load_ice("standard").effects[1]),
    )
    path = slide(ice, Throw(speed=speed, angle=angle, spin=spin).release(), bounds=FAR, fps=20)
    track = path.trajectory
    assert track is not None
    steps = np.hypot(*np.diff(track.xy, axis=0).T)
    assert (np.diff(steps) <= 1e-6).all()
    assert path.end == SlideEnd.REST


@given(st.floats(1.0, 2.2), st.floats(-3, 3), st.floats(-0.03, 0.03))
def test_mirror_image_and_half_turn(speed: float, spin: float, angle: float) -> None:
    path = slide(
        load_ice("standard"), Throw(speed=speed, angle=angle, spin=spin).release(), bounds=FAR
    )
    mirror = slide(
        load_ice("standard"), Throw(speed=speed, angle=-angle, spin=-spin).release(), bounds=FAR
    )
    assert (-mirror.x, mirror.y, -mirror.theta) == pytest.approx(
        (path.x, path.y, path.theta), abs=1e-9
    )
    home = Throw(speed=speed, angle=angle, spin=spin).release(Direction.HOME)
    back = slide(load_ice("standard"), home, bounds=FAR)
    assert (-back.x, -back.y) == pytest.approx((path.x, path.y), abs=1e-6)


def test_a_stone_that_leaves_is_stopped_at_the_bounds() -> None:
    ice = load_ice("paper")
    path = slide(ice, Throw(speed=2.0, angle=0, spin=0).release())
    assert path.end == SlideEnd.LEFT_BOUNDS
    assert path.y == pytest.approx(ice.sheet.length / 2 - ice.stone.radius, abs=1e-5)
    assert path.vy == pytest.approx(np.sqrt(4 - 2 * 0.0019 * G * (path.y + HOG_LINE_Y)), rel=1e-5)
    wide = slide(ice, Throw(speed=2.0, angle=0.2, spin=0).release(), bounds=play_bounds(ice, 1))
    assert wide.x == pytest.approx(-play_bounds(ice, Direction.AWAY)[1], abs=1e-5)


def test_a_patch_slows_the_stone_exactly_while_it_is_inside() -> None:
    mu, factor, speed = 0.009, 1.5, 2.0
    where = {"x_min": -2.0, "x_max": 2.0, "y_min": -5.0, "y_max": -2.0, "factor": factor}
    ice = Ice.uniform(mu).with_effect(ActiveEffect(name="friction_patch", parameters=where))
    path = slide(ice, Throw(speed=speed, angle=0, spin=0).release())
    energy = speed**2 / 2 - mu * G * 3.0 * factor
    assert path.y + HOG_LINE_Y == pytest.approx(energy / (mu * G) + 3.0, abs=5e-5)


def test_sweeping_carries_the_stone_by_its_factor() -> None:
    mu, speed = 0.009, 1.9
    ice = Ice.uniform(mu).with_effect(ActiveEffect(name="sweeping"))
    release = replace(Throw(speed=speed, angle=0, spin=0).release(), sweep_start=3.0, sweep_end=9.0)
    v1 = speed - mu * G * 3.0
    v2 = v1 - 0.912 * mu * G * 6.0
    distance = 1.5 * (speed + v1) + 3.0 * (v1 + v2) + v2**2 / (2 * mu * G)
    assert slide(ice, release).y + HOG_LINE_Y == pytest.approx(distance, abs=5e-5)


def test_ice_that_never_lets_go_and_a_start_off_the_ice_are_refused() -> None:
    steep = Ice.uniform(0.001).with_effect(ActiveEffect(name="slope", parameters={"y": 0.004}))
    with pytest.raises(InputError, match="never stops"):
        slide(steep, Throw(speed=1, angle=0, spin=0).release(), bounds=FAR * 1e3)
    with pytest.raises(InputError, match="off the ice"):
        slide(load_ice("paper"), Release(x=3.0, y=0, vx=0, vy=1))


def test_a_sweep_that_begins_on_the_edge_of_a_patch_is_not_missed() -> None:
    patch = {"x_min": -1.0, "x_max": 1.0, "y_min": 0.0, "y_max": 3.0, "factor": 1.1, "edge": 0.0}
    ice = load_ice("standard").with_effect(ActiveEffect(name="friction_patch", parameters=patch))
    ice = ice.with_effect(ActiveEffect(name="sweeping", parameters={"friction_factor": 0.9}))
    throw = Throw(speed=1.9)
    at_edge = slide(ice, throw.release(), bounds=np.array([-9.0, 9.0, -30.0, 0.0])).time
    rests = [
        slide(ice, throw.release(sweep=(at_edge + k * 2e-7, 60.0))).y for k in range(-20, 21, 2)
    ]
    assert np.ptp(rests) < 1e-3
