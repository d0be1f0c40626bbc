"""The noise of measured distances, estimated from residuals."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.inversion import estimate_friction
from friction_estimation.inversion.noise import Noise, estimate_noise


def test_noise_is_found_again(rng):
    t = np.arange(0, 25, 1 / 30)
    fade = np.exp(-1 / 30 / 0.2)
    residuals = []
    for _ in range(6):
        slow = np.zeros(len(t))
        for i in range(1, len(t)):
            slow[i] = fade * slow[i - 1] + rng.normal(0, 0.004 * np.sqrt(1 - fade**2))
        residuals.append((t, slow + rng.normal(0, 0.003, len(t)), np.ones(len(t))))
    found = estimate_noise(residuals)
    assert found.white == pytest.approx(0.003, rel=0.15)
    assert found.slow == pytest.approx(0.004, rel=0.15)
    assert found.time == pytest.approx(0.2, rel=0.35)
    whitened = found.whiten(t, residuals[0][1][:, None], residuals[0][2], np.ones(len(t), bool))
    assert whitened.std() == pytest.approx(1.0, abs=0.1)


def test_white_noise_is_not_taken_for_slow(rng):
    t = np.arange(0, 25, 1 / 30)
    found = estimate_noise([(t, rng.normal(0, 0.005, len(t)), np.ones(len(t))) for _ in range(5)])
    assert found.slow == 0.0
    assert isinstance(found, Noise)


def test_smoothed_track_is_not_taken_for_a_better_one(sliding, rng):
    """A tracker's smoother leaves only slow errors; their size must still be in sigma."""
    normed = []
    for _ in range(6):
        tracks = []
        for rough in sliding.measured_throws(
            sliding.uniform(0.009), sliding.varied_starts(rng, 2), rng, noise=0.01
        ):
            weights = np.hanning(17)[:, None] / np.hanning(17).sum()
            size = len(rough) - 16
            xy = sum(weights[i] * rough.xy[i : i + size] for i in range(17))
            tracks.append(
                Trajectory(t=rough.t[8:-8], xy=xy, theta=rough.theta[8:-8], throw=rough.throw)
            )
        found = estimate_friction(tracks, uniform=True)
        assert found.noise.spacing > 0.1
        normed.append((found.mu - 0.009) / found.sigma)
    assert np.sqrt(np.mean(np.square(normed))) < 2.0
