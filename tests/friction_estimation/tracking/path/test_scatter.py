"""Where places scatter as those of no stone do, and how far they may be off there."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from friction_estimation.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.path.scatter import scatter_sigma, scattered, without_wild

CAMERA = Camera.looking_at(
    position=(0.0, 0.0, 20.0), target=(0.0, 0.1, 0.0), focal_px=400.0, size=(1280, 720)
)
T = np.arange(0, 16, 1 / 15)


def places(noise, off=0.0):
    """Of a stone that is pushed for a second, slides, and rests from 13 s on."""
    speed = np.interp(T, [0, 1, 13], [1.0, 1.6, 0.0])
    y = -11 + np.cumsum(speed) / 15 + off
    xy = np.column_stack([0.002 * T**2, y]) + np.random.default_rng(3).normal(0, noise, (len(T), 2))
    return [SimpleNamespace(xy=place) for place in xy]


@pytest.mark.parametrize("noise", [0.0, 0.003, 0.03])
def test_no_stone_that_slides_and_comes_to_rest_scatters(noise):
    assert scattered(T, places(noise), CAMERA, 0.0) == []


def test_places_that_jump_to_and_fro_count_for_little_and_so_do_those_between():
    off = 0.3 * (((T > 5) & (T < 7)) | ((T > 7.4) & (T < 9)))
    (one,) = scattered(T, places(0.003, off), CAMERA, 0.0)
    assert 4.4 < one.first < 5.1
    assert 8.9 < one.last < 9.6
    sigma = scatter_sigma(T, [one])
    within = (T > 5) & (T < 9)
    assert (sigma[within] > 0.15).all()
    assert not sigma[(T < 4.4) | (T > 9.6)].any()


def test_far_from_the_camera_half_a_pixel_is_no_sign():
    far = Camera.looking_at(
        position=(0.0, -60.0, 4.0), target=(0.0, 0.0, 0.0), focal_px=900.0, size=(1280, 720)
    )
    off = 0.08 * ((T > 6) & (T < 7))
    assert scattered(T, places(0.003, off), CAMERA, 0.0)
    assert scattered(T, places(0.003, off), far, 0.0) == []


def test_few_places_tell_nothing():
    fits = [*places(0.0)[: tuning.LEAST_SCATTERED], None]
    assert scattered(T[: len(fits)], fits, CAMERA, 0.0) == []


def test_what_jumps_for_seconds_is_left_out_and_what_is_hit_is_not():
    off = 0.6 * ((T > 5) & (T < 9) & (np.arange(len(T)) % 3 == 0))
    fits = places(0.003, off)
    stretches = scattered(T, fits, CAMERA, 0.0)
    (one,) = stretches
    assert one.is_wild
    left = without_wild(T, fits, stretches)
    out = np.array([fit is None for fit in left])
    assert out[(T > 5) & (T < 9)].all()
    assert not out[(T < 4.4) | (T > 9.6)].any()
    assert all(kept is fit for kept, fit in zip(left, fits, strict=True) if kept is not None)

    # The fastest takeout: from 4 m/s to rest within a frame.
    xy = np.column_stack([np.zeros(len(T)), 4.0 * np.minimum(T, 4.0)])
    stopped = [SimpleNamespace(xy=place) for place in xy]
    assert without_wild(T, stopped, scattered(T, stopped, CAMERA, 0.0)) == stopped
