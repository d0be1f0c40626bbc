"""Conditions under which throws show a ripple of their camera."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery.search.ripple import split_throws, variety


def test_variety_is_of_speed_and_direction():
    y = np.linspace(-10.0, 10.0, 50)
    square = np.linspace(4.0, 1.0, 50)
    assert variety([y, y], [square, square]) == pytest.approx(0.0, abs=1e-12)
    assert variety([y, y], [square, -square]) == pytest.approx(1.0)
    assert variety([y, y + 40], [square, 2 * square]) == 0.0  # nowhere do two meet
    assert variety([y, y], [square, 2 * square]) == pytest.approx(0.5 / np.sqrt(2.5))


def test_halves_are_alike(rng):
    speeds, directions = rng.uniform(1.3, 2.4, 16), np.repeat([1.0, -1.0], 8)
    one, other = split_throws(speeds, directions)
    assert sorted(one + other) == list(range(16))
    assert directions[one].sum() == directions[other].sum() == 0.0
    assert abs(speeds[one].mean() - speeds[other].mean()) < 0.15
