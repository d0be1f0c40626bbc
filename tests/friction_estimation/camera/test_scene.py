"""The scene file: read back as written, and every error in it reported in one line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from curling_env.errors import InputError
from friction_estimation import Scene, load_scene
from friction_estimation.camera import Camera, camera_from_scene, save_scene

GOOD = {
    "corners_px": {
        "home_left": [600, 1000],
        "home_right": [1300, 1000],
        "away_left": [870, 50],
        "away_right": [1050, 50],
    },
    "camera_matrix": [[2000, 0, 960], [0, 2000, 540], [0, 0, 1]],
    "distortion": [-0.1, 0.02, 0, 0, 0],
    "stone": {"radius": 0.14, "height": 0.114},
}


def written(tmp_path, **changes):
    document = {key: value for key, value in (GOOD | changes).items() if value is not None}
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(document))
    return path


def corners(**changes):
    return {"corners_px": GOOD["corners_px"] | changes}


def test_a_scene_is_read_back_as_written(tmp_path):
    path = written(tmp_path, fps=29.97, sheet={"length": 45.72, "width": 4.75}, camera_height=6.1)
    scene = load_scene(path)
    save_scene(scene, tmp_path / "again.json")
    again = load_scene(tmp_path / "again.json")
    assert again.has_corners
    assert np.array_equal(again.points_px, scene.points_px)
    assert np.array_equal(again.camera_matrix, scene.camera_matrix)
    assert again.distortion.tolist() == GOOD["distortion"]
    assert (again.stone_radius, again.stone_height) == (0.14, 0.114)
    assert (again.fps, again.sheet.length) == (29.97, 45.72)
    assert again.camera_height == 6.1
    assert load_scene(path, height=7.0).camera_height == 7.0


@pytest.mark.parametrize("lean", [0.0, 0.1])
def test_a_measured_height_tells_the_focal_length_that_points_cannot(lean):
    """Straight from above every height fits; leaning, the points tell it to some per cent."""
    camera = Camera.looking_at(
        position=(0.0, -14.0 * lean, 14.0),
        target=(0.0, 0.0, 0.0),
        up=(-1.0, 0.0, 0.0),
        focal_px=500.0,
        size=(1920, 1080),
    )
    ice = np.array([[-2.25, -22.25, 0], [2.25, -22.25, 0], [2.25, 22.25, 0], [-2.25, 22.25, 0]])
    px = camera.project(ice) + np.random.default_rng(0).normal(0, 0.5, (4, 2))
    guess, measured = (
        camera_from_scene(
            Scene(sheet_points=ice[:, :2], points_px=px, camera_height=height), (1920, 1080)
        ).position[2]
        for height in (None, 14.0)
    )
    assert measured == pytest.approx(14.0, rel=0.01)
    assert abs(guess - 14.0) > 0.5 or lean


def test_points_serve_where_no_corner_is_in_view(tmp_path):
    points = [
        {"sheet": [x, y], "px": [100 * x + 300, 900 - 40 * y]}
        for x, y in [(0, 17.4), (0, 11), (-1.8, 17.4), (1.8, 17.4), (0, 15.5)]
    ]
    scene = load_scene(written(tmp_path, corners_px=None, points=points))
    assert not scene.has_corners
    assert scene.sheet_points.shape == (5, 2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"corners_px": None}, "expected either corners_px or points"),
        ({"corners_px": {"home_left": [1, 2]}}, "corners_px: missing home_right"),
        (corners(home_left=[600]), "corners_px.home_left: expected 2 entries, found 1"),
        (
            corners(home_left=[1300, 1000], home_right=[600, 1000]),
            "home_left and home_right are swapped",
        ),
        (
            corners(
                home_left=[1300, 1000],
                home_right=[600, 1000],
                away_left=[1050, 50],
                away_right=[870, 50],
            ),
            "mirrored",
        ),
        (corners(away_left=[600, 50], away_right=[600, 500]), "in a line"),
        ({"camera_matrix": [[1, 0], [0, 1]]}, "camera_matrix: expected 3 entries, found 2"),
        ({"camera_matrix": [[0, 0, 1], [0, 9, 1], [0, 0, 1]]}, "focal lengths above 0"),
        ({"distortion": [0.1]}, "distortion: expected at least 4 entries, found 1"),
        ({"stone": {"radius": -1}}, "stone.radius: expected a number of at least 0.01, found -1"),
        ({"stone": {"diameter": 1}}, "stone: unknown key diameter"),
        ({"fps": "thirty"}, "fps: expected a number, found text"),
        ({"fps": 0}, "fps: expected a number of at least 0.01, found 0"),
        ({"colour": "red"}, "unknown key colour"),
        ({"sheet": {"length": 10, "width": 4.5}}, "must fit both houses"),
    ],
)
def test_an_error_is_reported_in_one_line_with_its_place(tmp_path, changes, message):
    path = written(tmp_path, **changes)
    with pytest.raises(InputError) as caught:
        load_scene(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "scene.json" in str(caught.value) or caught.value.source is None


def test_points_in_a_line_are_refused(tmp_path):
    points = [{"sheet": [0, y], "px": [300, 50 * y]} for y in (10, 12, 14, 16)]
    with pytest.raises(InputError, match="lie in a line"):
        load_scene(written(tmp_path, corners_px=None, points=points))


def test_three_points_are_too_few():
    with pytest.raises(InputError, match="four or more points"):
        Scene(sheet_points=np.eye(3)[:, :2], points_px=np.eye(3)[:, :2])


POINTS = [
    ([0, 11], [130, 510]),
    ([0, 17], [129, 140]),
    ([-1.8, 17], [20, 143]),
    ([1.8, 17], [236, 142]),
]


def of_a_picture(tmp_path, **more):
    points = [{"sheet": sheet, "px": px} for sheet, px in POINTS]
    return load_scene(written(tmp_path, corners_px=None, points=points, **more))


def test_a_scene_serves_pictures_of_another_size(tmp_path):
    matrix = [[312, 0, 129.5], [0, 312, 259.5], [0, 0, 1]]
    scene = of_a_picture(
        tmp_path, picture_size=[257, 519], image_size=[257, 519], camera_matrix=matrix
    )
    twice = scene.for_size((514, 1038))
    assert twice.points_px[0].tolist() == [260.5, 1020.5]
    assert twice.camera_matrix[0].tolist() == [624.0, 0.0, 259.5]
    assert twice.for_size((257, 519)).points_px == pytest.approx(scene.points_px)
    scene.for_size((256, 518))  # encoders crop to even sides


def test_pictures_of_another_shape_are_refused(tmp_path):
    scene = of_a_picture(tmp_path, picture_size=[257, 519])
    with pytest.raises(InputError, match="257 × 519 px, and this one has 300 × 300 px"):
        scene.for_size((300, 300))


def test_an_older_scene_whose_points_fit_its_lens_is_scaled_with_it(tmp_path):
    older = of_a_picture(tmp_path, image_size=[257, 519])
    twice = older.for_size((514, 1038))
    assert twice.points_px == pytest.approx(2 * (older.points_px + 0.5) - 0.5)


def test_an_older_scene_with_a_lens_calibrated_on_larger_pictures_keeps_its_points(tmp_path):
    older = of_a_picture(tmp_path, image_size=[1028, 2076])
    assert older.for_size((257, 519)).points_px == pytest.approx(older.points_px)
