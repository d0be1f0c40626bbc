"""A track that does what no stone does is reported, and its stated error grows."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.synthetic import FilmSpec, render_film, scene_of
from friction_estimation.tracking import track_film

SPEC = FilmSpec(
    camera="gantry", size=(480, 270), fps=12.0, people=False, lead_in=0.0, tail=0.2, seed=4
)


def hits_something(t):
    speed = 3.0 - 0.1 * t
    return np.cumsum(np.where(t < 4.6, speed, 0.3 * speed)) / 60


def halts(t):
    speed = 3.0 - 0.1 * np.minimum(t, 4.4) - 0.7 * np.maximum(t - 4.4, 0.0)
    return np.cumsum(np.maximum(speed, 0.0)) / 60


def jumps_aside(t):
    beside = ((t > 4.6) & (t < 5.2)) | ((t > 5.6) & (t < 6.2))
    return np.cumsum(3.0 - 0.1 * t) / 60 + 0.3 * beside


@pytest.mark.parametrize(
    ("way", "warning"),
    [
        (hits_something, "at 4.6 s it loses speed as if it hit a stone"),
        (halts, "s on it slows down more than ice slows a stone"),
        (jumps_aside, "off the path of a sliding stone"),
    ],
)
def test_what_no_stone_does_alone_is_reported(tmp_path, way, warning):
    t = np.arange(0, 8, 1 / 60)
    xy = np.column_stack([-0.4 + 0.03 * t, -12 + way(t)])
    truth = render_film(tmp_path / "film.mp4", Trajectory(t=t, xy=xy, theta=0.3 + 1.2 * t), SPEC)
    found = track_film(tmp_path / "film.mp4", scene_of(SPEC.resolved()))
    track = found.trajectory
    assert len(track) > 0.95 * len(truth)
    (result,) = found.unexplained
    assert warning in result
    early, late = track.t < 3.5, (track.t > 4.8) & (track.t < 6.0)
    assert track.sigma_xy[early].max() < 0.03
    if way is hits_something:  # a smoother that ran across the hit would be decimetres off
        there = [np.interp(track.t, truth.t, truth.xy[:, k]) for k in range(2)]
        slides = track.t < 7.9  # where the film ends, the stone stands still at once
        assert np.hypot(*(track.xy.T - there))[slides].max() < 0.03
    else:
        assert track.sigma_xy[late].max() > 3 * track.sigma_xy[early].max()
