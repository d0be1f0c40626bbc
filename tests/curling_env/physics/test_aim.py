"""Aimed throws reach their targets, on even and uneven ice and at both ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice, load_ice
from curling_env.physics import FINE_TOLERANCE, NO_BOUNDS, Aim, slide
from curling_env.sheet import HACK_Y, TEE_Y, Direction, to_delivery
from curling_env.throw import FROM_HACK, Release, Throw


def uneven(rng: np.random.Generator) -> Ice:
    ice = load_ice("standard")
    mu = ice.friction.mu * np.exp(0.05 * rng.standard_normal(ice.friction.mu.shape))
    return replace(ice, friction=replace(ice.friction, mu=mu))


def rest_of(ice: Ice, throw: Throw, direction: Direction) -> np.ndarray:
    run = slide(ice, throw.release(direction), bounds=NO_BOUNDS)
    return to_delivery([run.x, run.y], direction)


@pytest.mark.parametrize("direction", Direction)
@pytest.mark.parametrize("target", [(0.0, 0.0), (1.2, -0.8), (-0.5, 1.5)])
def test_a_draw_comes_to_rest_at_its_target(direction, target, rng):
    for ice in (load_ice("standard"), load_ice("paper"), uneven(rng)):
        throw = Aim(ice, direction).draw(*target, 1.5)
        assert rest_of(ice, throw, direction) == pytest.approx(target, abs=3e-3)


def test_on_ice_on_which_no_stone_stops_no_draw_is_found():
    steep = ActiveEffect(name="slope", parameters={"y": 5e-3})
    aim = Aim(Ice.uniform(0.004, effects=(steep,)))
    assert aim.draw(0.0, 0.0, 1.5) is None
    assert aim.draw_weight() is None


def test_a_throw_runs_over_the_point_it_is_aimed_at():
    ice = load_ice("standard")
    throw = Aim(ice).through(0.4, -1.0, 3.0, -1.5)
    bounds = NO_BOUNDS.copy()
    bounds[3] = TEE_Y - 1.0
    assert slide(ice, throw.release(), bounds=bounds).x == pytest.approx(0.4, abs=3e-3)


@pytest.mark.parametrize("spin", [0.0, 1.5])
def test_the_draw_weight_carries_to_the_tee(spin, rng):
    for ice in (load_ice("standard"), load_ice("paper"), uneven(rng)):
        speed = Aim(ice, tolerance=FINE_TOLERANCE).draw_weight(spin)
        run = slide(ice, Throw(speed=speed, spin=spin).release(), bounds=NO_BOUNDS)
        assert run.y == pytest.approx(TEE_Y, abs=2e-4)


def test_the_draw_weight_follows_the_session():
    drift = ActiveEffect(name="time_drift", parameters={"rate": 1e-4})
    ice = load_ice("standard").with_effect(drift)
    early, late = Aim(ice).draw_weight(), Aim(ice, clock=1000.0).draw_weight()
    assert early < late


def test_no_draw_weight_if_no_throw_reaches_the_tee():
    assert Aim(Ice.uniform(0.5)).draw_weight() is None


@pytest.mark.parametrize("direction", Direction)
def test_a_draw_from_the_hack_comes_to_rest_at_its_target(direction, rng):
    for ice in (load_ice("fcv1"), uneven(rng)):
        throw = Aim(ice, direction, delivery=FROM_HACK).draw(0.6, -0.4, 1.57)
        release = Release(
            x=0.0,
            y=-direction * HACK_Y,
            vx=-direction * throw.speed * np.sin(throw.angle),
            vy=direction * throw.speed * np.cos(throw.angle),
            omega=1.57,
        )
        run = slide(ice, release, bounds=NO_BOUNDS)
        assert to_delivery([run.x, run.y], direction) == pytest.approx((0.6, -0.4), abs=3e-3)
        assert throw.speed > Aim(ice, direction).draw(0.6, -0.4, 1.57).speed


def test_nothing_faster_than_the_greatest_speed_is_aimed():
    slow = replace(FROM_HACK, max_speed=2.2)
    assert Aim(load_ice("fcv1"), delivery=FROM_HACK).draw(0.0, 0.0, 1.5).speed > 2.2
    assert Aim(load_ice("fcv1"), delivery=slow).draw(0.0, 0.0, 1.5) is None
