"""Brightness that changes from frame to frame and from row to row is corrected."""

from __future__ import annotations

import numpy as np

from friction_estimation.film import deflicker_for

ROWS, COLUMNS = 270, 480


def scene(seed=0):
    rng = np.random.default_rng(seed)
    frame = np.full((ROWS, COLUMNS, 3), 190.0)
    frame[:, 200:230] = 60
    frame[120:130] = 110
    return frame + rng.normal(0, 2, frame.shape)


def filmed(light):
    """Make frames under light (rows,) as a function of the frame's number; a person walks by."""
    frames = []
    for i in range(12):
        frame = scene(i) * light(i)[:, None, None]
        frame[60:200, 30 * i : 30 * i + 60] = 40
        frames.append((i / 10, np.clip(frame, 0, 255).astype(np.uint8)))
    return frames


def off(lighting, frames):
    """Return the largest mean difference of a row from the first frame's, without people and
    noise.
    """
    first = frames[0][1].astype(float)
    worst = 0.0
    for _, frame in frames[1:]:
        apart = np.median(lighting.corrected(frame) - first, axis=(1, 2))
        worst = max(worst, float(np.abs(apart).max()))
    return worst


def test_bands_that_run_over_the_picture_are_taken_out():
    rows = np.arange(ROWS) / ROWS
    frames = filmed(lambda i: 1 + 0.06 * np.sin(1.1 * i + 7.5 * rows))
    lighting = deflicker_for(frames)
    assert lighting is not None
    assert off(lighting, frames) < 4  # of 190; without it 23


def test_lights_that_are_dimmed_are_turned_up():
    frames = filmed(lambda i: np.full(ROWS, 1 - 0.03 * i))
    lighting = deflicker_for(frames)
    assert lighting is not None
    assert off(lighting, frames) < 2.5


def test_steady_lights_and_people_are_left_as_they_are():
    assert deflicker_for(filmed(lambda i: np.full(ROWS, 1.0 + 0.01 * (i % 2)))) is None


def test_a_knocked_camera_in_a_dark_hall_is_no_change_of_light():
    """The ice is a bright strip; around it the light falls off, and noise is a tenth of it."""
    down = np.abs(np.arange(ROWS) - ROWS / 2)
    level = np.where(down < 40, 205.0, 20 + 30 * np.exp(-(((down - 40) / 50) ** 2)))
    hall = np.repeat(level[:, None], COLUMNS, axis=1)
    hall[115:155, 100:140] = 90
    frames = []
    for i in range(12):
        noise = np.random.default_rng(i).normal(0, 3, hall.shape)
        seen = np.roll(hall, (4, 6) if i > 5 else (0, 0), (0, 1)) + noise
        grey = np.clip(seen, 0, 255).astype(np.uint8)
        frames.append((i / 10, np.repeat(grey[:, :, None], 3, axis=2)))
    assert deflicker_for(frames) is None
