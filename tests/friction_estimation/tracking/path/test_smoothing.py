"""The smoother is close to the truth, has honest errors, and ignores outliers."""

from __future__ import annotations

import numpy as np

from friction_estimation.tracking.path.smoothing import smooth


def slide(n=400, seed=3, noise=0.01):
    t = np.arange(n) / 30
    truth = 2.0 * t - 0.04 * t**2
    return t, truth, truth + np.random.default_rng(seed).normal(0, noise, n)


def test_a_smooth_slide_is_found_far_below_the_noise():
    t, truth, measured = slide()
    result = smooth(t, measured, np.full(len(t), 0.01))
    assert np.sqrt(np.mean((result.value - truth) ** 2)) < 0.003
    assert np.abs(result.change[50:-50] + 0.08).max() < 0.05


def test_the_scale_of_the_errors_is_found_from_the_data():
    t, _, measured = slide()
    result = smooth(t, measured, np.full(len(t), 0.001))  # claimed ten times too good
    assert 7 < result.scale < 14


def test_the_standard_error_is_true():
    inside = []
    for seed in range(12):
        t, truth, measured = slide(seed=seed)
        result = smooth(t, measured, np.full(len(t), 0.01))
        inside.append(np.mean(np.abs(result.value - truth) < 1.96 * result.sigma))
    assert 0.85 < np.mean(inside) <= 1.0


def test_outliers_and_missing_frames_do_no_harm():
    t, truth, measured = slide()
    wild = np.random.default_rng(1).choice(len(t), 20, replace=False)
    measured[wild] += 0.5
    measured[200:230] = np.nan
    result = smooth(t, measured, np.full(len(t), 0.01))
    assert not result.used[wild].any()
    assert not result.used[200:230].any()
    assert np.abs(result.value - truth).max() < 0.015
    assert result.sigma[215] > result.sigma[100]
