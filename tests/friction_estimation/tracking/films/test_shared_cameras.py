"""The camera of a scene is solved once, kept beside it, and checked in every film."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.typing import no_progress
from friction_estimation import load_scene
from friction_estimation.camera import save_scene
from friction_estimation.film import Film
from friction_estimation.synthetic import write_film
from friction_estimation.tracking import SharedCameras, track_each, track_film
from friction_estimation.tracking.cutting.pieces import Piece
from friction_estimation.tracking.films.shared_cameras import camera_beside


@pytest.fixture(scope="module")
def films(practice, tmp_path_factory):
    """The first two throws as films of their own, in a folder with the scene."""
    folder = tmp_path_factory.mktemp("films")
    save_scene(practice.scene, folder / "hall.scene.json")
    film = Film.open(practice.path)
    paths = []
    for k, begin in enumerate(practice.begins[:2]):
        paths.append(folder / f"{k}.mp4")
        frames = film.part(begin - 1, begin + practice.truths[k].t[-1])
        write_film(paths[-1], (frame for _, frame in frames.frames()), 8.0)
    return paths


def pieces(paths):
    return [Piece.whole(Film.open(path)) for path in paths]


def test_a_camera_is_kept_beside_its_scene_to_the_last_bit_and_used_again(
    films, monkeypatch, must_fit
):
    scene = load_scene(films[0].with_name("hall.scene.json"))
    kept = camera_beside(scene)
    assert kept == films[0].with_name("hall.solved.json")
    cameras = SharedCameras(keep=True)
    solved = cameras.of(scene, pieces(films[:1]), films[1:], no_progress)
    assert solved is not None
    assert not kept.exists(), "no throw was tracked with it yet"
    cameras.keep_of(scene, Film.open(films[0]).size)
    must_fit(kept, "camera-1")

    def never(*_, **__):
        raise AssertionError("solved again")

    monkeypatch.setattr("friction_estimation.tracking.films.shared_cameras.solve_camera", never)
    again = SharedCameras(keep=True).of(scene, pieces(films[1:]), [], no_progress)
    assert again is not None
    for name in ("rotation", "translation"):
        assert np.array_equal(getattr(again.camera, name), getattr(solved.camera, name))
    assert np.array_equal(again.covariance, solved.covariance)
    # What an older version of the program solved is not good enough any more.
    monkeypatch.setattr("friction_estimation.tracking.films.shared_cameras.SOLVER", 0)
    with pytest.raises(AssertionError, match="solved again"):
        SharedCameras(keep=True).of(scene, pieces(films[1:]), [], no_progress)
    other = replace(scene, stone_radius=0.14)
    with pytest.raises(AssertionError, match="solved again"):
        SharedCameras(keep=True).of(other, pieces(films[1:]), [], no_progress)
    kept.unlink()
    with pytest.raises(AssertionError, match="solved again"):
        SharedCameras(keep=True).of(scene, pieces(films[1:]), [], no_progress)


def test_a_file_of_the_users_under_that_name_stays_as_it_is(films, tmp_path):
    path = tmp_path / "hall.scene.json"
    path.write_bytes(films[0].with_name("hall.scene.json").read_bytes())
    own = tmp_path / "hall.solved.json"
    own.write_text('{"format": "mine"}')
    scene = load_scene(path)
    cameras = SharedCameras(keep=True)
    assert cameras.of(scene, pieces(films[:1]), [], no_progress) is not None
    cameras.keep_of(scene, Film.open(films[0]).size)
    assert own.read_text() == '{"format": "mine"}'


def test_films_of_one_scene_have_one_camera(films):
    scene = load_scene(films[0].with_name("hall.scene.json"))
    found = [one.found for one in track_each(films, scene)]
    assert found[0] is not None
    assert found[1] is not None
    assert found[0].camera is found[1].camera
    assert [one.moved_px for one in found if one is not None] == [0.0, 0.0]
    assert not films[0].with_name("hall.solved.json").exists()


def test_a_film_that_is_tracked_next_is_sampled_once(films, monkeypatch):
    scene = load_scene(films[0].with_name("hall.scene.json"))
    sampled = []
    sample = Film.sample

    def counted(film, count):
        sampled.append(film.path)
        return sample(film, count)

    monkeypatch.setattr(Film, "sample", counted)
    first, second = (one.found for one in track_each(films, scene))
    assert sampled == [films[0], films[1], films[1]]
    # It makes no difference to the track.
    camera = SharedCameras().of(scene, pieces(films[:1]), films[1:], no_progress)
    for path, found in zip(films, (first, second), strict=True):
        again = track_film(Film.open(path), scene, camera=camera)
        assert np.array_equal(again.trajectory.xy, found.trajectory.xy)


def test_a_tripod_that_has_moved_is_noticed(films, practice):
    scene = practice.scene
    solved = SharedCameras().of(scene, pieces(films[:1]), [], no_progress)
    moved = films[0].with_name("moved.mp4")
    shift = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 2.0]])
    frames = (
        cv2.warpAffine(frame, shift, frame.shape[1::-1], borderMode=cv2.BORDER_REPLICATE)
        for _, frame in Film.open(films[1]).frames()
    )
    write_film(moved, (np.asarray(frame, dtype=np.uint8) for frame in frames), 8.0)
    found = track_film(moved, scene, camera=solved)
    assert 1.5 < found.moved_px < 4.5
    still = track_film(films[1], scene, camera=solved)
    assert still.moved_px == 0
    one, other = found.trajectory, still.trajectory
    for axis in range(2):
        same = np.interp(one.t, other.t, other.xy[:, axis])
        assert one.xy[:, axis] == pytest.approx(same, abs=0.04)


def test_a_scene_of_another_camera_is_told_as_that(films, practice):
    px = practice.scene.points_px
    elsewhere = replace(practice.scene, points_px=(px - px.mean(axis=0)) * 0.55 + [480.0, 430.0])
    with pytest.raises(InputError, match=r"0\.mp4: the paint is not where this scene says"):
        track_film(films[0], elsewhere)
