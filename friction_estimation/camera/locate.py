"""A camera from one photo of the painted ice: from a few rough marks, then from the paint itself.

Club cameras hang under the ceiling and see one house and its hog line, but no corner of the sheet.
Their pictures are often cropped, stretched, and distorted by the lens. All of that is estimated
from the rings and the lines, in a picture of standard size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.sheet import PAPER_SHEET, Sheet
from curling_env.typing import Floats, Image, Singles
from friction_estimation.camera.agreement import OPTIONAL
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import FreeLens
from friction_estimation.camera.markings import (
    CURVES,
    curves_of,
    grey_levels,
    keypoints_of,
    markings_of,
)
from friction_estimation.camera.paint_fit import PaintFit
from friction_estimation.camera.refined import RefinedCamera, height_prior
from friction_estimation.camera.refinement import PaintSolver, SolvedCamera, reduced
from friction_estimation.camera.rough_pose import RoughSearch, TwoMarks
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import (
    CLICK_SIGMA_PX,
    MARK_SIGMA,
    PAINT_DEPTH,
    PHOTO_CORRELATION,
    PHOTO_MIN_SCALE_PX,
    PHOTO_SEARCHES,
    PHOTO_SIDE,
    PHOTO_TRIALS,
    WORKING_SIDE,
)

NEEDED = ("12-foot ring", "hog line")
"""Curves that must be seen in their places."""
CUT_LENS = FreeLens(focal=True, bends=True, cut=True)
CURVE_COLOURS = {
    "hog line": (60, 230, 60),
    "back line": (60, 230, 60),
    "12-foot ring": (40, 40, 255),
    "8-foot ring": (255, 120, 0),
    "4-foot ring": (220, 0, 220),
    "button": (0, 170, 255),
    "centre line": (0, 200, 200),
    "tee line": (0, 200, 200),
}
"""Colours of drawn curves, blue-green-red."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PhotoCamera:
    """Camera of a photo.

    Parameters
    ----------
    refined : the camera and how well it is known
    scene : the camera as a scene file holds it, with the keypoints in view as its points
    """

    refined: RefinedCamera
    scene: Scene

    @property
    def camera(self) -> Camera:
        """The camera itself."""
        return self.refined.camera

    def summary(self) -> dict[str, Any]:
        """Its pose, lens and errors for JSON."""
        lens = self.camera.lens
        return {
            "misses_px": dict(self.refined.misses_px),
            "agrees": not self.refined.missed,
            "position_m": self.camera.position.tolist(),
            "height_uncertainty": self.refined.log_focal_sigma,
            "focal_px": [lens.matrix[0, 0], lens.matrix[1, 1]],
            "principal_point_px": lens.matrix[:2, 2].tolist(),
            "distortion": lens.distortion.tolist(),
        }


def camera_from_photo(
    image: Image,
    clicks: Mapping[str, tuple[float, float]],
    *,
    sheet: Sheet = PAPER_SHEET,
    height: float | None = None,
) -> PhotoCamera:
    """Solve the camera of a photo of one house and its hog line.

    Parameters
    ----------
    image : (rows, columns, 3) BGR, best of the empty ice
    clicks : the names of keypoints (`keypoints_of`) and their pixels: tee and hog_centre of one
        end at least, each to 0.3 m
    sheet : the ice in the photo
    height : the camera's height above the ice [m], if it is known; needed for a camera that looks
        straight down, because the paint does not show the height there

    Raises
    ------
    InputError : too few clicks, or unknown, outside or contradictory ones; no such paint there; a
        ring or line that is seen, and not where any camera puts it
    """
    size, keypoints = (image.shape[1], image.shape[0]), keypoints_of(sheet)
    end = _end_seen(clicks, keypoints, size)
    photo = _Photo(
        grey=grey_levels(image),
        clicks={name: np.array(px, dtype=np.float64) for name, px in clicks.items()},
        end=end,
        sheet=sheet,
        height=height,
    )
    small, large = photo.solver(PHOTO_SIDE), photo.solver(WORKING_SIDE)
    best = photo.most_likely(small)
    # The paint is located more exactly in a larger picture.
    whole = small.whole(best.refined, size)
    closer = large.followed(large.reduced_camera(whole.camera))
    if closer is None or closer.wrong:
        large, closer = small, best
    refined = large.whole(closer.refined, size)
    return PhotoCamera(refined=refined, scene=_scene(refined, sheet))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Photo:
    """A photo and its marks.

    Parameters
    ----------
    grey : grey levels
    clicks : the marks by name, (2,) [px]
    end : the end that is in the photo
    sheet : the ice in it
    height : the camera's height above the ice [m], if it is known
    """

    grey: Singles
    clicks: Mapping[str, Floats]
    end: str
    sheet: Sheet
    height: float | None

    def marks(self, scale: Floats) -> dict[str, Floats]:
        """Return the marks in a copy of the photo scaled along both sides (2,)."""
        return {name: (px + 0.5) * scale - 0.5 for name, px in self.clicks.items()}

    def two(self, scale: Floats) -> TwoMarks:
        """Return the two required marks, in such a copy."""
        marks = self.marks(scale)
        tee, hog = (marks[f"{self.end}_{place}"] for place in ("tee", "hog_centre"))
        return TwoMarks(end=-1.0 if self.end == "home" else 1.0, tee=tee, hog=hog)

    def solver(self, side: int) -> PaintSolver:
        """Return the search in a copy whose longer side has `side` pixels, or in a smaller
        photo.
        """
        grey, _, scale = reduced(self.grey, (0, 0), max(self.grey.shape) / side)
        markings, keypoints = markings_of(self.sheet), keypoints_of(self.sheet)
        markings = markings[markings.of(*(name for name in CURVES if name not in OPTIONAL))]
        unit_px = max(1.0, max(grey.shape) / PHOTO_SIDE)
        fit = PaintFit(
            grey=grey,
            origin=(0, 0),
            markings=markings,
            sheet_points=np.array([keypoints[name] for name in self.clicks]),
            points_px=np.array(list(self.marks(scale).values())),
            lens=CUT_LENS,
            height=height_prior(self.height),
            click_sigma_px=MARK_SIGMA * self.two(scale).px_per_metre,
            correlation=PHOTO_CORRELATION,
            min_scale_px=PHOTO_MIN_SCALE_PX * unit_px,
            depth_sigma=PAINT_DEPTH[1],
        )
        return PaintSolver(
            fit=fit,
            judged=markings,
            needed=NEEDED,
            unit_px=unit_px,
            scale=scale,
            size=(grey.shape[1], grey.shape[0]),
        )

    def most_likely(self, solver: PaintSolver) -> SolvedCamera:
        """Return the best of several searches that agree with all of the paint.

        Raises
        ------
        InputError : no search agrees
        """
        two = self.two(solver.scale)
        search = RoughSearch(solver.fit.grey, two, self.height)
        wide = [metres * two.px_per_metre for metres in PHOTO_SEARCHES]
        best = solver.most_likely((search.best(seed), wide) for seed in range(PHOTO_TRIALS))
        if best is None:
            raise InputError("no rings and hog line found near the marks")
        if best.wrong:
            raise InputError(
                f"no camera agrees with all of the paint (not with the {', '.join(best.wrong)}); "
                "check the marks, and that the rings and the hog line are in view"
            )
        return best


def draw_markings(image: Image, camera: Camera, sheet: Sheet, scale: int = 1) -> Image:
    """Return the photo, enlarged, with the projected rings and lines."""
    size = (image.shape[1] * scale, image.shape[0] * scale)
    picture = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_CUBIC), dtype=np.uint8)
    for name, xy in curves_of(sheet):
        if name not in CURVE_COLOURS:
            continue
        points = np.column_stack([xy, np.zeros(len(xy))])
        inside = camera.sees(points)
        # Pixel centres of the photo lie at the middle of their enlarged squares.
        px = (camera.project(points) + 0.5) * scale - 0.5
        for k in np.flatnonzero(inside[:-1] & inside[1:]):
            start, stop = (tuple(np.round(px[i] * 16).astype(int).tolist()) for i in (k, k + 1))
            cv2.line(picture, start, stop, CURVE_COLOURS[name], 1, cv2.LINE_AA, shift=4)
    return picture


def _end_seen(
    clicks: Mapping[str, tuple[float, float]],
    keypoints: Mapping[str, tuple[float, float]],
    size: tuple[int, int],
) -> str:
    """Return the end that is in the photo, home or away, from the names of the marks."""
    for name, (u, v) in clicks.items():
        if name not in keypoints:
            raise InputError(f"unknown point {name!r}; expected one of {', '.join(keypoints)}")
        if not (0 <= u < size[0] and 0 <= v < size[1]):
            raise InputError(
                f"{name} at ({u:g}, {v:g}) px lies outside the photo of {size[0]} × {size[1]} px"
            )
    ends = [e for e in ("home", "away") if {f"{e}_tee", f"{e}_hog_centre"} <= clicks.keys()]
    if not ends:
        raise InputError("tee and hog_centre of one end must be marked; other places are optional")
    for (one, a), (other, b) in combinations(clicks.items(), 2):
        if np.hypot(a[0] - b[0], a[1] - b[1]) < CLICK_SIGMA_PX:
            raise InputError(f"{one} and {other} are marked at the same place")
    return ends[0]


def _scene(refined: RefinedCamera, sheet: Sheet) -> Scene:
    """Return the camera as a scene: the projected keypoints in view, and its lens."""
    camera, keypoints = refined.camera, np.array(list(keypoints_of(sheet).values()))
    # A club's ice may be wider or narrower than the scene's: skip keypoints at the border.
    keypoints = keypoints[np.abs(keypoints[:, 0]) < sheet.width / 2]
    points = np.column_stack([keypoints, np.zeros(len(keypoints))])
    seen = camera.sees(points)
    x, y = np.meshgrid(np.linspace(-1.8, 1.8, 4), np.linspace(-20, 20, 21))
    places = np.column_stack([x.ravel(), y.ravel()])
    places = places[camera.sees(np.column_stack([places, np.zeros(len(places))]))]
    return Scene(
        sheet_points=keypoints[seen],
        points_px=camera.project(points[seen]),
        place_sigma=np.column_stack([places, refined.place_sigma(places)]),
        camera_matrix=camera.lens.matrix,
        distortion=camera.lens.distortion,
        image_size=camera.size,
        picture_size=camera.size,
        sheet=sheet,
    )
