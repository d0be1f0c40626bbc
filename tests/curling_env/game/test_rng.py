"""Random numbers of throws."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.game import ThrowRng


def test_randomness_is_that_of_the_seed_and_the_throw_in_any_order():
    rng = ThrowRng()

    def drawn(seed, throw):
        return rng.at(seed, throw).standard_normal(4).tolist()

    asked = [(seed, throw) for seed in (0, 1, 2**31 - 1, 2**70) for throw in (0, 1, 159)]
    first = {pair: drawn(*pair) for pair in asked}
    assert len({tuple(numbers) for numbers in first.values()}) == len(asked)
    rng.at(5, 5).random(999, dtype=np.float32)  # leaves half a random word unused
    assert {pair: drawn(*pair) for pair in reversed(asked)} == first
    assert ThrowRng().at(1, 159).standard_normal(4).tolist() == first[1, 159]
    numbers = np.array([drawn(seed, throw) for seed in range(40) for throw in range(40)])
    assert abs(numbers.mean()) < 4 / np.sqrt(numbers.size)
    assert numbers.std() == pytest.approx(1.0, abs=0.03)
    neighbours = np.corrcoef(numbers[:-1].ravel(), numbers[1:].ravel())[0, 1]
    assert abs(neighbours) < 4 / np.sqrt(numbers.size)
