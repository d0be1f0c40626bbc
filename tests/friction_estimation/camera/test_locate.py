"""A camera from one photo: rendered as clubs pass them on, small, stretched, bent and cut."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import HOG_LINE_WIDTH, HOG_LINE_Y, RING_RADII, TEE_Y
from friction_estimation import load_scene
from friction_estimation.camera import camera_from_photo, camera_from_scene

TEE = [0.0, TEE_Y]
HOG = [0.0, HOG_LINE_Y + HOG_LINE_WIDTH / 2]


def landmarks():
    """Points on the rings and on the hog line, (n, 2) [m]."""
    around = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    rings = [radius * circle + TEE for radius in RING_RADII[:3]]
    x = np.linspace(-1.8, 1.8, 19)
    return np.concatenate([*rings, np.column_stack([x, np.full(len(x), HOG_LINE_Y)])])


def clicks(photo, off=((0.0, 0.0), (0.0, 0.0))):
    tee, hog = photo.px(np.array([TEE, HOG])) + np.array(off)
    return {"away_tee": tuple(tee), "away_hog_centre": tuple(hog)}


def apart(camera, photo):
    """How far rings and hog line are from where they truly are in the photo, rms [px]."""
    ice = landmarks()
    true = photo.px(ice)
    inside = ((true > 0) & (true < np.array(camera.size) - 1)).all(axis=1)
    off = camera.project(np.column_stack([ice, np.zeros(len(ice))])) - true
    return float(np.sqrt(np.mean(np.sum(off[inside] ** 2, axis=1))))


@pytest.mark.parametrize("off", [((5.0, -4.0), (-6.0, 4.0)), ((-6.0, 6.0), (5.0, -3.0))])
def test_two_rough_clicks_lead_to_rings_and_hog_line(club_photo, off):
    found = camera_from_photo(club_photo.empty, clicks(club_photo, off))
    assert apart(found.camera, club_photo) < 0.8
    assert max(found.misses_px[name] for name in ("12-foot ring", "hog line")) < 0.5


def test_a_height_that_was_measured_is_kept_and_places_the_tops_of_stones(club_photo):
    known = camera_from_photo(club_photo.empty, clicks(club_photo), height=6.0)
    assert known.camera.position[2] == pytest.approx(6.0, rel=0.03)
    guessed = camera_from_photo(club_photo.empty, clicks(club_photo))
    assert guessed.refined.log_focal_sigma > 3 * known.refined.log_focal_sigma


def test_the_command_writes_a_scene_that_reads_the_photo_and_a_picture(
    club_photo, tmp_path, curling
):
    photo, scene, drawn = (tmp_path / name for name in ("ice.png", "scene.json", "drawn.png"))
    cv2.imwrite(str(photo), club_photo.empty)
    marks = [f"{name}={u:.0f},{v:.0f}" for name, (u, v) in clicks(club_photo).items()]
    asked = ["--mark", marks[0], "--mark", marks[1], "-o", str(scene), "--picture", str(drawn)]
    done = curling("locate", photo, *asked)
    assert done.status == 0, done.err
    told = done.json()
    assert told["misses_px"]["hog line"] < 0.5
    size = (club_photo.empty.shape[1], club_photo.empty.shape[0])
    assert apart(camera_from_scene(load_scene(scene), size), club_photo) < 0.8
    picture = cv2.imread(str(drawn))
    changed = cv2.absdiff(picture, cv2.resize(club_photo.empty, picture.shape[1::-1]))
    assert 0.001 < np.mean(changed.max(axis=2) > 60) < 0.2  # lines are drawn, and only lines


@pytest.mark.parametrize(
    ("marks", "message"),
    [
        ({"away_tee": (60.0, 60.0)}, "tee and hog_centre of one end"),
        ({"away_tee": (60.0, 60.0), "tea": (1.0, 1.0)}, "nothing is called 'tea'"),
        ({"away_tee": (9e3, 60.0), "away_hog_centre": (1.0, 1.0)}, "away_tee at .* outside"),
        ({"away_tee": (60.0, 60.0), "away_hog_centre": (61.0, 60.0)}, "at the same place"),
    ],
)
def test_clicks_that_say_nothing_are_refused(club_photo, marks, message):
    with pytest.raises(InputError, match=message):
        camera_from_photo(club_photo.empty, marks)


def test_clicks_on_the_wrong_things_are_found_out(club_photo):
    tee, hog = clicks(club_photo).values()
    swapped = {"away_tee": hog, "away_hog_centre": tee}
    with pytest.raises(InputError, match="clicked|check the clicks"):
        camera_from_photo(club_photo.empty, swapped)


def test_a_photo_without_paint_is_refused(club_photo):
    blank = np.random.default_rng(1).normal(200, 3, club_photo.empty.shape)
    with pytest.raises(InputError, match="clicked|check the clicks"):
        camera_from_photo(blank.astype(np.uint8), clicks(club_photo))
