"""A codec that drops small changes shows a slow stone behind its true place."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from friction_estimation.appearance import StoneModel
from friction_estimation.synthetic import named_camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.detection.compression import PixelAges
from friction_estimation.tracking.path.uncertainty import unseen_way

CAMERA = named_camera("gantry", (640, 360))
ICE, GRANITE = 220, 90
MODEL = StoneModel(radius=0.14, height=0.114)
FPS, SPEED = 30.0, 0.3
T = np.arange(90) / FPS


def place(t):
    return np.array([0.3, -2.0 + SPEED * t])


def picture(t):
    """A dark disc on even ice."""
    width, height = CAMERA.size
    centre, edge = CAMERA.project([[*place(t), 0.05], [0.44, place(t)[1], 0.05]])
    frame = np.full((height, width, 3), ICE, dtype=np.uint8)
    middle, radius = np.round(centre * 16).astype(int), round(16 * np.linalg.norm(edge - centre))
    cv2.circle(frame, middle.tolist(), radius, (GRANITE,) * 3, -1, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(frame, (5, 5), 0.8)


def ages(frames, ice=ICE, rests=np.inf):
    width, height = CAMERA.size
    behind = np.full((height, width, 3), ice, dtype=np.float32)
    background = Background(origin_px=(0, 0), image=behind, noise=2.0)
    found = PixelAges()
    for t, frame in zip(T, frames, strict=True):
        found.add(t, place(min(t, rests)), frame, background, CAMERA, MODEL)
    return found.seen()


def test_still_ice_may_repeat_where_the_stone_moves_on():
    seen = ages([picture(t) for t in T])
    assert len(seen.t) > 60
    assert seen.rim.mean() < 1 / FPS
    # A little of the rim changes by less than a grey level.
    assert np.abs(seen.dropped).max() < 0.002
    assert seen.repeated.max() < 0.1


def test_a_picture_that_stays_tells_how_far_the_stone_has_gone_since():
    last = 60
    frames = [picture(t) for t in T]
    seen = ages(frames[:last] + [frames[last - 1]] * (len(T) - last))
    found = seen.around(T)
    since = T[-1] - T[last - 1]
    at_end = seen.rim[-1]
    assert at_end == pytest.approx(since, abs=2 / FPS)
    assert seen.repeated[-1] == 1.0
    velocity = np.tile([0.0, SPEED], (len(T), 1))
    way = unseen_way(T, velocity, found.rim)
    assert np.abs(way[: last // 2]).max() < 0.01
    slowing = 0.5 * tuning.HIDDEN_DECELERATION * (since - tuning.AGE_NEIGHBOURS / 2) ** 2
    expected = SPEED * (since - tuning.AGE_NEIGHBOURS / 2) - slowing
    assert way[-1] == pytest.approx([0.0, expected], abs=0.02)


def test_a_stone_that_slows_down_goes_no_farther_than_to_its_rest():
    velocity = np.tile([0.0, 0.1], (len(T), 1))
    way = unseen_way(T, velocity, np.full(len(T), 100.0))
    assert way[-1, 1] == pytest.approx(0.1**2 / 2 / tuning.HIDDEN_DECELERATION)


def test_the_less_a_stone_stands_out_the_more_a_codec_may_drop():
    rests = T[30]
    frames = [picture(min(t, rests)) for t in T]
    faint_ice = GRANITE + (ICE - GRANITE) // 4
    faint = [(GRANITE + (f.astype(int) - GRANITE) // 4).astype(np.uint8) for f in frames]
    clear = ages(frames, rests=rests).dropped[-1]
    assert clear[0] == pytest.approx(0.0, abs=1e-4)
    assert ages(faint, ice=faint_ice, rests=rests).dropped[-1][1] > 2 * clear[1]
    rng = np.random.default_rng(1)
    noisy = [np.clip(f + rng.normal(0, 3, f.shape), 0, 255).astype(np.uint8) for f in frames]
    assert ages(noisy, rests=rests).dropped[-1][1] < 0.3 * clear[1]
