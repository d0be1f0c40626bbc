"""The camera of a scene is solved once, kept beside it, and checked in every film."""

from __future__ import annotations

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.infrastructure import command_files
from curling_env.infrastructure import together as as_one_result
from friction_estimation import load_scene
from friction_estimation.camera import save_scene
from friction_estimation.film import Film
from friction_estimation.synthetic import write_film
from friction_estimation.tracking import SharedCameras, track_each, track_film
from friction_estimation.tracking.overlay.film import write_overlay

FPS = 6.0
"""Frames per second of the practice film."""
SECONDS = 3.5
"""Part of each throw that is filmed: what is tested is the camera."""


@pytest.fixture(scope="module")
def films(practice, tmp_path_factory):
    """The first seconds of two throws as separate films, in a folder with the scene."""
    folder = tmp_path_factory.mktemp("films")
    save_scene(practice.scene, folder / "hall.scene.json")
    film = Film.open(practice.path)
    paths = []
    for k, begin in enumerate(practice.begins[:2]):
        paths.append(folder / f"{k}.mp4")
        frames = film.part(begin - 1, begin + SECONDS)
        write_film(paths[-1], (frame for _, frame in frames.frames()), FPS)
    return paths


@pytest.fixture(scope="module")
def together(films):
    """Tracks of both films, tracked together, and the films sampled for them."""
    sampled, sample = [], Film.sample

    def counted(film, count):
        sampled.append(film.path)
        return sample(film, count)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Film, "sample", counted)
        scene = load_scene(films[0].with_name("hall.scene.json"))
        found = list(track_each(films, scene, cameras=SharedCameras(keep=True)))
    return [one.found for one in found], sampled


def alone(film, folder, kept):
    """Track a film in a folder whose scene has a text beside it as the camera kept before."""
    (folder / "hall.scene.json").write_bytes(film.with_name("hall.scene.json").read_bytes())
    (folder / "hall.solved.json").write_text(kept)
    scene = load_scene(folder / "hall.scene.json")
    (one,) = track_each([film], scene, cameras=SharedCameras(keep=True))
    return one.found


def test_films_of_one_scene_have_one_camera(together):
    (first, second), _ = together
    assert first.camera is second.camera
    assert first.moved_px == second.moved_px == 0.0


def test_a_film_that_is_tracked_next_is_sampled_once(films, together):
    assert together[1] == [films[0], films[1], films[1]]


def test_a_camera_is_kept_beside_its_scene_to_the_last_bit_and_used_again(
    films, together, tmp_path, must_fit
):
    kept = films[0].with_name("hall.solved.json")
    must_fit(kept, "camera-1")
    solved, again = together[0][0].refined, alone(films[1], tmp_path, kept.read_text()).refined
    for name in ("rotation", "translation"):
        assert np.array_equal(getattr(again.camera, name), getattr(solved.camera, name))
    assert np.array_equal(again.covariance, solved.covariance)
    assert (tmp_path / "hall.solved.json").read_text() == kept.read_text()


def test_a_camera_that_was_kept_for_another_scene_is_solved_again(films, together, tmp_path):
    """The same happens to one that an older version of the program solved."""
    kept = json.loads(films[0].with_name("hall.solved.json").read_text())
    with command_files():
        again = alone(films[1], tmp_path, json.dumps(kept | {"scene": "another"})).refined
    assert not np.array_equal(again.covariance, together[0][0].refined.covariance)
    now = json.loads((tmp_path / "hall.solved.json").read_text())
    assert now["scene"] == kept["scene"]
    assert now["covariance"] == again.covariance.tolist()


def test_a_file_of_the_users_under_that_name_stays_as_it_is(films, tmp_path):
    assert alone(films[0], tmp_path, '{"format": "mine"}').refined.measured
    assert (tmp_path / "hall.solved.json").read_text() == '{"format": "mine"}'


def test_a_film_that_changes_its_size_gets_no_overlay_and_leaves_no_camera(
    films, tmp_path, monkeypatch
):
    """The film is tracked by its first pictures, and the overlay is refused with the frame."""
    scene_file = films[0].with_name("hall.scene.json")
    (tmp_path / "hall.scene.json").write_bytes(scene_file.read_bytes())
    scene, whole = load_scene(tmp_path / "hall.scene.json"), Film.frames

    def changing(film):
        for k, (t, frame) in enumerate(whole(film)):
            yield t, frame if k < 5 else np.ascontiguousarray(frame[::2, ::2])

    with pytest.raises(InputError, match=r"0\.mp4, frame 5: an overlay needs"), as_one_result():
        (one,) = track_each([films[0]], scene, cameras=SharedCameras(keep=True))
        monkeypatch.setattr(Film, "frames", changing)
        write_overlay(films[0], scene, one.found, tmp_path / "seen.mp4")
    assert [path.name for path in tmp_path.iterdir()] == ["hall.scene.json"]


def test_a_tripod_that_has_moved_is_noticed(films, together, tmp_path):
    shift = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 2.0]])
    frames = (
        cv2.warpAffine(frame, shift, frame.shape[1::-1], borderMode=cv2.BORDER_REPLICATE)
        for _, frame in Film.open(films[1]).frames()
    )
    moved = films[0].with_name("moved.mp4")
    write_film(moved, (np.asarray(frame, dtype=np.uint8) for frame in frames), FPS)
    found = alone(moved, tmp_path, films[0].with_name("hall.solved.json").read_text())
    assert 1.5 < found.moved_px < 4.5
    one, other = found.trajectory, together[0][1].trajectory
    for axis in range(2):
        same = np.interp(one.t, other.t, other.xy[:, axis])
        assert one.xy[:, axis] == pytest.approx(same, abs=0.04)


def test_a_scene_of_another_camera_is_reported_as_that(films, practice):
    px = practice.scene.points_px
    elsewhere = replace(practice.scene, points_px=(px - px.mean(axis=0)) * 0.55 + [259.0, 240.0])
    with pytest.raises(InputError, match=r"0\.mp4: the paint is not where this scene says"):
        track_film(films[0], elsewhere)
