"""The kernels of pictures do what libraries and sums written out do."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from friction_estimation.appearance import channels_of
from friction_estimation.appearance.kernels.picture_kernels import blur
from friction_estimation.appearance.shape import FINE

ROWS, COLUMNS, SIGMA = 24, 30, 1.3


def test_channels_are_those_of_the_standard(rng) -> None:
    picture = rng.integers(0, 256, (7, 9, 3)).astype(np.uint8)
    channels = channels_of(picture).reshape(-1, 3)
    expected = cv2.cvtColor(picture, cv2.COLOR_BGR2YCrCb).reshape(-1, 3).astype(float)
    # OpenCV rounds twice, gives red before blue, and adds 128 to both.
    assert channels[:, 0] == pytest.approx(expected[:, 0], abs=0.51)
    assert channels[:, 1] == pytest.approx(expected[:, 2] - 128, abs=1.0)
    assert channels[:, 2] == pytest.approx(expected[:, 1] - 128, abs=1.0)


def blurred(planes: np.ndarray, shift_u: float, shift_v: float, *, sloped: bool) -> np.ndarray:
    out = np.zeros((len(planes), 3, ROWS, COLUMNS), dtype=np.float32)
    blur(planes, ROWS, COLUMNS, SIGMA, shift_u, shift_v, sloped, out)
    return out


@pytest.fixture
def planes(rng) -> np.ndarray:
    rough = rng.normal(size=(2, ROWS * FINE, COLUMNS * FINE))
    return np.array([gaussian_filter(plane, 3.0) for plane in rough], dtype=np.float32)


def test_fine_planes_are_blurred_to_pixels_as_by_a_gaussian(planes) -> None:
    found = blurred(planes, 0.0, 0.0, sloped=False)[:, 0]
    for plane, pixels in zip(planes, found, strict=True):
        fine = gaussian_filter(plane.astype(float), SIGMA * FINE, mode="nearest", truncate=6.0)
        centres = 0.5 * (fine[::FINE, ::FINE] + fine[1::FINE, 1::FINE])
        across = 0.5 * (fine[1::FINE, ::FINE] + fine[::FINE, 1::FINE])
        assert pixels == pytest.approx(0.5 * (centres + across), abs=0.02 * np.ptp(fine))


def test_slopes_are_those_of_the_shift(planes) -> None:
    found = blurred(planes, 0.2, -0.3, sloped=True)
    step = 0.01
    along_u = blurred(planes, 0.2 + step, -0.3, sloped=False)[:, 0]
    along_u -= blurred(planes, 0.2 - step, -0.3, sloped=False)[:, 0]
    along_v = blurred(planes, 0.2, -0.3 + step, sloped=False)[:, 0]
    along_v -= blurred(planes, 0.2, -0.3 - step, sloped=False)[:, 0]
    size = float(np.abs(found[:, 1:]).max())
    assert np.sign(np.vdot(found[:, 1], along_u)) == np.sign(np.vdot(found[:, 2], along_v))
    for slope, change in ((found[:, 1], along_u), (found[:, 2], along_v)):
        assert np.abs(slope) == pytest.approx(np.abs(change) / (2 * step), abs=0.03 * size)
