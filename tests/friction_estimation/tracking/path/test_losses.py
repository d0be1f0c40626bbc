"""A track that stops as no stone does has stayed behind."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from friction_estimation.camera import Camera
from friction_estimation.tracking.path.losses import left_behind, sudden_loss
from friction_estimation.tracking.path.scatter import Scattered

CAMERA = Camera.looking_at(
    position=(0.0, 0.0, 20.0), target=(0.0, 0.1, 0.0), focal_px=400.0, size=(1280, 720)
)
"""A pixel is 5 cm."""
T = np.arange(0, 24, 1 / 15)
SLOWS = 0.1


def slid(until=np.inf, noise=0.004):
    """Places of a stone that slides to its rest at 20 s, and of a track that soon halts."""
    moving = np.minimum(T, 20.0)
    y = -11 + 2.0 * moving - 0.5 * SLOWS * moving**2
    if until < T[-1]:
        pace, halts = 2.0 - SLOWS * until, 0.5
        since = np.clip(T - until, 0, pace / halts)
        y = np.where(until > T, y, np.interp(until, T, y) + pace * since - 0.5 * halts * since**2)
    xy = np.column_stack([0.0 * T, y]) + np.random.default_rng(5).normal(0, noise, (len(T), 2))
    return [SimpleNamespace(xy=place) for place in xy]


@pytest.mark.parametrize("noise", [0.0, 0.004, 0.05])
def test_a_stone_that_comes_to_rest_on_ice_is_not_left_behind(noise):
    assert left_behind(T, slid(noise=noise), CAMERA, 0.0, []) is None


def test_a_track_that_halts_says_how_far_the_stone_may_have_slid_on():
    fits = slid(until=14.0)
    found = left_behind(T, fits, CAMERA, 0.0, [])
    assert found is not None
    assert 12.5 < found.since < 14.2
    by = found.by(T, np.array([fit.xy for fit in fits]))
    rest = 0.5 * 0.6**2 * (1 / SLOWS - 1 / 0.5)
    assert by[-1] == pytest.approx(rest, rel=0.4)
    assert not by[T < 12.5].any()


def test_what_is_less_than_a_pixel_tells_nothing():
    far = Camera.looking_at(
        position=(0.0, 0.0, 400.0), target=(0.0, 0.1, 0.0), focal_px=400.0, size=(1280, 720)
    )
    assert left_behind(T, slid(until=16.0), far, 0.0, []) is None


def test_what_stops_at_once_was_hit_and_is_not_left_behind():
    fits = slid()
    for t, fit in zip(T, fits, strict=True):
        if t > 12:
            fit.xy[1] = fits[180].xy[1] + 0.1 * (fit.xy[1] - fits[180].xy[1])
    assert sudden_loss(T, fits, CAMERA, 0.0) == pytest.approx(12.0, abs=0.2)
    assert left_behind(T, fits, CAMERA, 0.0, []) is None


def test_places_that_scatter_tell_no_speed():
    jumpy = [Scattered(first=12.5, last=15.0, by=0.2)]
    assert left_behind(T, slid(until=14.0), CAMERA, 0.0, jumpy) is None


def test_what_a_hand_stops_is_no_track_left_behind():
    assert left_behind(T, slid(until=4.0), CAMERA, 0.0, []) is None
