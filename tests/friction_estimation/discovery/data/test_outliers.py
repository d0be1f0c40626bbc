"""The slow part of a series, and what is left of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from friction_estimation.discovery.data.outliers import fast_series, robust_deviation, slow_basis


def test_slow_shapes_are_cosines_of_half_waves_and_a_parabola():
    t = 4.0 + np.linspace(0.0, 12.0, 200)
    basis = slow_basis(t)
    phase = np.pi * (t - 4.0) / 12.0
    assert basis.shape == (200, 16)  # a constant, 13 half-waves, and two more
    for k in range(14):
        assert basis[:, k] == pytest.approx(np.cos(k * phase), abs=1e-12)
    assert basis[:, 14:] == pytest.approx(np.column_stack([phase, phase**2]))
    assert slow_basis(t, 6.0).shape == (200, 8)
    assert slow_basis(t[:9]).shape == (9, 4)
    assert slow_basis(np.zeros(2)).shape == (2, 3)


def test_the_robust_deviation_is_that_of_a_normal_distribution():
    values = norm.ppf((np.arange(2001) + 0.5) / 2001)
    assert robust_deviation(3.0 * values) == pytest.approx(3.0, rel=1e-3)
    values[:600] = 1e9
    assert robust_deviation(values) < 3.0


def test_a_fast_series_has_no_motion_and_keeps_its_jumps():
    t = np.arange(0.0, 20.0, 0.05)
    motion = 2.0 * t - 0.05 * t**2 + 0.3 * np.sin(2 * np.pi * t / 4.0)
    inner = (t > 1.0) & (t < 19.0)
    assert np.abs(fast_series(t, motion)[inner]).max() < 2e-3
    jumped = motion.copy()
    jumped[200] += 0.5
    left = fast_series(t, jumped)
    assert left[200] == pytest.approx(0.5, abs=0.01)
    others = inner & (np.arange(len(t)) != 200)
    assert np.abs(left[others]).max() < 5e-3  # the second fit goes without it
    # Two thirds of a second off its place is a shadow, and no noise of single rows.
    shadow = motion + np.where((t > 8.0) & (t < 9.5), 0.05, 0.0)
    assert np.median(np.abs(fast_series(t, shadow)[(t > 8.5) & (t < 9.0)])) < 0.01
