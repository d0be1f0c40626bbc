"""Obstacles of a sliding stone: even the slightest contact is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import load_ice
from curling_env.physics import FINE_TOLERANCE, play_batch, throw_batch
from curling_env.throw import Throw


@pytest.mark.parametrize(("gap", "touched"), [(-5e-5, True), (5e-5, False)])
def test_contact_with_a_stone_near_the_path_is_exact_to_a_twentieth_of_a_millimetre(
    rng, gap, touched
) -> None:
    ice = load_ice("standard")
    mu = ice.friction.mu * np.exp(0.04 * rng.standard_normal(ice.friction.mu.shape))
    ice = replace(ice, friction=replace(ice.friction, mu=mu))
    releases = [
        Throw(speed=v, angle=a, spin=w).release()
        for v, a, w in rng.uniform([1.6, -0.02, -2], [3.2, 0.02, 2], (60, 3))
    ]
    alone = throw_batch(ice, releases, fps=20, tolerance=FINE_TOLERANCE)
    assert alone.paths is not None
    stones = np.empty((len(releases), 1, 2))
    for stone, path in zip(stones, alone.paths[:, :, :2], strict=True):
        path = path[np.isfinite(path[:, 0])]
        k = int(rng.integers(len(path) // 4, len(path) - 20))
        along = path[k + 1] - path[k - 1]
        aside = np.array([-along[1], along[0]]) / np.hypot(*along) * rng.choice([-1, 1])
        stone[0] = path[k] + aside * (2 * ice.stone.radius + gap)
    after = play_batch(ice, stones, releases, tolerance=FINE_TOLERANCE)
    assert ((after.collisions > 0) == touched).all()
