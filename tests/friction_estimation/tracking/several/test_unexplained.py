"""What nothing explains in a track is told."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from friction_estimation.camera import Camera
from friction_estimation.tracking.path.assembly import Measurements
from friction_estimation.tracking.several.unexplained import (
    strange_ways,
    unexplained,
)

FPS = 15.0
CAMERA = Camera.looking_at(
    position=(0.0, 0.0, 20.0), target=(0.0, 0.1, 0.0), focal_px=400.0, size=(1280, 720)
)
"""A pixel is 5 cm."""


def slid(hit=None, keeps=0.3, noise=0.01, seconds=14.0):
    """Measurements of a stone that slows down on ice, and at a time [s] by a hit."""
    rng = np.random.default_rng(0)
    t = np.arange(0, seconds, 1 / FPS)
    pace = np.maximum(2.6 - 0.11 * t, 0.0)
    if hit is not None:
        pace[t >= hit] *= keeps
    y = -12.0 + np.cumsum(pace) / FPS
    xy = np.column_stack([0.1 * np.sin(t / 8), y]) + rng.normal(0, noise, (len(t), 2))
    fits = [SimpleNamespace(xy=place) for place in xy]
    return Measurements(t=t.tolist(), fits=fits)  # pyright: ignore[reportArgumentType]


def test_a_stone_that_loses_speed_at_once_has_hit_something():
    (said,) = strange_ways(CAMERA, slid(hit=10.0))
    assert "at 10.0 s" in said or "at 9.9 s" in said
    assert strange_ways(CAMERA, slid(hit=10.0), [10.02]) == ()


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
def test_a_stone_that_is_left_alone_has_not(noise):
    assert strange_ways(CAMERA, slid(noise=noise)) == ()


def test_a_place_that_is_wrong_for_a_moment_is_no_hit():
    """Beside a broom a place may be off by half a pixel, and the stone goes on as before."""
    higher = Camera.looking_at(
        position=(0.0, 0.0, 50.0), target=(0.0, 0.1, 0.0), focal_px=400.0, size=(1280, 720)
    )
    measured = slid(noise=0.002)
    bump = 0.06 * np.exp(-(((np.array(measured.t) - 9.0) / 0.2) ** 2))
    for fit, off in zip(measured.fits, bump, strict=True):
        fit.xy[1] += off  # pyright: ignore[reportOptionalMemberAccess]
    t, y = np.array(measured.t), np.array([fit.xy[1] for fit in measured.fits if fit])
    pace = [
        np.polyfit(t[part], y[part], 1)[0] for part in ((t > 8.6) & (t < 9), (t > 9) & (t < 9.4))
    ]
    assert pace[0] - pace[1] > 0.35
    assert strange_ways(higher, measured) == ()


def test_where_now_a_stone_and_now_a_broom_is_measured_is_told():
    measured = slid(noise=0.002)
    for k, fit in enumerate(measured.fits):
        beside = 90 <= k < 102 or 108 <= k < 126 or 130 <= k < 150
        fit.xy[1] += 0.25 * beside  # pyright: ignore[reportOptionalMemberAccess]
    (said,) = strange_ways(CAMERA, measured)
    assert "scatter" in said
    assert said.startswith(("from 5.5", "from 5.6", "from 5.7"))


def test_what_is_left_out_is_told_beside_a_contact_too_and_of_every_stone():
    measured = slid(noise=0.002)
    for k, fit in enumerate(measured.fits):
        fit.xy[1] += 0.6 * (90 <= k < 150 and k % 3 == 0)  # pyright: ignore[reportOptionalMemberAccess]
    (said,) = strange_ways(CAMERA, measured, [10.2])
    assert said.endswith("and they are left out")
    thrown = SimpleNamespace(measured=slid(), rested=None)
    hit = SimpleNamespace(measured=measured, rested=SimpleNamespace(xy=np.array([0.1, 9.0])))
    path = SimpleNamespace(xy=np.array([[0.1, 9.0], [0.2, 10.0]]))
    (said,) = unexplained(CAMERA, [thrown, hit], [[], [5.0]], [path, path], [])  # pyright: ignore[reportArgumentType]
    assert said.startswith("the stone that lay at (0.10, 9.00) m: from ")
    assert said.endswith("and they are left out")


def test_what_a_hand_does_before_the_stone_is_out_of_it_counts_for_nothing():
    assert strange_ways(CAMERA, slid(hit=2.0)) == ()


def test_a_stone_that_comes_from_nowhere_or_goes_there_is_told():
    thrown = SimpleNamespace(measured=slid(hit=10.0), rested=None)
    gone = SimpleNamespace(measured=Measurements(), rested=SimpleNamespace(xy=np.array([0.1, 9.0])))
    path = SimpleNamespace(xy=np.array([[0.0, -12.0], [0.2, 9.0]]))
    lies = [
        SimpleNamespace(xy=np.array(xy), comes=comes)
        for xy, comes in [((0.2, 9.1), True), ((1.0, 12.0), True), ((-1.0, 8.0), False)]
    ]
    said = unexplained(CAMERA, [thrown, gone], [[10.0], [10.0]], [path, None], lies)  # pyright: ignore[reportArgumentType]
    assert len(said) == 2
    assert "(0.10, 9.00)" in said[0]
    assert "(1.00, 12.00)" in said[1]
