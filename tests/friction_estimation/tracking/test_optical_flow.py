"""Lucas-Kanade optical flow at one scale and from coarse to fine."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from friction_estimation.tracking import lucas_kanade


def test_only_the_pyramid_follows_a_large_motion():
    rng = np.random.default_rng(0)
    picture = cv2.GaussianBlur(rng.integers(0, 255, (160, 160), dtype=np.uint8), (0, 0), 3)
    picture = cv2.normalize(picture, None, 0, 255, cv2.NORM_MINMAX)
    moved = np.roll(picture, 14, axis=1)
    points = np.array([[80.0, 80.0], [70.0, 60.0], [60.0, 90.0]])
    near, found = lucas_kanade(picture, moved, points, "pyramidal")
    assert found.all()
    assert near - points == pytest.approx(np.tile([14.0, 0.0], (3, 1)), abs=0.2)
    far, plain_found = lucas_kanade(picture, moved, points, "plain")
    assert not (plain_found & (np.abs(far[:, 0] - points[:, 0] - 14) < 0.5)).any()
