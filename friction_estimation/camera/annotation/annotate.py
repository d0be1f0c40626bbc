"""What marks made by hand mean: the camera they speak for, and how well the paint agrees."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.sheet import (
    BACK_LINE_Y,
    HOG_LINE_Y,
    RING_RADII,
    TEE_Y,
    Sheet,
)
from curling_env.typing import Floats, Image
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.markings import (
    brightness,
    keypoints_of,
    markings_of,
    measure_markings,
)
from friction_estimation.camera.markings_fit import MIN_READINGS
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.refinement import MIN_SHARE, refine
from friction_estimation.camera.scene import CORNERS, MIN_POINTS, Scene
from friction_estimation.camera.top_view import TopView
from friction_estimation.film.video import Film

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""Endings that are read as one picture instead of a film."""
STILLS = 9
"""Frames of a film that can be looked at; their median is the ice without what moves on it."""
VIEW_PX_PER_M = 26.0
"""Scale of the top view."""
NEAR_PX = 2.0
"""Paint this near to where the corrected camera puts it is what it was corrected by."""
CURVE_STEP = 0.25
"""Distance between points of a painted line [m]; a lens bends it between them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """What a set of marks says of the camera.

    Parameters
    ----------
    scene : with these marks
    camera : that sees them so
    misfit_px : root mean square distance of the marks from where the camera puts them [px]
    paint_px : how far the paint on the ice lies from where the camera puts it [px]; None where
        the paint was not asked or too little of it is in view
    """

    scene: Scene
    camera: Camera
    misfit_px: float
    paint_px: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Annotation:
    """A film, or one picture, in which places on the ice are marked.

    Parameters
    ----------
    name : of the file
    stills : pictures that can be looked at, (height, width, 3) BGR; the first is without what
        moves
    sheet : whose places are marked
    known : what else the scene shall say, by `Scene`'s parameters: lens, stone, rate
    marks : made before, the place's name to its pixel
    """

    name: str
    stills: list[Image]
    sheet: Sheet
    known: Mapping[str, Any] = field(default_factory=dict)
    marks: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @classmethod
    def open(
        cls, path: str | Path, sheet: Sheet, known: Mapping[str, Any] | None = None
    ) -> Annotation:
        """Look at a film or picture.

        Raises
        ------
        InputError : missing, or neither a film nor a picture
        """
        path = Path(path)
        if path.suffix.lower() in PICTURES:
            picture = cv2.imread(str(path)) if path.exists() else None
            if picture is None:
                raise InputError("not a picture that can be read", source=path)
            stills = [picture]
        else:
            frames = [frame for _, frame in Film.open(path).sample(STILLS)]
            empty = np.median(np.stack(frames), axis=0).astype(np.uint8)
            stills = [empty, *frames]
        return cls(name=path.name, stills=stills, sheet=sheet, known=known or {})

    @classmethod
    def from_scene(cls, path: str | Path, scene: Scene) -> Annotation:
        """Go on from a scene: its marks, its sheet and all else it says are kept.

        Raises
        ------
        InputError : as `open`, or a point of the scene lies where no place has a name
        """
        names = {np.round(xy, 3).tobytes(): name for name, xy in keypoints_of(scene.sheet).items()}
        marks: dict[str, tuple[float, float]] = {}
        for i, (xy, px) in enumerate(zip(scene.sheet_points, scene.points_px, strict=True)):
            name = names.get((np.round(xy, 3) + 0.0).tobytes())
            if name is None:
                raise InputError(
                    "only corners and crossings of lines can be marked on the page; "
                    f"({xy[0]:g}, {xy[1]:g}) m is neither",
                    source=scene.source,
                    where=f"points[{i}]",
                )
            marks[name] = (float(px[0]), float(px[1]))
        known = {f.name: getattr(scene, f.name) for f in fields(scene)}
        for own in ("sheet_points", "points_px", "sheet", "source"):
            del known[own]
        return replace(cls.open(path, scene.sheet, known), marks=marks)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture [px]."""
        rows, columns = self.stills[0].shape[:2]
        return columns, rows

    def scene(self, marks: Mapping[str, tuple[float, float]]) -> Scene:
        """The scene that holds these marks.

        The four corners alone become `corners_px`, anything else `points`.

        Raises
        ------
        InputError : a name that is no place, fewer than four, in a line, crossed or mirrored
        """
        places = keypoints_of(self.sheet)
        if unknown := sorted(marks.keys() - places.keys()):
            raise InputError(f"no such place on the ice: {', '.join(unknown)}")
        if len(marks) < MIN_POINTS:
            raise InputError(f"mark {MIN_POINTS - len(marks)} more: four places are needed")
        names = CORNERS if marks.keys() == set(CORNERS) else tuple(n for n in places if n in marks)
        return Scene(
            sheet_points=np.array([places[name] for name in names]),
            points_px=np.array([marks[name] for name in names], dtype=np.float64),
            sheet=self.sheet,
            **self.known,
        )

    def read(self, marks: Mapping[str, tuple[float, float]], *, paint: bool = False) -> Reading:
        """The camera under which the marks fall where they were made.

        Parameters
        ----------
        marks : place by name to its pixel in the raw image
        paint : let the painted lines correct it, as tracking does; takes a second or two

        Raises
        ------
        InputError : as `scene`, or that no camera above the ice can see the marks so
        """
        scene = self.scene(marks)
        camera = camera_from_scene(scene, self.size)
        paint_px = None
        if paint:
            camera = refine(camera, scene, self.stills[0]).camera
            paint_px = self._paint_px(camera)
        there = np.column_stack([scene.sheet_points, np.zeros(len(scene.sheet_points))])
        apart = camera.project(there) - scene.points_px
        return Reading(
            scene=scene,
            camera=camera,
            misfit_px=float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))),
            paint_px=paint_px,
        )

    def _paint_px(self, camera: Camera) -> float | None:
        grey = brightness(self.stills[0])
        readings = measure_markings(grey, (0, 0), camera, markings_of(self.sheet), NEAR_PX)
        if len(readings.index) < max(MIN_READINGS, MIN_SHARE * readings.expected):
            return None
        return float(np.sqrt(np.mean(readings.offset_px**2)))

    def painted(self, camera: Camera) -> list[list[list[float]]]:
        """Where a camera puts the lines of the sheet: polylines of raw pixels inside the image."""
        lines: list[list[list[float]]] = []
        for curve in curves_of(self.sheet):
            points = np.column_stack([curve, np.zeros(len(curve))])
            px = camera.project(points)
            px[~camera.sees(points)] = np.nan
            for part in np.split(px, np.flatnonzero(~np.isfinite(px).all(axis=1))):
                inside = part[np.isfinite(part).all(axis=1)]
                if len(inside) > 1:
                    lines.append(np.round(inside, 2).tolist())
        return lines

    def from_above(self, camera: Camera, still: int = 0) -> Image:
        """The ice seen from above as a camera shows it, the home end on the left."""
        view = TopView.of(self.sheet, VIEW_PX_PER_M).of_frame(self.stills[still], camera)
        return np.asarray(cv2.rotate(view, cv2.ROTATE_90_CLOCKWISE), dtype=np.uint8)


def curves_of(sheet: Sheet) -> list[Floats]:
    """The painted lines, rings and the border as polylines, each (n, 2) in the sheet frame [m]."""
    x, y = sheet.width / 2, sheet.length / 2

    def line(start: tuple[float, float], stop: tuple[float, float]) -> Floats:
        count = int(np.ceil(np.hypot(stop[0] - start[0], stop[1] - start[1]) / CURVE_STEP)) + 1
        return np.linspace(start, stop, count)

    curves = [
        line((-x, -y), (-x, y)),
        line((x, -y), (x, y)),
        line((0, -BACK_LINE_Y), (0, BACK_LINE_Y)),
    ]
    around = np.linspace(0, 2 * np.pi, 73)
    for s in (-1, 1):
        for depth in (y, BACK_LINE_Y, TEE_Y, HOG_LINE_Y):
            curves.append(line((-x, s * depth), (x, s * depth)))
        for radius in RING_RADII:
            ring = radius * np.column_stack([np.cos(around), np.sin(around)])
            curves.append(ring + np.array([0.0, s * TEE_Y]))
    return curves
