"""A lone stone's path against closed forms and an independent integration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.slide import SlideEnd, edge_bounds, play_bounds, slide
from curling_env.presets import paper, standard
from curling_env.sheet import HOG_LINE_Y, Direction
from curling_env.throw import Release, Throw

G = 9.80665
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
    distance = speed ** (2 + exponent) / ((2 + exponent) * mu * G)
    time = speed ** (1 + exponent) / ((1 + exponent) * mu * G)
    # Friction stops rising below 1 cm/s of slip, which the closed form ignores.
    slack = 5e-4 * (exponent > 0) + 1e-5 * distance
    assert path.y + HOG_LINE_Y == pytest.approx(distance, abs=2e-5 + slack)
    assert path.time == pytest.approx(time, abs=2e-4 + 100 * slack)
    if distance > 28.346:
        assert path.trajectory is not None
        y, t = path.trajectory.xy[:, 1] + HOG_LINE_Y, path.trajectory.t
        left = (1 - np.array([21.945, 28.346]) / distance) ** ((1 + exponent) / (2 + exponent))
        assert np.interp([21.945, 28.346], y, t) == pytest.approx((1 - left) * time, abs=1e-3)


def test_a_lateral_slope_drifts_as_it_should() -> None:
    slope, mu = 1e-3 / 4.75, 0.0090
    ice = Ice.uniform(mu).with_effect(ActiveEffect(name="slope", parameters={"x": slope, "y": 0}))
    path = slide(ice, Throw(speed=2.2, angle=0, spin=0).release(), bounds=FAR)
    distance = path.y + HOG_LINE_Y
    assert path.x == pytest.approx(slope * distance / (2 * mu), rel=5e-3)


def reference(ice: Ice, release: Release) -> np.ndarray:
    """x, y, theta of rest and its time: SciPy's DOP853 on the law written out once more."""
    parts = {effect.name: effect.parameters for effect in ice.effects}
    exponent = parts.get("speed_dependent_friction", {}).get("exponent", 0.0)
    drag = parts.get("air_drag", {}).get("coefficient", 0.0)
    curl = parts.get("curl", {}).get("strength", 0.0)
    spin_drag = parts.get("spin_drag", {}).get("rate", 0.0)
    phi = 2 * np.pi * (np.arange(256) + 0.5) / 256
    sine, cosine = np.sin(phi), np.cos(phi)
    r, stone = ice.stone.band_radius, ice.stone

    def rates(_: float, s: np.ndarray) -> np.ndarray:
        v = max(float(np.hypot(s[2], s[3])), 1e-12)
        along, left = v - r * s[5] * sine, r * s[5] * cosine
        slip = np.hypot(along, left)
        pull = np.maximum(slip, 0.01) ** -exponent / slip / 256
        mu = float(ice.mu_at(s[:2])) * G
        force = mu * (pull @ along) + drag * v * v
        torque = mu * stone.mass * r / stone.inertia * (pull @ (left * cosine - along * sine))
        sign = s[5] / np.hypot(s[5], 0.01)
        side = curl * v**0.2 * sign
        tx, ty = s[2] / v, s[3] / v
        turn = -torque - sign * spin_drag * max(v, 0.05) ** -0.6
        return np.array([s[2], s[3], -force * tx - side * ty, -force * ty + side * tx, s[5], turn])

    def stopped(_: float, s: np.ndarray) -> float:
        return max(np.hypot(s[2], s[3]), abs(s[5]) * r) - 1e-3

    stopped.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    start = [release.x, release.y, release.vx, release.vy, release.theta, release.omega]
    done = solve_ivp(
        rates, (0, 100), start, "DOP853", rtol=1e-8, atol=1e-10, max_step=0.03, events=stopped
    )
    return done.y[[0, 1, 4], -1]


@pytest.mark.parametrize("interpolation", ["bilinear", "cell"])
@pytest.mark.parametrize("seed", range(2))
def test_path_on_random_ice_is_that_of_an_independent_integration(
    interpolation: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    ice = standard()
    mu = ice.friction.mu * np.exp(0.05 * rng.standard_normal(ice.friction.mu.shape))
    ice = replace(ice, friction=replace(ice.friction, mu=mu, interpolation=interpolation))
    throw = Throw(speed=rng.uniform(1.0, 2.1), angle=rng.uniform(-0.02, 0.02), spin=2.0 - seed * 4)
    expected = reference(ice, throw.release())
    path = slide(ice, throw.release())
    assert (path.x, path.y) == pytest.approx(expected[:2], abs=TOLERANCE[interpolation])
    assert path.theta == pytest.approx(expected[2], abs=5e-3)


TOLERANCE = {"bilinear": 3e-4, "cell": 6e-4}
"""The reference itself misses the edges of constant cells by a part of its step [m]."""


def test_samples_lie_on_the_path_and_do_not_change_it() -> None:
    release = Throw(speed=2.05, angle=0.01, spin=1.2).release()
    path, sampled = slide(standard(), release), slide(standard(), release, fps=60)
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
    assert np.abs(jerk).max() < 1e-4  # no jumps where strides meet


@given(st.floats(0.05, 3.0), st.floats(-4, 4), st.floats(-0.03, 0.03))
def test_the_stone_only_loses_energy(speed: float, spin: float, angle: float) -> None:
    ice = replace(standard(), effects=(standard().effects[0], standard().effects[1]))
    path = slide(ice, Throw(speed=speed, angle=angle, spin=spin).release(), bounds=FAR, fps=20)
    track = path.trajectory
    assert track is not None
    steps = np.hypot(*np.diff(track.xy, axis=0).T)
    assert (np.diff(steps) <= 1e-6).all()
    assert path.end == SlideEnd.REST


@given(st.floats(1.0, 2.2), st.floats(-3, 3), st.floats(-0.03, 0.03))
def test_mirror_image_and_half_turn(speed: float, spin: float, angle: float) -> None:
    path = slide(standard(), Throw(speed=speed, angle=angle, spin=spin).release(), bounds=FAR)
    mirror = slide(standard(), Throw(speed=speed, angle=-angle, spin=-spin).release(), bounds=FAR)
    assert (-mirror.x, mirror.y, -mirror.theta) == pytest.approx(
        (path.x, path.y, path.theta), abs=1e-9
    )
    home = Throw(speed=speed, angle=angle, spin=spin).release(Direction.HOME)
    back = slide(standard(), home, bounds=FAR)
    assert (-back.x, -back.y) == pytest.approx((path.x, path.y), abs=1e-6)


def test_a_stone_that_leaves_is_stopped_at_the_bounds() -> None:
    ice = paper()
    path = slide(ice, Throw(speed=2.0, angle=0, spin=0).release())
    assert path.end == SlideEnd.LEFT_BOUNDS
    assert path.y == pytest.approx(edge_bounds(ice)[3], abs=1e-5)
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


def test_sweeping_carries_the_stone_as_far_as_its_factor_says() -> None:
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
        slide(paper(), Release(x=3.0, y=0, vx=0, vy=1))
