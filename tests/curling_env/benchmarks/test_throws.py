"""The throws that `curling bench` makes: fair positions, and the same throw by both programs."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.benchmarks.plain_pymunk import throw_in_pymunk
from curling_env.benchmarks.throws import draws_and_hits, houses, mapped_ice
from curling_env.physics import throw_batch
from curling_env.sheet import TEE_Y


def test_stones_of_a_position_do_not_overlap_in_the_house() -> None:
    for position in houses(np.random.default_rng(3), 20):
        gaps = np.hypot(*(position[:, None] - position).transpose(2, 0, 1))
        assert gaps[~np.eye(len(position), dtype=bool)].min() > 0.3
        assert np.hypot(position[:, 0], position[:, 1] - TEE_Y).max() <= 1.8


def test_plain_pymunk_makes_nearly_the_same_throw() -> None:
    ice, rng = mapped_ice(np.random.default_rng(1)), np.random.default_rng(2)
    draws = draws_and_hits(rng, 5, hits=0.0)
    rests = throw_batch(ice, draws)
    for draw, x, y in zip(draws, rests.x, rests.y, strict=True):
        assert throw_in_pymunk(ice, draw) == pytest.approx((x, y), abs=0.15)
