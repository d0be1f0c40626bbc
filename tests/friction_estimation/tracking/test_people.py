"""Tracking with people around the stone, on a few seconds of a rendered film."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from friction_estimation import Scene
from friction_estimation.camera import Camera
from friction_estimation.synthetic import FilmSpec, Light, render_film
from friction_estimation.tracking import TrackingOptions, track_film

FPS = 12.0
OUT_OF_HAND = 1.0
"""Time after which the thrower no longer hides the stone [s]."""
CAMERA = Camera.looking_at(
    position=(5.5, 10.5, 5.5),
    target=(-0.1, 10.5, 0.0),
    focal_px=300.0,
    size=(336, 190),
    distortion=(-0.06, 0.01, 0, 0, 0),
)


KNOWN = np.array([[-2.0, 9.0], [1.5, 9.0], [1.5, 12.5], [-2.0, 12.5], [0.0, 10.9725]])


def scene():
    return Scene(
        sheet_points=KNOWN,
        points_px=CAMERA.project(np.column_stack([KNOWN, np.zeros(len(KNOWN))])),
        camera_matrix=CAMERA.lens.matrix,
        distortion=CAMERA.lens.distortion,
        stone_radius=0.145,
        stone_height=0.1143,
    )


def throw():
    """A stone that slides for 4 s at draw weight, turns, and comes to rest."""
    t = np.arange(0, 4.0 + 1e-9, 1 / 60)
    y = 8.0 + 1.9 * t - 0.2375 * t**2
    xy = np.column_stack([-0.4 + 0.015 * t**2, y])
    return Trajectory(t=t, xy=xy, theta=0.3 + 1.2 * t - 0.15 * t**2)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("people") / "throw.mp4"
    spec = FilmSpec(
        camera=CAMERA, fps=FPS, people=True, lead_in=0.2, tail=0.4, light=Light(gloss=0.9), seed=4
    )
    return path, render_film(path, throw(), spec)


@pytest.fixture(scope="module")
def tracked(film):
    # Paint seen so coarsely moves the camera by a third of a pixel; people must not move the stone.
    path, truth = film
    return track_film(path, scene(), options=TrackingOptions(refine=False)), truth


def test_people_shadows_and_reflections_do_not_move_the_stone(tracked):
    result, truth = tracked
    path = result.trajectory
    error = path.xy - truth.xy[result.frame]
    seen = np.isin(np.flatnonzero(truth.t > OUT_OF_HAND), result.frame)
    assert seen.mean() >= 0.9
    # A pixel is 26 mm across and 40 mm along the line of sight here.
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < 0.004


def test_the_stone_is_followed_and_not_a_person(tracked):
    result, truth = tracked
    away = np.linalg.norm(result.trajectory.xy - truth.xy[result.frame], axis=1)
    assert away.max() < 0.045


def test_people_without_a_stone_are_no_throw(tmp_path):
    path = tmp_path / "walk.mp4"
    spec = FilmSpec(camera=CAMERA, fps=FPS, people=True, lead_in=0.2, tail=0.0, seed=5)
    still = Trajectory(t=np.array([0.0, 2.0]), xy=np.full((2, 2), [0.0, -18.0]))
    render_film(path, still, spec)  # the stone lies out of the picture
    with pytest.raises(InputError, match=r"walk\.mp4: no thrown stone found"):
        track_film(path, scene())
