"""Stones in a single picture are found, and no person is taken for one."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import HOG_LINE_WIDTH, HOG_LINE_Y, PAPER_SHEET, TEE_Y
from friction_estimation.appearance import StoneModel
from friction_estimation.camera import camera_from_photo, save_scene
from friction_estimation.tracking import find_stones_in_image

MODEL = StoneModel(radius=0.145, height=0.1143)


@pytest.fixture(scope="module")
def known(club_photo):
    tee, hog = club_photo.px(np.array([[0.0, TEE_Y], [0.0, HOG_LINE_Y + HOG_LINE_WIDTH / 2]]))
    marks = {"away_tee": tuple(tee), "away_hog_centre": tuple(hog)}
    return camera_from_photo(club_photo.empty, marks, height=6.0)


def test_stones_are_found_and_players_are_not(club_photo, known):
    found = find_stones_in_image(
        club_photo.picture, club_photo.empty, known.camera, MODEL, PAPER_SHEET
    )
    places = np.array([stone.xy for stone in found])
    gaps = np.linalg.norm(places[:, None] - club_photo.stones[None], axis=2)
    assert (gaps.min(axis=1) < 0.05).all()  # whatever is found is a stone
    assert (gaps.min(axis=0)[:2] < 0.05).all()  # both that lie alone are found
    assert all(0.002 < stone.sigma < 0.1 for stone in found)


def test_no_stone_is_found_on_empty_ice(club_photo, known):
    rng = np.random.default_rng(5)
    again = np.clip(club_photo.empty + rng.normal(0, 2, club_photo.empty.shape), 0, 255)
    found = find_stones_in_image(
        again.astype(np.uint8), club_photo.empty, known.camera, MODEL, PAPER_SHEET
    )
    assert found == []


def test_pictures_of_another_size_are_refused(club_photo, known):
    with pytest.raises(InputError, match=r"the empty ice has .* px, the scene is of"):
        find_stones_in_image(
            club_photo.picture, club_photo.empty[:-4], known.camera, MODEL, PAPER_SHEET
        )


def test_the_command_writes_stones_that_the_planner_reads(
    club_photo, known, tmp_path, curling, must_fit
):
    from agents.planning import read_stones

    paths = {name: tmp_path / name for name in ("now.png", "empty.png", "scene.json", "s.json")}
    cv2.imwrite(str(paths["now.png"]), club_photo.picture)
    cv2.imwrite(str(paths["empty.png"]), club_photo.empty)
    save_scene(known.scene, paths["scene.json"])
    done = curling(
        *("stones", paths["now.png"], "--empty", paths["empty.png"]),
        *("--scene", paths["scene.json"], "-o", paths["s.json"]),
        *("--picture", tmp_path / "drawn.png", "--own", "yellow"),
    )
    assert done.status == 0, done.err
    must_fit(paths["s.json"], "stones-1")
    told = done.json()
    places, own = read_stones(paths["s.json"], teams_needed=True)
    assert len(told) == len(places) >= 2
    # The one in the house has a yellow handle, the guard a red one.
    near = np.linalg.norm(places[:, None] - club_photo.stones[None, :2], axis=2).argmin(axis=0)
    assert own[near].tolist() == [True, False]
    assert [told[k]["handle"] for k in near] == ["yellow", "red"]
    assert cv2.imread(str(tmp_path / "drawn.png")) is not None
