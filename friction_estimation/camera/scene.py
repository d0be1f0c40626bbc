"""The scene file of a camera: known points of the ice, the lens, the stone; read and checked."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.infrastructure.storage import read_json, write_json
from curling_env.sheet import PAPER_SHEET, Sheet
from curling_env.typing import Floats
from friction_estimation.camera.lens import TERMS

CORNERS = ("home_left", "home_right", "away_right", "away_left")
"""The ice corners in order around the sheet, counter-clockwise seen from above."""
LENS_KEYS = ("camera_matrix", "distortion", "image_size", "reprojection_px")
"""The keys of a camera file; a scene file may have them too."""
MIN_POINTS = 4
MIN_SPREAD = 1e-3
"""Points lie in a line where their narrower extent is below this share of their wider one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """Where a camera sees known points of the ice, and what else is known of it.

    Parameters
    ----------
    sheet_points : (n, 2) known points of the ice, sheet frame [m]
    points_px : (n, 2) the same points in the raw (distorted) image [px]
    camera_matrix : (3, 3) [px], None where it is not known
    distortion : (5,) in the order of `lens.TERMS`; None where it is not known
    image_size : width and height of the images that the camera matrix belongs to [px]; those of
        the film where None
    stone_radius, stone_height : radius and height of the stone's body, without its handle [m]
    sheet : the ice whose points these are
    fps : frames per second where the film's own times are wrong; None trusts the film
    source : the file that it was read from, for messages

    Raises
    ------
    InputError : fewer than four points, points in a line, corners that cross, wrong shapes
    """

    sheet_points: Floats
    points_px: Floats
    camera_matrix: Floats | None = None
    distortion: Floats | None = None
    image_size: tuple[int, int] | None = None
    stone_radius: float = 0.145
    stone_height: float = 0.1143
    sheet: Sheet = PAPER_SHEET
    fps: float | None = None
    source: str | None = None

    def __post_init__(self) -> None:
        n = len(self.points_px)
        if n < MIN_POINTS:
            self._refuse(f"four points of the ice or more are needed, got {n}")
        for name, points in (("px", self.points_px), ("sheet", self.sheet_points)):
            if _in_a_line(points):
                self._refuse(f"the points lie in a line ({name}); spread them over the ice")
        if self.has_corners:
            self._check_quadrilateral()
        if self.stone_radius <= 0 or self.stone_height <= 0:
            self._refuse("radius and height must be positive lengths in metres", "stone")
        if self.fps is not None and self.fps <= 0:
            self._refuse(f"frames per second must be positive, got {self.fps}", "fps")

    def _refuse(self, problem: str, where: str | None = None) -> None:
        if where is None:
            where = "corners_px" if self.has_corners else "points"
        raise InputError(problem, source=self.source, where=where)

    @property
    def has_corners(self) -> bool:
        """Whether the points are the four corners of the ice, in the order of `CORNERS`."""
        corners = np.array([self.sheet.corners[name] for name in CORNERS])
        return self.sheet_points.shape == (4, 2) and bool(np.allclose(self.sheet_points, corners))

    def _check_quadrilateral(self) -> None:
        for i, j, k in combinations(range(4), 3):
            if _in_a_line(self.points_px[[i, j, k]]):
                names = f"{CORNERS[i]}, {CORNERS[j]} and {CORNERS[k]}"
                self._refuse(f"{names} lie in a line; the corners must span the sheet")
        turns = _turns(self.points_px)
        if turns == -4:
            return
        for i, j in combinations(range(4), 2):
            swapped = self.points_px.copy()
            swapped[[i, j]] = swapped[[j, i]]
            if abs(turns) != 4 and _turns(swapped) == -4:
                self._refuse(f"the corners cross: {CORNERS[i]} and {CORNERS[j]} are swapped")
        if abs(turns) != 4:
            self._refuse("the corners cross: going round the sheet they must not change sides")
        self._refuse("the corners are mirrored: left and right, or home and away, are swapped")

    def check_inside(self, size: tuple[int, int]) -> None:
        """Refuse points that lie outside an image of `size` (width, height) px.

        Raises
        ------
        InputError : a point lies outside
        """
        width, height = size
        for i, (u, v) in enumerate(self.points_px):
            if not (-0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5):
                name = CORNERS[i] if self.has_corners else f"point {i + 1}"
                self._refuse(
                    f"{name} at ({u:g}, {v:g}) px lies outside the image of {width} × {height} px"
                )


def load_scene(path: str | Path, camera: str | Path | None = None) -> Scene:
    """A scene from its JSON file.

    Parameters
    ----------
    path : path of the scene file
    camera : a camera file (`curling calibrate`) whose lens replaces the scene's own

    Raises
    ------
    InputError : unreadable file, unknown or missing key, wrong shape, points that span no sheet
    """
    document = read_json(path)
    if camera is not None and isinstance(document, dict):
        document = {key: value for key, value in document.items() if key not in LENS_KEYS}
        document |= _camera_file(camera)
    try:
        return _parse(document, str(path))
    except InputError as error:
        if error.source is not None:
            raise
        raise InputError(error.problem, source=path, where=error.where) from error


def load_lens(path: str | Path) -> dict[str, Any]:
    """The lens in a camera file (`curling calibrate`), as parameters of `Scene`.

    Raises
    ------
    InputError : unreadable file, unknown or missing key, wrong shape
    """
    return _lens(_camera_file(path))


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene file, complete or not at all."""
    document: dict[str, Any] = {}
    if scene.has_corners:
        document["corners_px"] = dict(zip(CORNERS, scene.points_px.tolist(), strict=True))
    else:
        document["points"] = [
            {"sheet": sheet.tolist(), "px": px.tolist()}
            for sheet, px in zip(scene.sheet_points, scene.points_px, strict=True)
        ]
    if scene.camera_matrix is not None:
        document["camera_matrix"] = scene.camera_matrix.tolist()
    if scene.distortion is not None:
        document["distortion"] = scene.distortion.tolist()
    if scene.image_size is not None:
        document["image_size"] = list(scene.image_size)
    document["stone"] = {"radius": scene.stone_radius, "height": scene.stone_height}
    document["sheet"] = {"length": scene.sheet.length, "width": scene.sheet.width}
    if scene.fps is not None:
        document["fps"] = scene.fps
    write_json(path, document)


def _camera_file(path: str | Path) -> dict[str, Any]:
    document = read_json(path)
    try:
        _check_keys(document, "", required={"camera_matrix"}, optional=set(LENS_KEYS))
        _camera_matrix(document["camera_matrix"])
        if "distortion" in document:
            _distortion(document["distortion"])
    except InputError as error:
        raise InputError(error.problem, source=path, where=error.where) from error
    return document


def _parse(document: Any, source: str) -> Scene:
    known = {"corners_px", "points", "stone", "sheet", "fps", *LENS_KEYS}
    _check_keys(document, "", optional=known)
    given: dict[str, Any] = {"source": source}
    if "sheet" in document:
        _check_keys(document["sheet"], "sheet", required={"length", "width"})
        given["sheet"] = Sheet(
            **{key: _number(value, f"sheet.{key}") for key, value in document["sheet"].items()}
        )
    if "stone" in document:
        _check_keys(document["stone"], "stone", optional={"radius", "height"})
        for key, value in document["stone"].items():
            given[f"stone_{key}"] = _number(value, f"stone.{key}")
    if "fps" in document:
        given["fps"] = _number(document["fps"], "fps")
    given |= _lens(document)
    sheet_points, points_px = _points(document, given.get("sheet", PAPER_SHEET))
    return Scene(sheet_points=sheet_points, points_px=points_px, **given)


def _lens(document: Mapping[str, Any]) -> dict[str, Any]:
    given: dict[str, Any] = {}
    if "camera_matrix" in document:
        given["camera_matrix"] = _camera_matrix(document["camera_matrix"])
    if "distortion" in document:
        given["distortion"] = _distortion(document["distortion"])
    if "image_size" in document:
        width, height = _array(document["image_size"], (2,), "image_size")
        if min(width, height) < 1:
            raise InputError("expected width and height in pixels", where="image_size")
        given["image_size"] = (int(width), int(height))
    return given


def _points(document: Mapping[str, Any], sheet: Sheet) -> tuple[Floats, Floats]:
    if ("corners_px" in document) == ("points" in document):
        raise InputError("expected either corners_px or points")
    if "corners_px" in document:
        corners = document["corners_px"]
        _check_keys(corners, "corners_px", required=set(CORNERS))
        return (
            np.array([sheet.corners[name] for name in CORNERS]),
            np.array([_array(corners[name], (2,), f"corners_px.{name}") for name in CORNERS]),
        )
    points = document["points"]
    if not isinstance(points, list):
        raise InputError("expected a list of {sheet: [x, y], px: [u, v]}", where="points")
    for i, point in enumerate(points):
        _check_keys(point, f"points[{i}]", required={"sheet", "px"})
    return (
        np.array(
            [_array(p["sheet"], (2,), f"points[{i}].sheet") for i, p in enumerate(points)]
        ).reshape(-1, 2),
        np.array([_array(p["px"], (2,), f"points[{i}].px") for i, p in enumerate(points)]).reshape(
            -1, 2
        ),
    )


def _camera_matrix(value: Any) -> Floats:
    matrix = _array(value, (3, 3), "camera_matrix")
    if not (matrix[0, 0] > 0 and matrix[1, 1] > 0 and np.array_equal(matrix[2], [0, 0, 1])):
        raise InputError(
            "expected [[f, 0, u], [0, f, v], [0, 0, 1]] with focal lengths above 0",
            where="camera_matrix",
        )
    return matrix


def _distortion(value: Any) -> Floats:
    if isinstance(value, list) and len(value) == 4:  # OpenCV leaves out what follows p2 if it is 0
        value = [*value, *[0.0] * (len(TERMS) - 4)]
    return _array(value, (len(TERMS),), "distortion")


def _check_keys(
    given: Any,
    where: str,
    *,
    required: Set[str] = frozenset[str](),
    optional: Set[str] = frozenset[str](),
) -> None:
    place = where or None
    if not isinstance(given, dict):
        raise InputError(f"expected an object, found {type(given).__name__}", where=place)
    if missing := sorted(required - given.keys()):
        raise InputError(f"missing {', '.join(missing)}", where=place)
    if unknown := sorted(given.keys() - required - optional):
        raise InputError(f"unknown key {', '.join(unknown)}", where=place)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise InputError(f"expected a finite number, found {value!r}", where=where)
    return float(value)


def _array(value: Any, shape: tuple[int, ...], where: str) -> Floats:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(f"expected {' × '.join(map(str, shape))} finite numbers", where=where)
    return array


def _turns(corners_px: Floats) -> int:
    """Corners at which the way round turns right less those at which it turns left.

    -4 for a sheet seen from above: v grows downwards, so counter-clockwise on the ice turns
    negatively in the image.
    """
    sides = np.roll(corners_px, -1, axis=0) - corners_px
    following = np.roll(sides, -1, axis=0)
    return int(np.sign(sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]).sum())


def _in_a_line(points: Floats) -> bool:
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extent[1] <= MIN_SPREAD * extent[0])
