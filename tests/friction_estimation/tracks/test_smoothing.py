"""Derivatives of a track by local fits."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.tracks import local_fit, smooth_motion

A = 0.09


def test_quadratic_is_read_exactly_at_uneven_times(rng):
    t = np.sort(rng.uniform(0, 10, 200))
    (value, first, second), _ = local_fit(t, 1 + 2 * t - 0.3 * t**2, 1.5)
    assert np.allclose(value, 1 + 2 * t - 0.3 * t**2, atol=1e-6)
    assert np.allclose(first, 2 - 0.6 * t, atol=1e-4)
    assert np.allclose(second, -0.6, atol=1e-2)


def test_error_of_acceleration_is_the_textbook_one(rng):
    """σ_a = σ √(720/(fT))/T² for a quadratic over T at f frames a second."""
    t = np.arange(0, 20, 1 / 30)
    xy = np.column_stack([np.zeros_like(t), 2 * t])
    motion = smooth_motion(t, xy, window=2.0, noise=0.005)
    expected = 0.005 * np.sqrt(720 / (30 * 2.0)) / 2.0**2
    assert motion.acceleration_sigma[len(t) // 2] == pytest.approx(expected, rel=0.1)


def test_speed_is_along_the_path_not_along_the_sheet(rng):
    angle = np.arange(0, 3, 0.02)
    circle = 5 * np.column_stack([np.cos(angle), np.sin(angle)])
    motion = smooth_motion(angle, circle, window=0.2)
    assert np.allclose(motion.speed[10:-10], 5.0, atol=0.01)
    assert np.allclose(motion.acceleration[10:-10], 0.0, atol=0.05)
