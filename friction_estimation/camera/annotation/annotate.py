"""Evaluation of clicked points: the camera that fits them, and its agreement with the paint."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeAlias

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.sheet import Sheet
from curling_env.typing import Image
from friction_estimation.camera.annotation.verdict import SHEETS, better_sheet, problems_of
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.expected import (
    ExpectedError,
    expected_errors,
    expected_of_scene,
)
from friction_estimation.camera.markings import curves_of, keypoints_of
from friction_estimation.camera.pose import camera_from_scene, marked_camera
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.camera.refinement import refine
from friction_estimation.camera.scene import CORNERS, MIN_POINTS, Scene
from friction_estimation.camera.top_view import TopView
from friction_estimation.film.pictures import SUFFIXES, read_picture
from friction_estimation.film.video import Film

STILLS = 9
"""Number of frames of a film that the page offers."""
MAX_STILL_PIXELS = 60_000_000
"""Maximum number of pixels of all these frames together; of larger frames fewer are used."""
VIEW_PX_PER_M = 26.0
"""Scale of the view from above [px/m]."""

Clicks: TypeAlias = Mapping[str, tuple[float, float]]
"""The names of keypoints (`markings.keypoints_of`) and where they were clicked [px]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class AnnotatedCamera:
    """Camera from a set of clicks.

    Parameters
    ----------
    scene : the clicks as a scene
    camera : sees the keypoints where they were clicked
    misfit_px : root mean square distance between the clicks and the projected keypoints [px]
    paint_px : root mean square distance between the paint and its projection [px]; None if the
        paint was not searched for, too little of it is in view, or a part of it disagrees
    disagreeing : names of rings and lines that are elsewhere than the camera puts them
    problems : sentences about what is wrong although the fit succeeded; empty if the paint was not
        searched for
    better : the size of the ice that the paint fits clearly better, if it is another one
    height_range : between which heights the camera hangs with 95 % probability, as far as an
        unknown lens leaves that open [m]
    expected : error of tracks to expect, by place
    """

    scene: Scene
    camera: Camera
    misfit_px: float
    height_range: tuple[float, float]
    expected: Sequence[ExpectedError]
    paint_px: float | None = None
    disagreeing: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    better: Sheet | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Annotation:
    """Film or picture in which keypoints of the ice are clicked.

    Parameters
    ----------
    name : name of the file
    stills : pictures to choose from, (height, width, 3) BGR; in the first one nothing that moves
        is left
    sheet : the ice whose keypoints are clicked
    known : further parameters of the `Scene`: lens, stone, frame rate
    clicks : clicks made before
    """

    name: str
    stills: list[Image]
    sheet: Sheet
    known: Mapping[str, Any] = field(default_factory=dict)
    clicks: Clicks = field(default_factory=dict)

    @classmethod
    def open(
        cls, path: str | Path, sheet: Sheet, known: Mapping[str, Any] | None = None
    ) -> Annotation:
        """Open a film or a picture.

        Raises
        ------
        InputError : missing, or neither a film nor a picture
        """
        path = Path(path)
        if path.suffix.lower() in SUFFIXES:
            stills = [read_picture(path)]
        else:
            film = Film.open(path)
            most = max(3, MAX_STILL_PIXELS // (film.size[0] * film.size[1]))
            frames = [frame for _, frame in film.sample(min(STILLS, most))]
            if not frames:
                raise InputError("cannot be decoded; expected a film", source=path)
            stills = [_median(frames), *frames]
        return cls(name=path.name, stills=stills, sheet=sheet, known=known or {})

    @classmethod
    def from_scene(cls, path: str | Path, scene: Scene) -> Annotation:
        """Continue from a scene; everything in it is kept.

        Raises
        ------
        InputError : as `open`; a point of the scene is no keypoint, or its pictures have another
            shape
        """
        opened = cls.open(path, scene.sheet)
        scene = scene.for_size(opened.size)
        names = {np.round(xy, 3).tobytes(): name for name, xy in keypoints_of(scene.sheet).items()}
        clicks: dict[str, tuple[float, float]] = {}
        for i, (xy, px) in enumerate(zip(scene.sheet_points, scene.points_px, strict=True)):
            name = names.get((np.round(xy, 3) + 0.0).tobytes())
            if name is None:
                raise InputError(
                    f"({xy[0]:g}, {xy[1]:g}) m cannot be marked on the page; expected a corner or "
                    "a crossing of lines",
                    source=scene.source,
                    where=f"points[{i}]",
                )
            clicks[name] = (float(px[0]), float(px[1]))
        known = {f.name: getattr(scene, f.name) for f in fields(scene)}
        for own in ("sheet_points", "points_px", "place_sigma", "picture_size", "sheet", "source"):
            del known[own]
        return replace(opened, known=known, clicks=clicks)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture [px]."""
        rows, columns = self.stills[0].shape[:2]
        return columns, rows

    def scene(self, clicks: Clicks) -> Scene:
        """Return the scene of these clicks.

        The four corners alone become `corners_px`, anything else `points`.

        Raises
        ------
        InputError : an unknown name; fewer than four, or points in a line, crossed or mirrored
        """
        keypoints = keypoints_of(self.sheet)
        if unknown := sorted(clicks.keys() - keypoints.keys()):
            raise InputError(
                f"unknown keypoint {unknown[0]!r}; expected one of {', '.join(sorted(keypoints))}"
            )
        if len(clicks) < MIN_POINTS:
            raise InputError(f"click {MIN_POINTS - len(clicks)} more: four keypoints are needed")
        only_corners = clicks.keys() == set(CORNERS)
        names = CORNERS if only_corners else tuple(n for n in keypoints if n in clicks)
        return Scene(
            sheet_points=np.array([keypoints[name] for name in names]),
            points_px=np.array([clicks[name] for name in names], dtype=np.float64),
            picture_size=self.size,
            sheet=self.sheet,
            **self.known,
        )

    def solve(self, clicks: Clicks, *, paint: bool = False) -> AnnotatedCamera:
        """Solve the camera that projects the keypoints onto the clicks.

        Parameters
        ----------
        clicks : pixels of the raw image by the names of keypoints
        paint : whether the painted lines correct the camera, as tracking does; this takes a second
            or two

        Raises
        ------
        InputError : as `scene`, or no camera above the ice can see the keypoints so
        """
        scene = self.scene(clicks)
        marked = marked_camera(scene, self.size)
        refined = refine(marked.camera, scene, self.stills[0]) if paint else marked
        camera, measured = refined.camera, refined.measured > 0
        heights = (refined if measured else marked).height_range
        there = np.column_stack([scene.sheet_points, np.zeros(len(scene.sheet_points))])
        apart = np.linalg.norm(camera.project(there) - scene.points_px, axis=1)
        problems = list[str]()
        if measured:
            names = [name for name in keypoints_of(self.sheet) if name in clicks]
            if set(names) == set(CORNERS):
                names = [*CORNERS]
            off = dict(zip(names, apart.tolist(), strict=True))
            problems = problems_of(refined, off)
        better = None
        if paint and (problems or not measured):
            better = better_sheet(refined, self._on_other_sheets(clicks))
        return AnnotatedCamera(
            scene=scene,
            camera=camera,
            misfit_px=float(np.sqrt(np.mean(apart**2))),
            expected=(
                expected_errors([refined], scene.stone_radius, scene.stone_height)
                if measured
                else expected_of_scene(scene, camera)
            ),
            paint_px=refined.rms_px if measured else None,
            disagreeing=refined.disagreeing,
            problems=tuple(problems),
            better=better,
            height_range=heights,
        )

    def _on_other_sheets(self, clicks: Clicks) -> list[tuple[Sheet, RefinedCamera]]:
        """Other sizes of the ice, and their cameras from the same clicks and the paint."""
        found: list[tuple[Sheet, RefinedCamera]] = []
        for sheet in SHEETS:
            if (sheet.length, sheet.width) != (self.sheet.length, self.sheet.width):
                with suppress(InputError):  # no camera has this view
                    scene = replace(self, sheet=sheet).scene(clicks)
                    camera = camera_from_scene(scene, self.size)
                    found.append((sheet, refine(camera, scene, self.stills[0])))
        return found

    def lines_px(self, camera: Camera) -> list[list[list[float]]]:
        """Lines of the sheet projected by a camera: polylines of raw pixels in the image."""
        lines: list[list[list[float]]] = []
        for _, curve in curves_of(self.sheet):
            points = np.column_stack([curve, np.zeros(len(curve))])
            px = camera.project(points)
            px[~camera.sees(points)] = np.nan
            for part in np.split(px, np.flatnonzero(~np.isfinite(px).all(axis=1))):
                inside = part[np.isfinite(part).all(axis=1)]
                if len(inside) > 1:
                    lines.append(np.round(inside, 2).tolist())
        return lines

    def top_view(self, camera: Camera, still: int = 0) -> Image:
        """Return the ice in a camera's picture as seen from above, with the home end on the
        left.
        """
        view = TopView.of(self.sheet, VIEW_PX_PER_M).of_frame(self.stills[still], camera)
        return np.asarray(cv2.rotate(view, cv2.ROTATE_90_CLOCKWISE), dtype=np.uint8)


def _median(frames: list[Image]) -> Image:
    """Return the median of every pixel, some rows at a time: sorting takes several times their
    memory.
    """
    empty = np.empty_like(frames[0])
    for top in range(0, len(empty), 64):
        rows = np.stack([frame[top : top + 64] for frame in frames])
        empty[top : top + 64] = np.median(rows, axis=0).astype(np.uint8)
    return empty
