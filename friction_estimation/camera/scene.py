"""Scene file of a camera: known points of the ice, the lens, the stone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from curling_env.errors import InputError, placed
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.schema import Document, FileFormat, Short, checked, within
from curling_env.infrastructure.files.storage import write_json
from curling_env.sheet import PAPER_SHEET, Sheet
from curling_env.typing import Floats
from friction_estimation.camera.lens import TERMS, resized_matrix
from friction_estimation.camera.tuning import PAINT_DEPTH, PAINT_DEPTH_ERROR

CORNERS = ("home_left", "home_right", "away_right", "away_left")
"""The ice corners in order around the sheet, counter-clockwise seen from above."""
SCENE_FORMAT = FileFormat(name="curling-scene/1", what="a scene", numbered=False)
LENS_KEYS = ("camera_matrix", "distortion", "image_size", "reprojection_px")
"""The keys of a camera file; a scene file may have them too."""
OPTIONAL = (
    *("place_sigma", "picture_size", "camera_matrix", "distortion", "image_size"),
    *("camera_height", "paint_depth", "fps"),
)
"""The keys of a scene file that are omitted where the scene does not have them."""
CAMERA_HEIGHTS = (0.5, 50.0)
"""Minimum and maximum height of cameras above the ice [m]."""
PAINT_DEPTHS = 0.0, 0.1
"""Minimum and maximum thickness of the ice above the paint [m]."""
MIN_POINTS, MAX_POINTS = 4, 500
"""Maximum number of points of a scene. People mark a dozen; a thousand would take a minute to
fit."""
SIZE_ROUNDING_PX = 2.0
"""Maximum cropping of a picture's side: encoders crop to even sides [px]."""
MIN_SPREAD = 1e-3
"""Minimum ratio of the narrower to the wider extent of points that are not collinear."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """Known points of the ice in a camera's picture, and other knowledge about the camera.

    Parameters
    ----------
    sheet_points : (n, 2) known points of the ice, sheet frame [m]
    points_px : (n, 2) the same points in the raw (distorted) image [px]
    camera_matrix : (3, 3) [px], None where it is not known
    distortion : (5,) in the order of `lens.TERMS`; None where it is not known
    image_size : width and height of the images that the camera matrix belongs to [px]; those of
        the film where None
    picture_size : width and height of the picture in which the points were marked [px]; None where
        an older scene file does not have it
    paint_depth : thickness of the clear ice above the paint [m]; None if unknown
    camera_height : measured height of the camera above the ice [m]; None where it was not measured
    stone_radius, stone_height : radius and height of the stone's body, without its handle [m]
    sheet : the ice whose points these are
    fps : frames per second where the film's own times are wrong; None trusts the film
    source : the file that it was read from, for messages
    place_sigma : (k, 3) places on the ice, and the standard error there of each coordinate due to
        the camera, as `curling locate` found it [m]; None for points marked by hand

    Raises
    ------
    InputError : fewer than four points, points in a line, corners that cross, wrong shapes
    """

    sheet_points: Floats
    points_px: Floats
    camera_matrix: Floats | None = None
    distortion: Floats | None = None
    image_size: tuple[int, int] | None = None
    picture_size: tuple[int, int] | None = None
    camera_height: float | None = None
    paint_depth: float | None = None
    stone_radius: float = 0.145
    stone_height: float = 0.1143
    sheet: Sheet = PAPER_SHEET
    fps: float | None = None
    source: str | None = None
    place_sigma: Floats | None = None

    def __post_init__(self) -> None:
        n = len(self.points_px)
        if n < MIN_POINTS:
            self._refuse(f"expected four or more points on the ice, got {n}")
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
    def ice_above_paint(self) -> tuple[float, float]:
        """Thickness of the clear ice above the paint, and its standard error [m]."""
        return PAINT_DEPTH if self.paint_depth is None else (self.paint_depth, PAINT_DEPTH_ERROR)

    @property
    def has_corners(self) -> bool:
        """Return whether the points are the four corners of the ice, in the order of `CORNERS`."""
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

    def for_size(self, size: tuple[int, int]) -> Scene:
        """Return the scene for pictures of another size (width, height) [px] with the same view.

        Points and camera matrix are scaled. For an older scene without the size of its picture, it
        is the smaller one of lens and film that contains the points.

        Raises
        ------
        InputError : pictures of another shape: they are cropped, or of another camera
        """
        marked = self.picture_size
        if marked is None and self.image_size is not None:
            fitting = [s for s in (self.image_size, size) if (self.points_px <= s).all()]
            marked = min(fitting, default=size)
        points, matrix = self.points_px, self.camera_matrix
        if marked is not None and marked != size:
            self._check_shape("was marked in pictures of", marked, size, "mark it in this one")
            points = (points + 0.5) * np.divide(size, marked) - 0.5
        if matrix is not None and self.image_size is not None and self.image_size != size:
            own = self.image_size
            self._check_shape("has a lens calibrated on", own, size, "calibrate it as it films")
            matrix = resized_matrix(matrix, np.divide(size, own))
        known = None if self.image_size is None else size
        return replace(
            self, points_px=points, camera_matrix=matrix, image_size=known, picture_size=size
        )

    def _check_shape(
        self, what: str, own: tuple[int, int], size: tuple[int, int], advice: str
    ) -> None:
        scale = size[0] / own[0]
        if abs(size[1] - scale * own[1]) > SIZE_ROUNDING_PX * max(1.0, scale):
            self._refuse(
                f"the scene {what} {own[0]} × {own[1]} px, and this one has {size[0]} × "
                f"{size[1]} px, another aspect ratio; {advice}",
                "image_size" if self.picture_size is None else "picture_size",
            )

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


def load_scene(
    path: str | Path, camera: str | Path | None = None, height: float | None = None
) -> Scene:
    """Load a scene from its JSON file.

    Parameters
    ----------
    path : path of the scene file
    camera : a camera file (`curling calibrate`) whose lens replaces the scene's own
    height : measured height of the camera [m], which replaces the scene's own

    Raises
    ------
    InputError : unreadable file, unknown or missing key, wrong shape, points that span no sheet
    """
    document = read_json(path)
    with placed(source=path):
        if isinstance(document, dict):
            document = SCENE_FORMAT.accept(document)
            if camera is not None:
                document = {key: value for key, value in document.items() if key not in LENS_KEYS}
                document |= _camera_file(camera)
            if height is not None:
                document["camera_height"] = height
        return scene_of(document, str(path))


def load_lens(path: str | Path) -> dict[str, Any]:
    """Load the lens of a camera file (`curling calibrate`), as parameters of `Scene`.

    Raises
    ------
    InputError : unreadable file, unknown or missing key, wrong shape
    """
    return _lens(checked(_camera_file(path), LensDocument))


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene file, complete or not at all."""
    write_json(path, document_of(scene))


def document_of(scene: Scene) -> dict[str, Any]:
    """Return the document of a scene."""
    document: dict[str, Any] = {"format": SCENE_FORMAT.name}
    if scene.has_corners:
        document["corners_px"] = dict(zip(CORNERS, scene.points_px.tolist(), strict=True))
    else:
        document["points"] = [
            {"sheet": sheet.tolist(), "px": px.tolist()}
            for sheet, px in zip(scene.sheet_points, scene.points_px, strict=True)
        ]
    for name in OPTIONAL:
        if (value := getattr(scene, name)) is not None:
            document[name] = np.asarray(value).tolist()
    document["stone"] = {"radius": scene.stone_radius, "height": scene.stone_height}
    document["sheet"] = {"length": scene.sheet.length, "width": scene.sheet.width}
    return document


# --- their documents -----------------------------------------------------------------------------

Metres = Annotated[float, within(-1e4, 1e4, "m")]
Pixels = Annotated[float, within(-1e6, 1e6, "px")]
Sigma = Annotated[float, within(0.0, 1e4, "m")]
Side = Annotated[float, within(1, 1e5, "px")]


class CornersDocument(Document):
    """Corners of the ice in the picture."""

    home_left: tuple[Pixels, Pixels]
    home_right: tuple[Pixels, Pixels]
    away_left: tuple[Pixels, Pixels]
    away_right: tuple[Pixels, Pixels]


class PointDocument(Document):
    """Known point of the ice and its pixel."""

    sheet: tuple[Metres, Metres]
    px: tuple[Pixels, Pixels]


class SceneStoneDocument(Document):
    """The stone's body without its handle."""

    radius: Annotated[float, within(0.01, 1.0, "m")] = 0.145
    height: Annotated[float, within(0.001, 1.0, "m")] = 0.1143


class SceneSheetDocument(Document):
    """The size of the ice."""

    length: Annotated[float, within(1.0, 1000.0, "m")]
    width: Annotated[float, within(1.0, 1000.0, "m")]


Row = tuple[Pixels, Pixels, Pixels]
Term = Annotated[float, within(-1e6, 1e6)]


class LensDocument(Document):
    """The lens, as `curling calibrate` writes it."""

    camera_matrix: tuple[Row, Row, Row] | None = None
    distortion: Annotated[list[Term], Meta(min_length=4, max_length=len(TERMS))] | None = None
    image_size: tuple[Side, Side] | None = None
    reprojection_px: float | None = None


class SceneDocument(LensDocument):
    """A scene file."""

    format: Short = ""
    picture_size: tuple[Side, Side] | None = None
    place_sigma: (
        Annotated[list[tuple[Metres, Metres, Sigma]], Meta(min_length=1, max_length=MAX_POINTS)]
        | None
    ) = None
    corners_px: CornersDocument | None = None
    points: Annotated[list[PointDocument], Meta(max_length=MAX_POINTS)] | None = None
    camera_height: Annotated[float, within(*CAMERA_HEIGHTS, "m")] | None = None
    paint_depth: Annotated[float, within(*PAINT_DEPTHS, "m")] | None = None
    stone: SceneStoneDocument = msgspec.field(default_factory=SceneStoneDocument)
    sheet: SceneSheetDocument | None = None
    fps: Annotated[float, within(0.01, 1e5, "1/s")] | None = None


def _camera_file(path: str | Path) -> dict[str, Any]:
    document = read_json(path)
    with placed(source=path):
        lens = checked(document, LensDocument)
        if lens.camera_matrix is None:
            raise InputError("missing camera_matrix")
        _lens(lens)
    return document


def scene_of(document: Any, source: str) -> Scene:
    """Return the scene of a document.

    Parameters
    ----------
    document : content of a scene file
    source : where it comes from, for messages

    Raises
    ------
    InputError : see `load_scene`
    """
    scene = checked(document, SceneDocument)
    sheet = PAPER_SHEET
    if scene.sheet is not None:
        sheet = Sheet(length=scene.sheet.length, width=scene.sheet.width)
    sheet_points, points_px = _points(scene, sheet)
    return Scene(
        sheet_points=sheet_points,
        points_px=points_px,
        camera_height=scene.camera_height,
        paint_depth=scene.paint_depth,
        stone_radius=scene.stone.radius,
        stone_height=scene.stone.height,
        sheet=sheet,
        fps=scene.fps,
        picture_size=_whole(scene.picture_size),
        place_sigma=None if scene.place_sigma is None else np.array(scene.place_sigma),
        source=source,
        **_lens(scene),
    )


def _lens(document: LensDocument) -> dict[str, Any]:
    given: dict[str, Any] = {}
    if document.camera_matrix is not None:
        given["camera_matrix"] = _camera_matrix(document.camera_matrix)
    if document.distortion is not None:
        # OpenCV omits the terms after p2 if they are 0.
        terms = [*document.distortion, *[0.0] * (len(TERMS) - len(document.distortion))]
        given["distortion"] = np.array(terms)
    if document.image_size is not None:
        given["image_size"] = _whole(document.image_size)
    return given


def _whole(size: tuple[float, float] | None) -> tuple[int, int] | None:
    return None if size is None else (int(size[0]), int(size[1]))


def _points(scene: SceneDocument, sheet: Sheet) -> tuple[Floats, Floats]:
    if (scene.corners_px is None) == (scene.points is None):
        raise InputError("expected either corners_px or points")
    if scene.corners_px is not None:
        return (
            np.array([sheet.corners[name] for name in CORNERS]),
            np.array([getattr(scene.corners_px, name) for name in CORNERS]),
        )
    points = scene.points or []
    return (
        np.array([point.sheet for point in points], dtype=np.float64).reshape(-1, 2),
        np.array([point.px for point in points], dtype=np.float64).reshape(-1, 2),
    )


def _camera_matrix(rows: Any) -> Floats:
    matrix = np.array(rows, dtype=np.float64)
    if not (matrix[0, 0] > 0 and matrix[1, 1] > 0 and np.array_equal(matrix[2], [0, 0, 1])):
        raise InputError(
            "expected [[f, 0, u], [0, f, v], [0, 0, 1]] with focal lengths above 0",
            where="camera_matrix",
        )
    return matrix


def _turns(corners_px: Floats) -> int:
    """Return the number of right turns minus left turns around the corners.

    -4 for a sheet seen from above: v grows downwards, so counter-clockwise on the ice turns
    negatively in the image.
    """
    sides = np.roll(corners_px, -1, axis=0) - corners_px
    following = np.roll(sides, -1, axis=0)
    return int(np.sign(sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]).sum())


def _in_a_line(points: Floats) -> bool:
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extent[1] <= MIN_SPREAD * extent[0])
