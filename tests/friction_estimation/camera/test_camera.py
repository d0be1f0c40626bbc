"""The camera: forward and back agree, and the pose is found from what a user marks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import InputError
from curling_env.sheet import PAPER_SHEET
from friction_estimation import Scene
from friction_estimation.camera import CORNERS, Camera, camera_from_scene

SIZE = (1920, 1080)
LENS = np.array([-0.12, 0.03, 0.001, -0.0005, 0.0])


def behind_the_end(**changes) -> Camera:
    settings = {
        "position": (1.5, -34.0, 8.0),
        "target": (0.0, -6.0, 0.0),
        "focal_px": 1500.0,
        "size": SIZE,
        "distortion": LENS,
    }
    return Camera.looking_at(**(settings | changes))


def corners_of(camera: Camera, **others) -> Scene:
    sheet = np.array([PAPER_SHEET.corners[name] for name in CORNERS])
    px = camera.project(np.column_stack([sheet, np.zeros(4)]))
    return Scene(sheet_points=sheet, points_px=px, **others)


@given(x=st.floats(-2.2, 2.2), y=st.floats(-20, 20), z=st.floats(0, 0.3), k1=st.floats(-0.2, 0.1))
def test_a_pixel_leads_back_to_the_point_it_shows(x, y, z, k1):
    camera = behind_the_end(distortion=np.array([k1, 0.02, 0.0, 0.0, 0.0]))
    px = camera.project([[x, y, z]])
    assert camera.on_plane(px, z)[0] == pytest.approx([x, y], abs=1e-6)


def test_directions_in_the_image_are_a_viewers():
    camera = behind_the_end(position=(0, -34, 8), target=(0, 0, 0))
    middle, right, far, high = camera.project([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert right[0] > middle[0]
    assert far[1] < middle[1]
    assert high[1] < middle[1]
    assert middle == pytest.approx([960, 540])


def test_a_point_behind_the_camera_has_no_pixel():
    assert np.isnan(behind_the_end().project([[0.0, -60.0, 8.0]])).all()


def test_a_ray_above_the_horizon_meets_no_ice():
    camera = behind_the_end()
    assert np.isnan(camera.on_plane([[960.0, -2500.0]])).all()


@pytest.mark.parametrize(
    ("position", "target", "up"),
    [
        ((0.0, -36.25, 9.0), (0.0, -12.0, 0.0), (0, 0, 1)),
        ((-14.0, 0.0, 11.0), (0.0, 0.0, 0.0), (0, 0, 1)),
        ((0.0, 0.0, 25.0), (0.0, 0.0, 0.0), (-1, 0, 0)),
    ],
)
def test_pose_from_four_corners_with_the_lens_known(position, target, up):
    camera = behind_the_end(position=position, target=target, up=up, focal_px=700.0)
    scene = corners_of(camera, camera_matrix=camera.lens.matrix, distortion=LENS)
    found = camera_from_scene(scene, SIZE)
    assert found.position == pytest.approx(position, abs=1e-3)
    assert found.rotation == pytest.approx(camera.rotation, abs=1e-4)


def test_focal_length_from_four_corners_when_the_lens_is_unknown():
    camera = behind_the_end(distortion=np.zeros(5))
    found = camera_from_scene(corners_of(camera), SIZE)
    assert found.lens.focal_px == pytest.approx(1500, rel=0.01)
    assert found.position == pytest.approx(camera.position, abs=0.3)


def test_of_the_two_poses_of_a_plane_the_one_above_the_ice_is_taken():
    # Nearly straight down, the two poses differ by little and noise could prefer either.
    camera = behind_the_end(
        position=(0.3, 0.2, 25.0), target=(0, 0, 0), up=(-1, 0, 0), focal_px=900.0
    )
    scene = corners_of(camera, camera_matrix=camera.lens.matrix, distortion=LENS)
    shaken = scene.points_px + np.random.default_rng(5).normal(0, 0.3, (4, 2))
    found = camera_from_scene(replace(scene, points_px=shaken), SIZE)
    assert found.position[2] == pytest.approx(25, abs=0.3)


def test_a_camera_square_to_a_side_finds_its_pose_whatever_the_last_digits_are():
    """OpenCV's first pose is not a number where the sign of a rounding error goes the wrong way."""
    none = np.zeros(5)
    camera = behind_the_end(
        position=(-14.0, 0.0, 11.0), target=(0.0, 0.0, 0.0), focal_px=600.0, distortion=none
    )
    scene = corners_of(camera, camera_matrix=camera.lens.matrix, distortion=none)
    for seed in range(40):
        off = 1e-7 * np.random.default_rng(seed).standard_normal((4, 2))
        found = camera_from_scene(replace(scene, points_px=scene.points_px + off), SIZE)
        assert found.position == pytest.approx(camera.position, abs=1e-3)


def test_points_that_no_camera_can_see_so_are_refused():
    camera = behind_the_end()
    scene = corners_of(camera, camera_matrix=camera.lens.matrix, distortion=LENS)
    wrong = scene.points_px.copy()
    wrong[0] = [900.0, 400.0]
    with pytest.raises(InputError, match="no camera above the ice"):
        camera_from_scene(replace(scene, points_px=wrong), SIZE)


def test_points_outside_the_image_are_refused_by_name():
    scene = corners_of(behind_the_end())
    with pytest.raises(InputError, match=r"home_left at .* outside the image of 640 × 360"):
        camera_from_scene(scene, (640, 360))


def test_corners_marked_one_place_round_are_reported():
    camera = behind_the_end()
    scene = corners_of(camera, camera_matrix=camera.lens.matrix, distortion=LENS)
    with pytest.raises(InputError, match="where the next one around the sheet is"):
        camera_from_scene(replace(scene, points_px=np.roll(scene.points_px, 1, axis=0)), SIZE)


def test_the_point_that_contradicts_all_others_is_named():
    camera = behind_the_end()
    places = np.array([[0, -17], [1.8, -17], [-1.8, -17], [0, -11], [2.2, -11], [-2.2, -11]])
    px = camera.project(np.column_stack([places, np.zeros(len(places))]))
    px[3] += [350, -150]
    scene = Scene(
        sheet_points=places, points_px=px, camera_matrix=camera.lens.matrix, distortion=LENS
    )
    with pytest.raises(InputError, match=r"point 4, at \(0, -11\) m on the ice, contradicts"):
        camera_from_scene(scene, SIZE)


def test_intrinsics_of_another_resolution_are_refused():
    camera = behind_the_end()
    scene = corners_of(camera, camera_matrix=camera.lens.matrix * [[2], [2], [1]], distortion=LENS)
    with pytest.raises(InputError, match="for a matrix of another picture size"):
        camera_from_scene(scene, SIZE)
