"""A camera from one photo of the painted ice: from a few rough clicks, then from the paint itself.

Club cameras hang under the ceiling and see one house and its hog line, but no corner of the sheet.
The picture that a club passes on is often cut out of a larger one, stretched, and bent by the lens.
All of that is found from the rings and the hog line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any

import cv2
import numpy as np
from scipy.optimize import differential_evolution

from curling_env.errors import InputError
from curling_env.sheet import (
    HOG_LINE_Y,
    HOUSE_RADIUS,
    PAPER_SHEET,
    RING_RADII,
    TEE_Y,
    Sheet,
)
from curling_env.typing import Floats, Image
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import TRIAL_BENDS, TRIAL_FOCALS, FreeLens, Lens
from friction_estimation.camera.markings import (
    CURVES,
    RINGS,
    Markings,
    grey_levels,
    keypoints_of,
    markings_of,
    measure_markings,
)
from friction_estimation.camera.pose import poses_from_points
from friction_estimation.camera.refinement import (
    RefinedCamera,
    refine_from,
)
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import (
    PHOTO_CLICK_REACH,
    PHOTO_CURVE_SEARCH_PX,
    PHOTO_MAX_RMS_PX,
    PHOTO_MAX_START_MISS,
    PHOTO_MIN_CLICK_DISTANCE_PX,
    PHOTO_RING_BLUR,
    PHOTO_RING_SCALES,
    PHOTO_STARTS,
    PHOTO_TRIAL_STRETCHES,
)

COMMON_CURVES = (*RINGS[:3], "hog line", "centre line")
"""Curves that every club paints in the same place; the button and the other lines differ."""
CURVE_COLOURS = {
    "hog line": (60, 230, 60),
    "12-foot ring": (40, 40, 255),
    "8-foot ring": (255, 120, 0),
    "4-foot ring": (220, 0, 220),
    "button": (0, 170, 255),
    "centre line": (0, 200, 200),
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

    def summary(self) -> dict[str, Any]:
        """Its pose, lens and errors for JSON."""
        lens = self.camera.lens
        return {
            "misses_px": dict(self.misses_px),
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
    InputError : too few clicks, or unknown, outside or contradictory ones; no such paint there
    """
    size = (image.shape[1], image.shape[0])
    keypoints = keypoints_of(sheet)
    end = _end_seen(clicks, keypoints, size)
    rings = _rings_around(
        image, np.array(clicks[f"{end}_tee"]), np.array(clicks[f"{end}_hog_centre"])
    )
    on_ring = rings.on_ice(-1.0 if end == "home" else 1.0)
    sheet_points = np.concatenate([[keypoints[name] for name in clicks], on_ring])
    points_px = np.concatenate([list(clicks.values()), rings.ends_px])
    starts = _starts(sheet_points, points_px, size)
    markings = markings_of(sheet)
    markings = markings[markings.of(*COMMON_CURVES)]
    # Without the border in view, the outermost ring and the hog line stand out.
    markings = replace(markings, strong=markings.of("12-foot ring", "hog line"))
    lens = FreeLens(focal=True, bends=True, cut=True)
    refined = refine_from(starts, sheet_points, points_px, image, markings, lens, height=height)
    if refined is None:
        raise InputError("no rings and hog line are found near what was clicked")
    misses = misses_of(refined.camera, image, markings)
    judged = [misses.get(name, np.inf) for name in ("12-foot ring", "hog line")]
    if max(judged) > PHOTO_MAX_RMS_PX:
        raise InputError(
            f"the 12-foot ring is met to {judged[0]:.1f} px and the hog line to "
            f"{judged[1]:.1f} px; check the clicks"
        )
    return PhotoCamera(
        refined=refined,
        misses_px=misses,
        scene=_scene(refined.camera, sheet, stone),
    )


def misses_of(camera: Camera, image: Image, markings: Markings) -> dict[str, float]:
    """How far each curve is seen from where a camera puts it, root mean square [px].

    A curve of which less than a third is seen near there is left out.
    """
    measured = measure_markings(grey_levels(image), (0, 0), camera, markings, PHOTO_CURVE_SEARCH_PX)
    expected = np.bincount(
        markings.curve[camera.sees(np.column_stack([markings.xy, np.zeros(len(markings.xy))]))],
        minlength=len(CURVES),
    )
    found: dict[str, float] = {}
    for k, name in enumerate(CURVES):
        own = measured.offset_px[markings.curve[measured.index] == k]
        if len(own) > max(8, expected[k] / 3):
            found[name] = float(np.sqrt(np.mean(own**2)))
    return found


def draw_markings(image: Image, camera: Camera, sheet: Sheet, scale: int = 1) -> Image:
    """The photo, enlarged, with rings and lines drawn where the camera puts them."""
    size = (image.shape[1] * scale, image.shape[0] * scale)
    picture = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_CUBIC), dtype=np.uint8)
    around = np.linspace(0, 2 * np.pi, 361)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    side = np.linspace(-sheet.width / 2, sheet.width / 2, 181)
    along = np.linspace(HOG_LINE_Y, TEE_Y - HOUSE_RADIUS, 181)
    for s in (-1.0, 1.0):
        curves = [
            (name, radius * circle + np.array([0.0, s * TEE_Y]))
            for name, radius in zip(RINGS, RING_RADII, strict=True)
        ]
        curves += [("hog line", np.column_stack([side, np.full(len(side), s * HOG_LINE_Y)]))]
        curves += [("centre line", np.column_stack([np.zeros(len(along)), s * along]))]
        for name, xy in curves:
            _draw_curve(picture, camera, xy, CURVE_COLOURS[name], scale)
    return picture


def _draw_curve(
    picture: Image, camera: Camera, xy: Floats, colour: tuple[int, int, int], scale: int
) -> None:
    points = np.column_stack([xy, np.zeros(len(xy))])
    inside = camera.sees(points)
    # Pixel centres of the photo lie at the middle of their enlarged squares.
    px = (camera.project(points) + 0.5) * scale - 0.5
    for k in np.flatnonzero(inside[:-1] & inside[1:]):
        start, stop = (tuple(np.round(px[i] * 16).astype(int).tolist()) for i in (k, k + 1))
        cv2.line(picture, start, stop, colour, 1, cv2.LINE_AA, shift=4)


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
        if np.hypot(a[0] - b[0], a[1] - b[1]) < PHOTO_MIN_CLICK_DISTANCE_PX:
            raise InputError(f"{one} and {other} are marked at the same place")
    return ends[0]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rings:
    """Rings in an image.

    Parameters
    ----------
    ends_px : (5, 2) the centre, and the 12-foot ring's points towards the hog line, away from it,
        and to the left and right of someone who looks from the hog line to the house [px]
    """

    ends_px: Floats

    def on_ice(self, end: float) -> Floats:
        """The same points in the sheet frame, (5, 2) [m], for the home (-1) or away (1) end."""
        r = HOUSE_RADIUS
        return end * np.array(
            [(x, y + TEE_Y) for x, y in ((0, 0), (0, -r), (0, r), (-r, 0), (r, 0))]
        )


def _rings_around(image: Image, tee: Floats, hog: Floats) -> _Rings:
    """The rings around a rough click.

    They are three concentric ellipses in the proportions of the rings, at whose edges the image
    changes most from inside to outside, whatever the colours. They are searched for without a
    camera, so that neither a click some tenths of a metre off nor a bent or stretched picture leads
    astray.
    """
    ahead = hog - tee
    metre_px = float(np.linalg.norm(ahead)) / (TEE_Y - HOG_LINE_Y)
    ahead = ahead / np.linalg.norm(ahead)
    aside = np.array([-ahead[1], ahead[0]])
    soft = cv2.GaussianBlur(grey_levels(image), (0, 0), max(1.0, PHOTO_RING_BLUR * metre_px))
    slopes = [cv2.Sobel(soft, cv2.CV_32F, *order) for order in ((1, 0), (0, 1))]
    around = np.arange(72) * (2 * np.pi / 72)
    cos, sin = np.cos(around)[:, None], np.sin(around)[:, None]

    def flatness(x: Floats) -> float:
        centre = tee + x[:2] * metre_px
        along, across = x[2:] * metre_px
        normal = cos * ahead / along + sin * aside / across
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        change = 0.0
        for radius in RING_RADII[:3]:
            at = centre + radius * (cos * along * ahead + sin * across * aside)
            u, v = (np.ascontiguousarray(c, dtype=np.float32)[None] for c in at.T)
            across_edge = sum(
                cv2.remap(slope, u, v, cv2.INTER_LINEAR, borderValue=0)[0] * n
                for slope, n in zip(slopes, normal.T, strict=True)
            )
            change += abs(float(np.mean(across_edge)))
        return -change

    bounds = [(-PHOTO_CLICK_REACH, PHOTO_CLICK_REACH)] * 2 + [PHOTO_RING_SCALES] * 2
    found = differential_evolution(flatness, bounds, rng=1, maxiter=60, tol=1e-4)
    centre = tee + found.x[:2] * metre_px
    along, across = found.x[2:] * metre_px * HOUSE_RADIUS
    # To the right of someone who looks from the hog line to the house; v grows downwards.
    right = np.array([ahead[1], -ahead[0]])
    ends = np.array([0 * ahead, along * ahead, -along * ahead, -across * right, across * right])
    return _Rings(ends_px=centre + ends)


def _starts(sheet_points: Floats, points_px: Floats, size: tuple[int, int]) -> list[Camera]:
    """Cameras with trial lenses that see the points about where they are, the best first."""
    side = max(size)
    starts: list[tuple[float, Camera]] = []
    for share, bend, stretch in product(TRIAL_FOCALS, TRIAL_BENDS, PHOTO_TRIAL_STRETCHES):
        lens = Lens.centred(share * side, size).bent(bend).stretched(stretch)
        for pose in poses_from_points(sheet_points, points_px, lens)[:1]:
            camera = Camera(lens=lens, rotation=pose.rotation, translation=pose.translation)
            starts.append((pose.rms_px, camera))
    starts.sort(key=lambda start: start[0])
    return [camera for rms, camera in starts[:PHOTO_STARTS] if rms < PHOTO_MAX_START_MISS * side]


def _scene(camera: Camera, sheet: Sheet, stone: tuple[float, float]) -> Scene:
    """The camera as a scene: the keypoints in view, where the camera puts them, and its lens."""
    keypoints = np.array(list(keypoints_of(sheet).values()))
    # A club's ice may be wider or narrower than the scene's: keypoints at the border are left out.
    keypoints = keypoints[np.abs(keypoints[:, 0]) < sheet.width / 2]
    points = np.column_stack([keypoints, np.zeros(len(keypoints))])
    seen = camera.sees(points)
    return Scene(
        sheet_points=keypoints[seen],
        points_px=camera.project(points[seen]),
        camera_matrix=camera.lens.matrix,
        distortion=camera.lens.distortion,
        image_size=camera.size,
        stone_radius=stone[0],
        stone_height=stone[1],
        sheet=sheet,
    )
