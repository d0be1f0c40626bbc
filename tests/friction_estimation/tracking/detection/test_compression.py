"""A codec that drops small changes shows a slow stone behind its true place."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.detection.compression import CompressionMonitor

SIZE = (240, 480, 3)


def lag(frames):
    """The error that the monitor states after all frames have passed."""
    region = Background(origin_px=(0, 0), image=np.zeros(SIZE, dtype=np.float32), noise=2.0)
    compression = CompressionMonitor(region)
    passed = list(compression.watch([(k / 30, frame) for k, frame in enumerate(frames)]))
    assert [frame is one for (_, frame), one in zip(passed, frames, strict=True)]
    return compression.lag_px


def filmed(rng, *, kept, base=150.0):
    """Frames in each of which a share of the noise is new."""
    frames = [np.full(SIZE, base) + rng.normal(0, 2, SIZE)]
    for _ in range(100):
        fresh = rng.random(SIZE[:2])[..., None] < kept
        frames.append(np.where(fresh, base + rng.normal(0, 2, SIZE), frames[-1]))
    return [np.clip(np.rint(frame), 0, 255).astype(np.uint8) for frame in frames]


def test_noise_that_is_new_in_every_frame_means_no_loss():
    assert lag(filmed(np.random.default_rng(1), kept=1.0)) == 0.0


def test_frames_that_are_copied_whole_mean_the_largest_loss():
    assert lag(filmed(np.random.default_rng(2), kept=0.0)) == pytest.approx(tuning.COPIED_LAG_PX)


def test_the_more_is_copied_the_more_is_lost():
    some, more = (lag(filmed(np.random.default_rng(3), kept=kept)) for kept in (0.03, 0.01))
    assert 0.0 < some < more < tuning.COPIED_LAG_PX


def test_overexposed_ice_shows_nothing():
    assert lag(filmed(np.random.default_rng(4), kept=0.0, base=255.0)) == 0.0
