"""Costs of small errors of a throw, checked by throwing them one by one."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from agents.planning import RestAtTarget, find_throws
from agents.planning.error_costs import error_costs
from curling_env.ice import load_ice
from curling_env.physics import slide
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import Throw
from curling_env.units import brooms


def objective(direction=Direction.AWAY, stones=()):
    return RestAtTarget(
        target=np.array([0.0, direction * TEE_Y]),
        direction=direction,
        stones=np.array(stones, dtype=float).reshape(-1, 2),
    )


def draw(ice, wanted) -> Throw:
    speed, angle, spin, x, *_ = find_throws(ice, wanted.target, spins=(1.0,))[0].tolist()
    return Throw(speed=speed, angle=angle, spin=spin, x=x)


def hog_to_hog(ice, throw, direction) -> float:
    path = slide(ice, throw.release(direction), fps=200.0).trajectory
    assert path is not None
    return float(np.interp(HOG_LINE_Y, direction * path.xy[:, 1], path.t))


@pytest.mark.parametrize("direction", list(Direction))
def test_the_errors_are_a_tenth_of_a_second_and_half_a_broom(direction):
    ice, wanted = load_ice("standard"), objective(direction)
    throw = draw(ice, wanted)
    heavier, lighter, left, right = error_costs(ice, throw, wanted)
    exact = hog_to_hog(ice, throw, direction)
    assert hog_to_hog(ice, heavier.throw, direction) == pytest.approx(exact - 0.1, abs=0.004)
    assert hog_to_hog(ice, lighter.throw, direction) == pytest.approx(exact + 0.1, abs=0.004)
    far = TEE_Y + HOG_LINE_Y
    brooms_m = [-far * np.tan(cost.throw.angle) for cost in (left, right)]
    assert np.diff(brooms_m)[0] == pytest.approx(0.2)  # half a broom to either side
    for cost in (heavier, lighter, left, right):
        rest = slide(ice, cost.throw.release(direction))
        assert hypot(rest.x - cost.rest[0], rest.y - cost.rest[1]) < 0.01
    assert heavier.short < -0.15 < 0.15 < lighter.short
    assert left.right < -0.05 < 0.05 < right.right
    assert "long" in heavier.words()
    assert "short" in lighter.words()
    assert "left" in left.words()
    assert "right" in right.words()


def test_a_stone_in_the_way_costs_all():
    ice = load_ice("standard")
    throw = draw(ice, objective())
    path = slide(ice, throw.release(), fps=20.0).trajectory
    half_way = path.xy[np.searchsorted(path.xy[:, 1], 14.0)]
    beside = half_way + np.array([0.32, 0.0])  # the exact throw passes it by 3 cm
    costs = {cost.error: cost for cost in error_costs(ice, throw, objective(stones=[beside]))}
    assert costs["half a broom right"].miss > 2 * costs["half a broom left"].miss


def test_a_stone_that_stops_short_has_no_time():
    ice = load_ice("standard")
    costs = error_costs(ice, Throw(speed=1.2, spin=1.0), objective())
    assert [cost.error for cost in costs] == ["half a broom left", "half a broom right"]


def test_brooms_are_formatted_to_the_half():
    assert brooms(0.0) == "0 brooms"
    assert brooms(-0.1) == "½ broom"
    assert brooms(0.2) == "1 broom"
    assert brooms(1.1) == "5½ brooms"
