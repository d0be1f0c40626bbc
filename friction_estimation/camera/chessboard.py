"""The lens of a camera from pictures of a chessboard or a ChArUco board.

The board is held in front of the camera at several tilts. The corners of its squares, located to a
fraction of a pixel, give focal lengths, principal point and distortion.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.infrastructure.files.storage import write_json
from curling_env.typing import Floats, Image, Progress, no_progress, with_progress
from friction_estimation.camera.lens import TERMS, Lens
from friction_estimation.camera.tuning import (
    BOARD_FOCAL_SIGMA,
    BOARD_MIN_CORNERS,
    BOARD_MIN_TILT_DEG,
    BOARD_MIN_VIEWS,
    BOARD_SEARCH_PX,
    TOLERANCE_PX,
)
from friction_estimation.film.pictures import read_picture


@dataclass(frozen=True, kw_only=True)
class Board:
    """A calibration board.

    Parameters
    ----------
    kind : ``chessboard``; or ``charuco``, a chessboard with markers, of which a part suffices
    columns, rows : number of squares
    square : side of a square [m]
    marker : side of a ChArUco marker [m]; three quarters of a square where None
    dictionary : dictionary of the ChArUco markers, OpenCV's name without ``DICT_``

    Raises
    ------
    InputError : sizes that no board has, or an unknown dictionary
    """

    kind: Literal["chessboard", "charuco"] = "chessboard"
    columns: int
    rows: int
    square: float
    marker: float | None = None
    dictionary: str = "4X4_250"

    def __post_init__(self) -> None:
        sides = sorted((self.columns, self.rows))
        least = 4 if self.kind == "chessboard" else 3
        if sides[0] < least or sides[1] < 4 or sides[1] > 100:
            raise InputError(
                f"a {self.kind} has 4 × {least} to 100 × 100 squares, got {self.columns} × "
                f"{self.rows}",
                source="squares",
            )
        if not 1e-4 <= self.square <= 10:
            raise InputError(
                f"must be a positive length of at most 10 metres, got {self.square}",
                source="square size",
            )
        if not 0.01 * self.square < self.marker_size < self.square:
            raise InputError("must be smaller than the square", source="marker size")
        if self.kind == "charuco":
            self.markers()

    @property
    def marker_size(self) -> float:
        """Side of a marker [m]."""
        return 0.75 * self.square if self.marker is None else self.marker

    def markers(self) -> cv2.aruco.Dictionary:
        """Return the dictionary of the markers.

        Raises
        ------
        InputError : an unknown dictionary, or one with too few markers
        """
        code = getattr(cv2.aruco, f"DICT_{self.dictionary.upper()}", None)
        if code is None:
            raise InputError(
                f"unknown dictionary {self.dictionary!r}; expected one such as 4X4_250",
                source="dictionary",
            )
        found = cv2.aruco.getPredefinedDictionary(code)
        if len(found.bytesList) < self.columns * self.rows // 2:
            raise InputError(
                f"{self.dictionary} has only {len(found.bytesList)} markers; the board needs "
                f"{self.columns * self.rows // 2}",
                source="dictionary",
            )
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class LensCalibration:
    """A lens measured on pictures of a board.

    Parameters
    ----------
    lens : the lens
    rms_px : root mean square distance of the corners from where this lens puts them [px]
    focal_sigma_px : standard error of the focal length [px]
    used, unused : pictures in which the board was found, and in which it was not
    """

    lens: Lens
    rms_px: float
    focal_sigma_px: float
    used: tuple[str, ...]
    unused: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """Return the lens and its error for JSON."""
        matrix = self.lens.matrix
        return {
            "focal_px": [matrix[0, 0], matrix[1, 1]],
            "principal_point_px": [matrix[0, 2], matrix[1, 2]],
            "distortion": self.lens.distortion.tolist(),
            "reprojection_px": self.rms_px,
            "used": list(self.used),
            "unused": list(self.unused),
        }


def find_board(image: Image, board: Board) -> tuple[Floats, Floats] | None:
    """Return the board's corners in one picture.

    Parameters
    ----------
    image : (height, width) grey or (height, width, 3) BGR

    Returns
    -------
    (n, 2) corners on the board [m] and (n, 2) in the picture [px]; None where it is not found
    """
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    if board.kind == "chessboard":
        shape = (board.columns - 1, board.rows - 1)
        corners = _chessboard_corners(np.asarray(grey, dtype=np.uint8), shape)
        if corners is None:
            return None
        columns, rows = np.meshgrid(np.arange(shape[0]), np.arange(shape[1]))
        grid = np.column_stack([columns.ravel(), rows.ravel()]) * board.square
        return grid.astype(np.float64), corners.reshape(-1, 2).astype(np.float64)
    best: tuple[Floats, Floats] | None = None
    for legacy in (False, True):  # boards made before OpenCV 4.6 begin with the other colour
        drawn = cv2.aruco.CharucoBoard(
            (board.columns, board.rows), board.square, board.marker_size, board.markers()
        )
        drawn.setLegacyPattern(legacy)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(drawn).detectBoard(grey)
        if ids is None or len(ids) < BOARD_MIN_CORNERS or (best and len(ids) <= len(best[0])):
            continue
        places = np.asarray(drawn.getChessboardCorners(), dtype=np.float64)
        best = places[ids.ravel().astype(np.intp), :2], corners.reshape(-1, 2).astype(np.float64)
    return best


def _chessboard_corners(grey: Image, shape: tuple[int, int]) -> Floats | None:
    """Return the inner corners of a chessboard in a picture, (n, 2) [px]; None if it is not found.

    OpenCV's search takes 170 bytes and a microsecond per pixel. A large picture is therefore
    searched in a reduced copy, and the corners are refined in the original.
    """
    scale = min(1.0, math.sqrt(BOARD_SEARCH_PX / grey.size))
    small = (
        grey
        if scale == 1
        else cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    )
    found, corners = cv2.findChessboardCornersSB(
        small, shape, flags=cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    )
    if not found:
        return None
    places = np.asarray(corners, dtype=np.float32).reshape(-1, 1, 2)
    if scale < 1:
        places = (places + 0.5) / np.float32(scale) - 0.5
        reach = (math.ceil(2 / scale),) * 2
        enough = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-3)
        places = cv2.cornerSubPix(grey, places, reach, (-1, -1), enough)
    return places.reshape(-1, 2).astype(np.float64)


def calibrate_lens(
    images: Sequence[str | Path], board: Board, *, progress: Progress = no_progress
) -> LensCalibration:
    """Camera matrix and distortion from pictures of a board.

    Parameters
    ----------
    images : files; those in which the board is not found are named in the result
    board : the board in them
    progress : called after every file

    Raises
    ------
    InputError : a file that is no picture, pictures of different sizes, fewer than three pictures
        with the board, or views that do not determine the lens

    Source
    ------
    Zhang, A flexible new technique for camera calibration, PAMI 22 (2000), as in OpenCV.
    """
    size: tuple[int, int] | None = None
    views: list[tuple[Floats, Floats]] = []
    used: list[str] = []
    unused: list[str] = []
    for path in with_progress(images, "calibrate", progress):
        grey = read_picture(path, grey=True)
        own = (grey.shape[1], grey.shape[0])
        size = size or own
        if own != size:
            raise InputError(
                f"has {own[0]} × {own[1]} px, the first {size[0]} × {size[1]} px; expected "
                "pictures from one camera at the size of its films",
                source=path,
            )
        found = find_board(grey, board)
        (unused if found is None else used).append(str(path))
        if found is not None:
            views.append(found)
    if size is None or len(views) < BOARD_MIN_VIEWS:
        raise InputError(
            f"a {board.kind} of {board.columns} × {board.rows} squares was found in {len(views)} "
            f"of {len(images)} pictures; expected {BOARD_MIN_VIEWS} or more",
            source="images",
        )
    return _solved(views, size, tuple(used), tuple(unused))


def _solved(
    views: Sequence[tuple[Floats, Floats]],
    size: tuple[int, int],
    used: tuple[str, ...],
    unused: tuple[str, ...],
) -> LensCalibration:
    undetermined = InputError(
        "the views do not fix the focal length; tilt the board to all sides, and fill the "
        "picture with it",
        source="images",
    )
    flat = [np.column_stack([b, np.zeros(len(b))]).astype(np.float32) for b, _ in views]
    seen = [px.astype(np.float32).reshape(-1, 1, 2) for _, px in views]
    try:
        rms_px, matrix, distortion, turns, _, sigma, *_ = cv2.calibrateCameraExtended(
            flat, seen, size, None, None
        )
    except cv2.error as error:
        raise undetermined from error
    if rms_px > TOLERANCE_PX:
        raise InputError(
            f"the reprojection error is {rms_px:.1f} px; check the kind and squares of the board",
            source="images",
        )
    lens = Lens(
        matrix=np.asarray(matrix, dtype=np.float64),
        distortion=np.asarray(distortion, dtype=np.float64).ravel()[: len(TERMS)],
        size=size,
    )
    focal_sigma_px = float(np.asarray(sigma).ravel()[:2].max())
    tilt = max(np.degrees(np.arccos(min(abs(cv2.Rodrigues(r)[0][2, 2]), 1))) for r in turns)
    if tilt < BOARD_MIN_TILT_DEG or not focal_sigma_px < BOARD_FOCAL_SIGMA * lens.focal_px:
        raise undetermined
    return LensCalibration(
        lens=lens, rms_px=float(rms_px), focal_sigma_px=focal_sigma_px, used=used, unused=unused
    )


def save_lens(calibration: LensCalibration, path: str | Path) -> None:
    """Write a camera file, whose keys may also be in a scene file."""
    lens = calibration.lens
    write_json(
        path,
        {
            "camera_matrix": lens.matrix.tolist(),
            "distortion": lens.distortion.tolist(),
            "image_size": list(lens.size),
            "reprojection_px": calibration.rms_px,
        },
    )
