"""Tails of an athlete's errors, compared with the true ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agents.coaching.athletes import squared_distances, tails_of


def sizes_of(tails, throws, seed):
    """Return squared sizes of errors (3 components) whose spreads are 1, by SciPy's formulas."""
    rng = np.random.default_rng(seed)
    squares = rng.chisquare(3, throws)
    if tails < math.inf:
        squares *= (tails - 2) / rng.chisquare(tails, throws)
    return squares, np.full(throws, 3)


def test_normal_errors_have_no_tails():
    assert [tails_of(*sizes_of(math.inf, n, n)) for n in (2, 10, 60, 400)] == [math.inf] * 4


@pytest.mark.parametrize("tails", [3.0, 5.0])
def test_the_degrees_of_freedom_are_found(tails):
    found = [tails_of(*sizes_of(tails, 400, seed)) for seed in range(5)]
    assert np.median(found) == pytest.approx(tails, rel=0.25)


def test_a_wrong_common_spread_makes_no_tails():
    squares, count = sizes_of(math.inf, 200, 1)
    assert tails_of(4 * squares, count) == math.inf


def test_sizes_count_measured_components_with_their_errors():
    errors = np.array([[2.0, 0.0, 0.0], [np.nan, 3.0, np.nan], [np.nan, np.nan, np.nan]])
    variances = np.tile(np.diag([3.0, 0.0, 0.0]), (3, 1, 1))
    sizes, count = squared_distances(
        errors, variances, np.array([0, 1, 0]), np.array([[0.0] * 3, [0.0, 1.0, 0.0]]),
        np.array([np.eye(3), 4 * np.eye(3)]),
    )  # fmt: skip
    assert sizes == pytest.approx([1.0, 1.0, 0.0])
    assert count.tolist() == [3, 1, 0]
    assert tails_of(sizes[2:], count[2:]) == math.inf
