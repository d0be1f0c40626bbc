"""A camera from one photo of the painted ice: from a few rough marks, then from the paint itself.

Club cameras hang under the ceiling and see one house and its hog line, but no corner of the sheet.
The picture that a club passes on is often cut out of a larger one, stretched, and bent by the lens.
All of that is found from the rings and the lines, in a picture of standard size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.sheet import PAPER_SHEET, Sheet
from curling_env.typing import Image
from friction_estimation.camera.agreement import (
    OPTIONAL,
    TOLERANCE_PX,
    SeenCurve,
    disagreeing,
    seen_curves,
)
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
from friction_estimation.camera.refinement import RefinedCamera, height_prior, reduced
from friction_estimation.camera.rough_pose import RoughSearch, TwoMarks
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import (
    MARK_SIGMA,
    PHOTO_CORRELATION,
    PHOTO_MIN_SCALE_PX,
    PHOTO_SEARCHES,
    PHOTO_SIDE,
    PHOTO_TRIALS,
)

NEEDED = ("12-foot ring", "hog line")
"""Curves that must be seen where the camera puts them."""
NARROW_SEARCHES_PX = (3.0, 2.0, 2.0, 2.0)
MIN_CLICK_DISTANCE_PX = 4.0
"""Two places that were clicked nearer than this were clicked at the same place."""
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
"""Colours in which curves are drawn, blue-green-red."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PhotoCamera:
    """The camera that took a photo.

    Parameters
    ----------
    refined : the camera and how well it is known
    misses_px : by name of a curve, root mean square distance of where it is seen from where the
        camera puts it [px]
    scene : the camera as a scene file holds it, with the keypoints in view as its points
    """

    refined: RefinedCamera
    misses_px: Mapping[str, float]
    scene: Scene

    @property
    def camera(self) -> Camera:
        """The camera itself."""
        return self.refined.camera

    @property
    def disagreeing(self) -> list[str]:
        """Curves that the camera misses by more than 2 px of the photo.

        In a photo of many pixels that may be paint that was not laid to the millimetre.
        """
        return [name for name, miss in self.misses_px.items() if miss > TOLERANCE_PX]

    def summary(self) -> dict[str, Any]:
        """Its pose, lens and errors for JSON."""
        lens = self.camera.lens
        return {
            "misses_px": dict(self.misses_px),
            "agrees": not self.disagreeing,
            "position_m": self.camera.position.tolist(),
            "height_uncertainty": self.refined.log_focal_sigma,
            "focal_px": [lens.matrix[0, 0], lens.matrix[1, 1]],
            "principal_point_px": lens.matrix[:2, 2].tolist(),
            "distortion": lens.distortion.tolist(),
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class _Trial:
    """A camera that one search led to, and its agreement with the paint."""

    refined: RefinedCamera
    seen: Sequence[SeenCurve]

    @property
    def wrong(self) -> list[str]:
        """Names of the curves that disagree with the camera, or are needed and not seen."""
        met = {curve.name for curve in self.seen if curve.agrees}
        names = [*disagreeing(self.seen), *(name for name in NEEDED if name not in met)]
        return list(dict.fromkeys(names))

    @property
    def agrees(self) -> bool:
        return not self.wrong


def camera_from_photo(
    image: Image,
    clicks: Mapping[str, tuple[float, float]],
    *,
    sheet: Sheet = PAPER_SHEET,
    height: float | None = None,
    stone: tuple[float, float] = (Scene.stone_radius, Scene.stone_height),
) -> PhotoCamera:
    """The camera that took a photo of one house and its hog line.

    Parameters
    ----------
    image : (rows, columns, 3) BGR, best of the empty ice
    clicks : the names of keypoints (`keypoints_of`) and their pixels: tee and hog_centre of one
        end at least, each to 0.3 m
    sheet : the ice in the photo
    height : the camera's height above the ice [m], if it is known; needed for a camera that looks
        straight down, because the paint does not show the height there
    stone : radius and height of the stones [m], for the scene

    Raises
    ------
    InputError : too few clicks, or unknown, outside or contradictory ones; no such paint there; a
        ring or line that is seen, and not where any camera puts it
    """
    size = (image.shape[1], image.shape[0])
    keypoints = keypoints_of(sheet)
    end = _end_seen(clicks, keypoints, size)
    grey, _, scale = reduced(grey_levels(image), (0, 0), max(size) / PHOTO_SIDE)
    px = (np.array(list(clicks.values())) + 0.5) * scale - 0.5
    marks = dict(zip(clicks, px, strict=True))
    two = TwoMarks(
        end=-1.0 if end == "home" else 1.0,
        tee=marks[f"{end}_tee"],
        hog=marks[f"{end}_hog_centre"],
    )
    markings = markings_of(sheet)
    markings = markings[markings.of(*(name for name in CURVES if name not in OPTIONAL))]
    fit = PaintFit(
        grey=grey,
        origin=(0, 0),
        markings=markings,
        sheet_points=np.array([keypoints[name] for name in clicks]),
        points_px=px,
        lens=CUT_LENS,
        height=height_prior(height),
        click_sigma_px=MARK_SIGMA * two.px_per_metre,
        correlation=PHOTO_CORRELATION,
        min_scale_px=PHOTO_MIN_SCALE_PX,
    )
    best = _likeliest(RoughSearch(grey, two, height), fit, two.px_per_metre)
    refined = best.refined.resized(1 / scale, size)
    factor = float(np.mean(1 / scale))
    return PhotoCamera(
        refined=refined,
        misses_px={curve.name: factor * curve.miss_px for curve in best.seen if curve.agrees},
        scene=_scene(refined, sheet, stone),
    )


def _likeliest(search: RoughSearch, fit: PaintFit, px_per_metre: float) -> _Trial:
    """The best of several searches that all the paint agrees with.

    Raises
    ------
    InputError : there is none
    """
    trials: list[_Trial] = []
    for seed in range(PHOTO_TRIALS):
        found = _followed(search.best(seed), fit, px_per_metre)
        trials += [] if found is None else [found]
        if sum(trial.agrees for trial in trials) == 2:
            break
    if not trials:
        raise InputError("no rings and hog line are found near what was clicked")
    best = min(trials, key=lambda trial: (not trial.agrees, len(trial.wrong), trial.refined.misfit))
    if not best.agrees:
        raise InputError(
            "no camera agrees with all of the paint: the "
            f"{' and '.join(best.wrong)} would be elsewhere; check the "
            "clicks, and that the rings and the hog line are in view"
        )
    return best


def _followed(camera: Camera, fit: PaintFit, px_per_metre: float) -> _Trial | None:
    """The camera that a rough one leads to; None where it meets no paint."""
    followed: Camera | None = camera
    for metres in PHOTO_SEARCHES:
        radius = max(metres * px_per_metre, NARROW_SEARCHES_PX[0])
        # All that is found counts, however far off.
        wide = replace(fit, min_scale_px=max(fit.min_scale_px, radius / 3))
        followed = followed and wide.approach(followed, (radius,), fit.lens)
    followed = followed and fit.approach(followed, NARROW_SEARCHES_PX, fit.lens)
    if followed is None:
        return None
    measured = fit.measure(followed, 2.0)
    fitted = fit.fit(followed, measured, fit.lens, 0.5)
    return _Trial(
        refined=RefinedCamera.of_fit(fitted, fit.lens),
        seen=seen_curves(fitted.camera, fit.grey, fit.origin, fit.markings),
    )


def draw_markings(image: Image, camera: Camera, sheet: Sheet, scale: int = 1) -> Image:
    """The photo, enlarged, with rings and lines drawn where the camera puts them."""
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
    """The end that is in the photo, home or away, by the names of the clicks."""
    for name, (u, v) in clicks.items():
        if name not in keypoints:
            raise InputError(f"nothing is called {name!r}; there are {', '.join(keypoints)}")
        if not (0 <= u < size[0] and 0 <= v < size[1]):
            raise InputError(
                f"{name} at ({u:g}, {v:g}) px lies outside the photo of {size[0]} × {size[1]} px"
            )
    ends = [e for e in ("home", "away") if {f"{e}_tee", f"{e}_hog_centre"} <= clicks.keys()]
    if not ends:
        raise InputError("tee and hog_centre of one end must be marked; other places are optional")
    for (one, a), (other, b) in combinations(clicks.items(), 2):
        if np.hypot(a[0] - b[0], a[1] - b[1]) < MIN_CLICK_DISTANCE_PX:
            raise InputError(f"{one} and {other} are marked at the same place")
    return ends[0]


def _scene(refined: RefinedCamera, sheet: Sheet, stone: tuple[float, float]) -> Scene:
    """The camera as a scene: the keypoints in view, where the camera puts them, and its lens."""
    camera, keypoints = refined.camera, np.array(list(keypoints_of(sheet).values()))
    # A club's ice may be wider or narrower than the scene's: keypoints at the border are left out.
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
        stone_radius=stone[0],
        stone_height=stone[1],
        sheet=sheet,
    )
