"""The table of an ice finds the throws to many places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.playing import AimingTable
from agents.playing.search.tuning import HIT_WEIGHTS
from curling_env.ice import Ice, load_ice
from curling_env.physics import Aim
from curling_env.sheet import Direction
from curling_env.throw import FROM_HACK, FROM_HOG_LINE, Throw


def bumpy() -> Ice:
    ice = load_ice("standard")
    rng = np.random.default_rng(3)
    mu = ice.friction.mu * np.exp(0.03 * rng.standard_normal(ice.friction.mu.shape))
    return replace(ice, friction=replace(ice.friction, mu=mu))


@pytest.mark.parametrize("ice", [load_ice("standard"), bumpy()], ids=["even", "bumpy"])
@pytest.mark.parametrize("direction", Direction)
@pytest.mark.parametrize("delivery", [FROM_HOG_LINE, FROM_HACK], ids=["hog line", "hack"])
def test_the_table_finds_draws_and_hits(ice, direction, delivery):
    table = AimingTable(ice, direction, delivery)
    aim = Aim(ice, direction, delivery=delivery)
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-1.5, 1.5, 30), rng.uniform(-4.5, 1.5, 30)
    for spin in table.spins:
        draws = table.draws(x, y, spin)
        assert np.isfinite(draws).all()
        rests = [aim.rest(Throw(speed=v, angle=a, spin=w)) for v, a, w in draws.tolist()]
        miss = np.hypot(*(np.array(rests) - np.column_stack([x, y])).T)
        # An execution error of `elite` is some 0.2 m.
        assert miss.max() < (0.006 if ice.friction.mu.std() == 0 else 0.08)
        for weight in HIT_WEIGHTS:
            hits = table.hits(x, y, weight, spin)
            for k in range(0, 30, 10):
                speed = min(weight * table.button_speed, delivery.max_speed)
                there = aim.through(x[k], y[k], speed, spin)
                assert there is not None
                assert abs(hits[k, 1] - there.angle) * -delivery.start_y < 0.03


def test_unreachable_targets_give_no_shot():
    table = AimingTable(load_ice("standard"), Direction.AWAY)
    far = table.draws(np.array([0.0, 9.0, 0.0]), np.array([12.0, 0.0, 0.0]), 1.5)
    assert np.isnan(far[:2]).all()
    assert np.isfinite(far[2]).all()
