"""The engine, whose contacts pymunk solves, compared with the batch, which solves its own.

Both slide stones in the same way. `play_finely` of the conftest, which shares nothing with them but
the law, checks the path of several stones that move at once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import ks_2samp

from curling_env.ice import Ice, load_ice
from curling_env.physics import (
    FINE_TOLERANCE,
    Engine,
    Outcome,
    Positions,
    Status,
    StoneState,
    play_batch,
    play_bounds,
    slide,
)
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Release, Throw


def in_batch(ice: Ice, stones: np.ndarray, release: Release) -> Positions:
    bounds = play_bounds(ice, Direction.AWAY)
    return play_batch(ice, stones[None], [release], bounds=bounds, tolerance=FINE_TOLERANCE)


def in_engine(ice: Ice, stones: np.ndarray, release: Release) -> Outcome:
    lying = [StoneState(x=float(x), y=float(y)) for x, y in stones]
    return Engine(ice).play(release, lying)


def ends(outcome: Outcome) -> np.ndarray:
    """Return the places where the stones rest or left."""
    return np.array([(s.x, s.y) for s in outcome.stones])


@pytest.mark.parametrize("seed", range(12))
def test_lone_throws_agree_to_a_tenth_of_a_millimetre(seed, draw_ice, draw_release) -> None:
    rng = np.random.default_rng(100 + seed)
    ice, release = draw_ice(rng), draw_release(rng, 1.0)
    batch = in_batch(ice, np.empty((0, 2)), release)
    engine = in_engine(ice, np.empty((0, 2)), release)
    assert np.hypot(*(batch.last[0, -1] - ends(engine)[-1])) < 1e-4
    assert batch.time[0] == pytest.approx(engine.ends[-1], abs=0.02)
    gone = engine.delivered_status in (Status.OUT_SIDE, Status.OUT_BACK)
    assert gone == np.isnan(batch.xy[0, -1, 0])


def hit(rng: np.random.Generator, ice: Ice) -> tuple[np.ndarray, Release]:
    """A stone in the way of a throw, anywhere from full on to a graze."""
    release = Throw(
        speed=rng.uniform(2.2, 3.0), angle=rng.uniform(-0.02, 0.02), spin=rng.uniform(-3, 3)
    ).release()
    bounds = play_bounds(ice, Direction.AWAY)
    bounds[3] = rng.uniform(TEE_Y - 3, TEE_Y + 1)
    there = slide(ice, release, bounds=bounds)
    side = rng.uniform(-1.9, 1.9) * ice.stone.radius
    return np.array([[there.x + side, there.y]]), release


@pytest.mark.parametrize("seed", range(16))
def test_one_collision_agrees_to_a_millimetre(seed, draw_ice) -> None:
    rng = np.random.default_rng(200 + seed)
    ice = draw_ice(rng)
    stones, release = hit(rng, ice)
    batch, engine = in_batch(ice, stones, release), in_engine(ice, stones, release)
    assert batch.collisions[0] == 1
    off = np.hypot(*(batch.last[0] - ends(engine)).T).max()
    # A thin hit magnifies what the paths are off by: by how much, a nudge of 1 µm tells.
    nudged = in_batch(ice, stones + np.array([1e-6, 0.0]), release)
    magnified = np.hypot(*(nudged.last[0] - batch.last[0]).T).max() / 1e-6
    assert off < max(1e-3, 2e-5 * magnified)


@pytest.mark.parametrize("seed", range(10))
def test_collisions_agree_with_small_steps_and_textbook_impulses(seed, play_finely) -> None:
    rng = np.random.default_rng(300 + seed)
    ice = load_ice("standard")
    stones, release = hit(rng, ice)
    struck = stones[0] + np.array([rng.uniform(-0.3, 0.3), rng.uniform(0.5, 1.0)])
    stones = np.vstack([stones, struck])
    bounds = play_bounds(ice, Direction.AWAY)
    fine = play_finely(ice, stones, release, bounds)
    nudged = play_finely(ice, stones + np.array([1e-6, 0.0]), release, bounds)
    allowed = max(1e-3, 4e-5 * np.hypot(*(nudged - fine).T).max() / 1e-6)
    for places in (in_batch(ice, stones, release).last[0], ends(in_engine(ice, stones, release))):
        assert np.hypot(*(places - fine).T).max() < allowed


def test_positions_agree_in_distribution(rng, draw_ice) -> None:
    ice = draw_ice(rng)
    throws, moved, left, alike = 120, ([], []), ([], []), 0
    grid = np.array([[x, TEE_Y + y] for x in (-0.55, 0.0, 0.55) for y in (-0.9, 0.0, 0.9)])
    for _ in range(throws):
        stones = (grid + rng.uniform(-0.12, 0.12, grid.shape))[rng.permutation(9)[:8]]
        release = replace(
            Throw(speed=rng.uniform(2.2, 3.2), angle=rng.normal(0, 0.02), spin=1.0).release(),
            omega=rng.choice([-1.5, 1.5]),
        )
        places = in_batch(ice, stones, release).last[0], ends(in_engine(ice, stones, release))
        alike += np.hypot(*(places[0] - places[1]).T).max() < 0.02
        for way in range(2):
            moved[way].extend(np.hypot(*(places[way][:8] - stones).T))
            left[way].append((places[way][:, 1] > TEE_Y + 1.9).sum())
    # In the few others a hair's breadth decided, either way alike.
    assert alike > 0.97 * throws
    assert ks_2samp(*moved, method="asymp").pvalue > 0.05
    assert np.mean(left[0]) == pytest.approx(np.mean(left[1]), abs=0.1)
