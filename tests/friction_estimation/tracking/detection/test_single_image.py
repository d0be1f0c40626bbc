"""Stones in a single picture are found, and neither people nor paint are taken for one."""

from __future__ import annotations

import json

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


def find(picture, known):
    return find_stones_in_image(picture, known.camera, MODEL, PAPER_SHEET)


def lettered(picture: np.ndarray) -> np.ndarray:
    """The picture with letters, smaller and larger than stones, and a circle on the ice."""
    painted, middle = picture.copy(), picture.shape[1] // 2
    words = (
        ("CLUB", 110, 1.2, (150, 30, 30)),
        ("CURLING SINCE", 175, 0.4, (230, 230, 230)),
        ("1908", 235, 1.2, (30, 30, 170)),
    )
    for word, row, size, colour in words:
        where = (middle - 40, row)
        cv2.putText(painted, word, where, cv2.FONT_HERSHEY_DUPLEX, size, colour, 2, cv2.LINE_AA)
    cv2.circle(painted, (middle + 40, 280), 9, (120, 40, 20), 2, cv2.LINE_AA)
    return np.asarray(cv2.GaussianBlur(painted, (0, 0), 0.7))


def test_every_stone_is_found_and_no_player_is(club_photo, known):
    found = [stone for stone in find(club_photo.picture, known) if not stone.doubtful]
    places = np.array([stone.xy for stone in found])
    gaps = np.linalg.norm(places[:, None] - club_photo.stones[None], axis=2)
    assert (gaps.min(axis=1) < 0.06).all()  # whatever is found is a stone
    assert (gaps.min(axis=0) < 0.06).all()  # the one among the sweepers as well
    off = gaps.min(axis=0)
    sigma = np.array([found[k].sigma for k in gaps.argmin(axis=0)])
    assert (off < 3 * np.sqrt(2) * sigma).all()
    assert (sigma < 0.05).all()


def test_no_stone_is_found_on_empty_ice_with_letters(club_photo, known):
    for picture in (club_photo.empty, lettered(club_photo.empty)):
        assert all(stone.doubtful for stone in find(picture, known))


def test_a_picture_of_another_size_is_refused(club_photo, known):
    with pytest.raises(InputError, match=r"expected a picture of .* px as in the scene"):
        find(club_photo.picture[:-4], known)


def test_a_picture_in_which_stones_are_specks_is_refused(club_photo, files, tmp_path, curling):
    cv2.imwrite(str(tmp_path / "small.png"), cv2.resize(club_photo.picture, None, fx=0.1, fy=0.1))
    done = curling(
        *("stones", tmp_path / "small.png", "--scene", files / "scene.json"),
        *("-o", tmp_path / "s.json"),
    )
    assert "too small: stones must be 3 px wide or wider" in done.complaint
    assert not (tmp_path / "s.json").exists()


@pytest.fixture(scope="module")
def files(club_photo, known, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stones")
    cv2.imwrite(str(folder / "now.png"), club_photo.picture)
    cv2.imwrite(str(folder / "empty.png"), club_photo.empty)
    save_scene(known.scene, folder / "scene.json")
    return folder


def test_the_command_writes_stones_that_the_planner_reads(
    club_photo, files, tmp_path, curling, must_fit
):
    from agents.planning import read_stones

    done = curling(
        *("stones", files / "now.png", "--scene", files / "scene.json"),
        *("-o", tmp_path / "s.json", "--picture", tmp_path / "drawn.png", "--own", "yellow"),
    )
    assert done.status == 0, done.err
    must_fit(tmp_path / "s.json", "stones-1")
    listed = [stone for stone in done.json() if not stone.get("doubtful")]
    places, own = read_stones(tmp_path / "s.json", teams_needed=True)
    assert len(listed) == len(places) == len(club_photo.stones)
    # The one in the house has a yellow handle, the guard a red one.
    near = np.linalg.norm(places[:, None] - club_photo.stones[None, :2], axis=2).argmin(axis=0)
    assert own[near].tolist() == [True, False]
    assert [listed[k]["handle"] for k in near] == ["yellow", "red"]
    assert cv2.imread(str(tmp_path / "drawn.png")) is not None


def test_an_empty_picture_with_stones_is_reported(files, tmp_path, curling):
    done = curling(
        *("stones", files / "now.png", "--scene", files / "scene.json"),
        *("--empty", files / "now.png", "-o", tmp_path / "s.json"),
    )
    assert done.status == 0
    assert done.err.count("now.png: expected empty ice, found a stone at (") == 3


def test_the_planner_ignores_doubtful_stones_and_says_so(tmp_path, curling):
    stones = [{"x": 0.0, "y": 17.4}, {"x": 1.0, "y": 15.0, "doubtful": True}]
    (tmp_path / "s.json").write_text(json.dumps(stones))
    wanted = ("plan", "--ice", "standard", "--task", "takeout", "--stones", tmp_path / "s.json")
    done = curling(*wanted)
    assert done.status == 0, done.err
    assert "ignored as doubtful: 1 of the stones in" in done.err
