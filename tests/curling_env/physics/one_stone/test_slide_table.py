"""Whole slides from a table: the same paths as step by step."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, load_ice
from curling_env.physics import BatchEngine, compile_law, play_bounds, release_table
from curling_env.physics.one_stone.slide_table import slide_table
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Throw


@pytest.mark.parametrize("name", ["standard", "fcv1"])
def test_throws_end_where_small_steps_say(name):
    rng = np.random.default_rng(3)
    n = 250
    ice = load_ice(name)
    bounds = play_bounds(ice, Direction.AWAY)
    stones = np.full((n, 3, 2), np.nan)
    places = rng.uniform([-0.9, -1.2], [0.9, 0.6], (n, 2)) + np.array([0.0, TEE_Y])
    stones[n // 4 :, 0] = places[n // 4 :]
    stones[:, 1:] = [[1.6, TEE_Y + 1.2], [-1.6, TEE_Y + 1.2]]
    speed, spin = rng.uniform(1.9, 3.2, n), rng.uniform(-2.5, 2.5, n)
    angle = 0.04 * np.sign(spin) + rng.normal(0.0, 0.01, n)
    throws = [Throw(speed=v, angle=a, spin=w) for v, a, w in zip(speed, angle, spin, strict=True)]
    releases = release_table([throw.release() for throw in throws])
    tabled = BatchEngine(ice, tabulated=True)
    assert tabled._slides is not None
    found = tabled.play(stones, releases, bounds=bounds)
    fine = BatchEngine(ice, tolerance=1e-5).play(stones, releases, bounds=bounds)
    assert np.array_equal(np.isnan(found.xy), np.isnan(fine.xy))
    assert np.array_equal(found.collisions, fine.collisions)
    off = np.nanmax(np.hypot(*(found.last - fine.last).transpose(2, 0, 1)), axis=1)
    turned = np.abs(found.theta - fine.theta)[:, -1]
    alone, once = fine.collisions == 0, fine.collisions == 1
    assert alone.sum() > 50
    assert once.sum() > 30
    assert off[alone].max() < 2e-4
    assert np.nanmax(turned[alone]) < 2e-3
    assert np.abs(found.time - fine.time)[alone].max() < 0.01
    assert off[once].max() < 1e-3
    assert np.median(off[once]) < 1e-4


def test_slides_that_follow_more_than_speed_and_spin_have_no_table():
    even = load_ice("standard")
    drifting = even.with_effect(ActiveEffect(name="time_drift", parameters={"rate": 1e-4}))
    tilted = even.with_effect(ActiveEffect(name="slope", parameters={"x": 1e-4, "y": 0.0}))
    assert slide_table(compile_law(even, tabulated=True)) is not None
    assert slide_table(compile_law(even)) is None
    for ice in (drifting, tilted):
        assert slide_table(compile_law(ice, tabulated=True)) is None
    rough = even.friction.mu * np.linspace(0.9, 1.1, even.friction.mu.size).reshape(
        even.friction.mu.shape
    )
    law = compile_law(even, tabulated=True)._replace(mu=rough, patterned=True)
    assert slide_table(law) is None


def test_the_same_law_has_the_same_table_and_another_one_another():
    tables = [
        slide_table(compile_law(load_ice(name), tabulated=True))
        for name in ("standard", "standard", "fcv1")
    ]
    assert tables[0] is tables[1]
    assert not np.array_equal(tables[0], tables[2])
