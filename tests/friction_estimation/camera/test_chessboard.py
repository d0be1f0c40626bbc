"""The lens from pictures of a board, drawn here through a camera whose lens is known."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from friction_estimation import load_scene
from friction_estimation.camera import (
    Board,
    Camera,
    calibrate_lens,
    camera_from_scene,
    chessboard,
    find_board,
)
from friction_estimation.synthetic import scene_of

SIZE = (640, 480)
FOCAL_PX = 620.0
LENS = (-0.21, 0.06, 0.001, -0.0015, 0.0)
CHESS = Board(columns=8, rows=6, square=0.022)
CHARUCO = Board(kind="charuco", columns=7, rows=5, square=0.028)
PX_PER_M = 4000.0


def drawn(board):
    """The board as a flat picture, (rows, columns), and how many pixels make a metre."""
    size = (
        round(board.columns * board.square * PX_PER_M),
        round(board.rows * board.square * PX_PER_M),
    )
    if board.kind == "charuco":
        pattern = cv2.aruco.CharucoBoard(
            (board.columns, board.rows), board.square, board.marker_size, board.markers()
        )
        return pattern.generateImage(size, marginSize=0)
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    side = board.square * PX_PER_M
    return np.where((x // side + y // side) % 2 == 0, 0, 255).astype(np.uint8)


def views(count=6):
    """Cameras with one lens before a board at the origin, tilted to all sides."""
    for i in range(count):
        a = 2 * np.pi * i / count
        x, y = 0.13 * np.cos(a), 0.13 * np.sin(a)
        yield Camera.looking_at(
            position=(x, y, 0.22 + 0.02 * (i % 3)),
            target=(0.03 * np.sin(2 * a), 0.03 * np.cos(3 * a), 0.0),
            up=(0.2 * np.sin(a), 1.0, 0.0),
            focal_px=FOCAL_PX,
            size=SIZE,
            distortion=LENS,
        )


FINE = 2
"""Number of samples of a pixel each way."""


@cache
def rays():
    """Rays of all samples in the frame of a camera with the lens of `views`, (n, 3)."""
    u, v = np.meshgrid(np.arange(SIZE[0] * FINE), np.arange(SIZE[1] * FINE))
    px = (np.column_stack([u.ravel(), v.ravel()]) + 0.5) / FINE - 0.5
    return next(views()).lens.rays(px)


def picture(camera, board, rng):
    """Picture of the board: several samples a pixel, averaged, with noise."""
    flat = cv2.copyMakeBorder(drawn(board), 60, 60, 60, 60, cv2.BORDER_CONSTANT, value=235)
    turned, position = rays() @ camera.rotation, camera.position
    xy = position[:2] - position[2] / turned[:, 2:] * turned[:, :2]
    middle = np.array([board.columns, board.rows]) * board.square / 2
    # Seen from above, y points up and a picture's rows down.
    at = np.column_stack([xy[:, 0] + middle[0], middle[1] - xy[:, 1]]) * PX_PER_M + 60 - 0.5
    at = at.astype(np.float32).reshape(SIZE[1] * FINE, SIZE[0] * FINE, 2)
    seen = cv2.remap(cv2.GaussianBlur(flat, (0, 0), 2), at, None, cv2.INTER_LINEAR, borderValue=200)
    seen = cv2.resize(seen, SIZE, interpolation=cv2.INTER_AREA).astype(np.float64)
    return np.clip(seen + rng.normal(0, 1.5, seen.shape), 0, 255).astype(np.uint8)


def test_a_large_picture_is_searched_in_a_smaller_one(monkeypatch):
    monkeypatch.setattr(chessboard, "BOARD_SEARCH_PX", SIZE[0] * SIZE[1] // 5)
    rng = np.random.default_rng(6)
    for camera in views(3):
        board, px = chessboard.find_board(picture(camera, CHESS, rng), CHESS)
        middle = np.array([CHESS.columns / 2 - 1, CHESS.rows / 2 - 1]) * CHESS.square
        # The board may be found from either end, and its rows go down the picture.
        flat = np.column_stack([board[:, 0] - middle[0], middle[1] - board[:, 1], 0 * board[:, 0]])
        misses = [np.hypot(*(camera.project(side * flat) - px).T) for side in (1.0, -1.0)]
        assert min(miss.max() for miss in misses) < 0.2


def written(folder, board):
    rng = np.random.default_rng(5)
    paths = []
    for i, camera in enumerate(views()):
        paths.append(folder / f"{board.kind}-{i}.png")
        cv2.imwrite(str(paths[-1]), picture(camera, board, rng))
    return paths


@pytest.fixture(scope="module")
def chess(tmp_path_factory):
    return written(tmp_path_factory.mktemp("chess"), CHESS)


@pytest.fixture(scope="module")
def charuco(tmp_path_factory):
    return written(tmp_path_factory.mktemp("charuco"), CHARUCO)


def assert_lens(matrix, distortion):
    """Focal length within 0.3 %, principal point within 2 px, and rays within 0.6 px."""
    matrix = np.asarray(matrix)
    assert np.diag(matrix)[:2] == pytest.approx([FOCAL_PX, FOCAL_PX], rel=0.003)
    assert matrix[:2, 2] == pytest.approx([320.0, 240.0], abs=2.0)
    ray = np.array([[0.0, 0.0, 1.0], [0.25, 0.1, 1.0], [-0.3, 0.2, 1.0], [0.35, -0.3, 1.0]])
    true = np.array([[FOCAL_PX, 0, 320.0], [0, FOCAL_PX, 240.0], [0, 0, 1]])
    zero = np.zeros(3)
    seen = cv2.projectPoints(ray, zero, zero, matrix, np.asarray(distortion))[0]
    expected = cv2.projectPoints(ray, zero, zero, true, np.array(LENS))[0]
    shift = (seen - expected).reshape(-1, 2)
    assert shift - shift[0] == pytest.approx(np.zeros((4, 2)), abs=0.6)


@pytest.mark.parametrize("name", ["chess", "charuco"])
def test_the_lens_is_recovered_from_pictures_of_a_board(name, request):
    board = CHESS if name == "chess" else CHARUCO
    found = calibrate_lens(request.getfixturevalue(name), board)
    assert len(found.used) >= 6
    assert found.rms_px < 0.3
    assert found.lens.size == SIZE
    assert_lens(found.lens.matrix, found.lens.distortion)


def test_pictures_without_the_board_are_left_out_and_named(chess, tmp_path):
    blank = tmp_path / "blank.png"
    cv2.imwrite(str(blank), np.full((480, 640), 128, dtype=np.uint8))
    found = calibrate_lens([*chess[:4], blank], CHESS)
    assert found.unused == (str(blank),)
    assert len(found.used) == 4


def test_a_board_of_other_squares_is_not_found(chess):
    assert find_board(cv2.imread(str(chess[0])), Board(columns=12, rows=9, square=0.03)) is None


def test_the_command_writes_a_camera_that_a_scene_accepts(chess, tmp_path, curling, must_fit):
    camera = tmp_path / "camera.json"
    arguments = ["--squares", "8x6", "--square-size", "0.022", "-o", str(camera)]
    done = curling("calibrate", *chess, *arguments)
    assert done.status == 0, done.err
    report = done.json()
    must_fit(camera, "lens-1")
    document = json.loads(camera.read_text())
    assert document["reprojection_px"] == report["reprojection_px"] < 0.3
    assert_lens(document["camera_matrix"], document["distortion"])
    corners = {"home_left": [100, 400], "home_right": [500, 400]}
    corners |= {"away_left": [280, 60], "away_right": [330, 60]}
    old = {"camera_matrix": [[9, 0, 1], [0, 9, 1], [0, 0, 1]], "distortion": [1, 0, 0, 0, 0]}
    scene_file = tmp_path / "scene.json"
    scene_file.write_text(json.dumps({"corners_px": corners} | old))
    scene = load_scene(scene_file, camera)
    assert scene.camera_matrix.tolist() == document["camera_matrix"]
    assert scene.distortion.tolist() == document["distortion"]
    assert scene.image_size == SIZE
    scene_file.write_text(json.dumps({"corners_px": corners} | document))
    assert load_scene(scene_file).camera_matrix.tolist() == document["camera_matrix"]


def test_a_calibration_serves_a_resized_film_and_refuses_a_cropped_one():
    board = np.array([[620.0, 0, 320.5], [0, 620.0, 239.5], [0, 0, 1]])
    camera = Camera.looking_at(
        position=(1, -34, 8), target=(0, -9, 0), focal_px=1000.0, size=(1280, 960)
    )
    scene = scene_of(camera)
    known = replace(scene, camera_matrix=board, image_size=(640, 480))
    assert camera_from_scene(known, (1280, 960)).lens.matrix[0].tolist() == [1240.0, 0.0, 641.5]
    with pytest.raises(InputError, match="calibrated on 640 × 480 px"):
        camera_from_scene(known, (1280, 980))


@pytest.mark.parametrize(
    ("files", "options", "complaint"),
    [
        (["missing.png"], [], "missing.png: no such picture"),
        (["noise.png"], [], "noise.png: cannot be read; expected a picture"),
        (["blank.png", "small.png"], [], "small.png: has 320 × 240 px, the first"),
        (["blank.png"], [], "found in 0 of 1 pictures"),
        (["blank.png"], ["--squares", "nine"], "--squares: expected columns x rows"),
        (["blank.png"], ["--squares", "2x2"], "4 × 4 to 100 × 100 squares"),
        (["blank.png"], ["--squares", "4x3"], "4 × 4 to 100 × 100 squares"),
        (["blank.png"], ["--square-size", "-1"], "positive length of at most 10 metres"),
        (["blank.png"], ["--board", "charuco", "--dictionary", "9X9"], "unknown dictionary"),
        (["blank.png"], ["--board", "charuco", "--squares", "40x40"], "has only 250 markers"),
    ],
)
def test_bad_pictures_end_in_one_line(tmp_path, curling, files, options, complaint):
    cv2.imwrite(str(tmp_path / "blank.png"), np.full((480, 640), 128, dtype=np.uint8))
    cv2.imwrite(str(tmp_path / "small.png"), np.full((240, 320), 128, dtype=np.uint8))
    (tmp_path / "noise.png").write_bytes(b"no picture at all")
    output = tmp_path / "camera.json"
    paths = [tmp_path / name for name in files]
    refused = curling("calibrate", *paths, *options, "-o", output)
    assert complaint in refused.complaint
    assert not output.exists()


def test_views_without_tilt_do_not_fix_the_focal_length(tmp_path):
    rng = np.random.default_rng(2)
    paths = []
    for i, height in enumerate((0.28, 0.29, 0.3)):
        camera = Camera.looking_at(
            position=(0.0, 0.0, height),
            target=(0, 0, 0),
            up=(0, 1, 0),
            focal_px=FOCAL_PX,
            size=SIZE,
        )
        paths.append(tmp_path / f"flat-{i}.png")
        cv2.imwrite(str(paths[-1]), picture(camera, CHESS, rng))
    with pytest.raises(InputError, match="tilt the board"):
        calibrate_lens(paths, CHESS)
