"""Cameras that see a part of the sheet, where a stone passes quickly or is cut off."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from friction_estimation import Scene
from friction_estimation.camera import Camera
from friction_estimation.synthetic import FilmRenderer, FilmSpec, on_film, scene_of, write_film
from friction_estimation.tracking import track_film

CAMERA = Camera.looking_at(
    position=(5.5, 10.5, 5.5),
    target=(-0.1, 10.5, 0.0),
    focal_px=300.0,
    size=(336, 190),
    distortion=(-0.06, 0.01, 0, 0, 0),
)


KNOWN = np.array([[-2.0, 9.0], [1.5, 9.0], [1.5, 12.5], [-2.0, 12.5], [0.0, 10.9725]])
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def errors(track, truth):
    """Errors in x and y of each row, (n, 2) [m]."""
    there = np.column_stack([np.interp(track.t, truth.t, truth.xy[:, axis]) for axis in (0, 1)])
    return track.xy - there


@pytest.mark.slow
def test_a_stone_that_crosses_the_picture_quickly_is_found(tmp_path):
    """A camera over the home house sees two of thirty seconds; then the stone is cut off."""
    path = slide(Ice.uniform(0.0085), Throw(speed=2.0, spin=1.2).release(), fps=60).trajectory
    spec = FilmSpec(camera="ceiling_home", size=(640, 480), people=False, fps=10.0)
    renderer = FilmRenderer(spec)
    write_film(tmp_path / "film.mp4", renderer.frames(path, seed=1), spec.fps)
    track = track_film(tmp_path / "film.mp4", scene_of(renderer.camera)).trajectory
    truth = on_film(path, spec)
    whole = renderer.camera.sees(np.column_stack([truth.xy, np.zeros(len(truth))]), margin_px=20)
    assert 0.9 * whole.sum() < len(track) < 1.2 * whole.sum() < 40
    off = errors(track, truth)
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 0.01
    assert np.abs(off / track.sigma_xy[:, None]).max() < 4


def sliding(path, x, texture=None):
    """A film of a stone that slides along a line x, or of a box painted over it."""
    t = np.arange(0, 4.0, 1 / 48)
    way = Trajectory(t=t, xy=np.column_stack([np.full(len(t), x), 8.5 + 1.5 * t - 0.15 * t**2]))
    spec = FilmSpec(camera=CAMERA, fps=8.0, people=False, lead_in=0.2, tail=0.2, seed=4)
    frames = []
    for frame, (x, y) in zip(FilmRenderer(spec).frames(way), on_film(way, spec).xy, strict=True):
        if texture is not None:
            corners = np.array([x, y]) + 0.2 * SQUARE
            px = CAMERA.project(np.column_stack([corners, np.full(4, 0.05)])).astype(np.float32)
            flat = np.array([[0, 0], [7, 0], [7, 7], [0, 7]], dtype=np.float32)
            turn = cv2.getPerspectiveTransform(flat, px)
            box = cv2.warpPerspective(texture, turn, CAMERA.size, flags=cv2.INTER_NEAREST)
            over = cv2.warpPerspective(np.ones((8, 8), np.uint8), turn, CAMERA.size)
            frame = np.where(over[..., None] > 0, box, frame)
        frames.append(frame)
    write_film(path, frames, spec.fps)
    return path


def known_scene():
    return Scene(
        sheet_points=KNOWN,
        points_px=CAMERA.project(np.column_stack([KNOWN, np.zeros(len(KNOWN))])),
        camera_matrix=CAMERA.lens.matrix,
        distortion=CAMERA.lens.distortion,
    )


def test_a_stone_that_is_always_cut_off_is_refused_in_one_line(tmp_path):
    edge = CAMERA.on_plane(np.array([[168.0, 189.0]]), 0.06)[0, 0]
    film = sliding(tmp_path / "film.mp4", edge)
    with pytest.raises(InputError, match=r"film\.mp4: (no thrown stone|the thrown stone is now)"):
        track_film(film, known_scene())


def test_something_that_slides_but_does_not_look_like_a_stone_is_refused(tmp_path):
    """A stone on the same path, before the same camera, is tracked in test_people.py."""
    rng = np.random.default_rng(1)
    texture = (40 + 200 * (rng.random((8, 8, 3)) < 0.4)).astype(np.uint8)
    film = sliding(tmp_path / "film.mp4", -0.4, texture)
    with pytest.raises(InputError, match=r"film\.mp4: no thrown stone found"):
        track_film(film, known_scene())
