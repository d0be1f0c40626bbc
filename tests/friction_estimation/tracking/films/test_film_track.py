"""Warnings about a track."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.tracking import FilmTrack


@pytest.mark.parametrize(
    ("frames", "speed", "seen", "message"),
    [
        (np.arange(80), 1.0, True, ""),
        (np.delete(np.arange(80), range(31, 50)), 1.0, True, "from 3.0 to 5.0 s"),
        (np.delete(np.arange(80), range(31, 36)), 1.0, True, ""),
        (np.arange(61), 1.0, True, "from 6.0 s on, while it still moves"),
        (np.arange(61), 0.0, True, ""),
        (np.arange(61), 1.0, False, ""),
    ],
)
def test_unseen_parts_of_a_slide_are_reported(frames, speed, seen, message):
    t = frames / 10
    velocity = np.tile([0.0, speed], (len(t), 1))
    found = FilmTrack(
        trajectory=Trajectory(t=t, xy=t[:, None] * velocity),
        frame=frames,
        velocity=velocity,
        spin=np.zeros(len(t)),
        frame_count=81,
        camera=SimpleNamespace(sees=lambda points: np.full(len(points), seen)),
        appearance=SimpleNamespace(has_handle=False),
        refined=SimpleNamespace(measured=0),
    )
    assert found.not_seen == message
