"""A camera from one photo of the painted ice: a few rough clicks, then the paint itself.

Club cameras hang under the ceiling and see one house and its hog line, no corner of the sheet; what
a club passes on is often cut out of a larger picture, stretched, and bent by the lens. All of that
is found from the rings and the hog line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, product

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from curling_env.errors import InputError
from curling_env.sheet import (
    HOG_LINE_Y,
    HOUSE_RADIUS,
    PAPER_SHEET,
    RING_RADII,
    TEE_Y,
    Direction,
    Sheet,
)
from friction_estimation.calibration import poses_from_points
from friction_estimation.camera import NO_DISTORTION, Camera, intrinsics
from friction_estimation.landmarks import (
    CURVES,
    RINGS,
    Marks,
    brightness,
    marks_of,
    read_marks,
)
from friction_estimation.refinement import (
    BENDS,
    FOCALS,
    FreeLens,
    Refined,
    refine_from,
)
from friction_estimation.scene import Scene

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

PLACES = {
    "tee": (0.0, 0.0),
    "hog": (0.0, HOG_LINE_Y - TEE_Y),
    "hog_left": (-1.0, HOG_LINE_Y - TEE_Y),
    "hog_right": (1.0, HOG_LINE_Y - TEE_Y),
    "ring_left": (-HOUSE_RADIUS, 0.0),
    "ring_right": (HOUSE_RADIUS, 0.0),
    "ring_near": (0.0, -HOUSE_RADIUS),
    "ring_far": (0.0, HOUSE_RADIUS),
}
"""What may be clicked, in the delivery frame [m]: seen from the hog line towards the house.

The tee; where the centre line crosses the hog line's edge towards mid-sheet, and a metre to either
side of that; and the outermost points of the 12-foot ring."""
ASPECTS = (-0.16, 0.0, 0.16)
"""How far a picture may be stretched, in log, where a fit begins."""
STARTS = 12
"""Cameras that a fit begins with."""
FAR_OFF = 0.1
"""A camera that misses the clicks by more than this share of the picture is no start."""
CLICK_REACH = 0.3
"""How far from the click the tee may be [m]."""
RING_SCALES = (0.7, 1.6)
"""Scale at the house over that on the way to the hog line: perspective, stretching and lens."""
RING_BLUR = 0.03
"""By how much the image is blurred to find the rings [m]."""
CLICKS_APART_PX = 4.0
FAR_PX = 4.0
"""A curve further off than this is not the one that was meant."""
MAX_RMS_PX = 1.5
"""Rings and hog line that fit no better were not found."""
SURE = (*RINGS[:3], "hog line", "centre line")
"""Curves that every club paints alike: not the button, nor lines of which an edge may be meant."""
PATHS = {
    "hog line": (60, 230, 60),
    "12-foot ring": (40, 40, 255),
    "8-foot ring": (255, 120, 0),
    "4-foot ring": (220, 0, 220),
    "button": (0, 170, 255),
    "centre line": (0, 200, 200),
}
"""Colours, blue-green-red, that landmarks are drawn in."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PhotoCamera:
    """What one photo told of its camera.

    Parameters
    ----------
    refined : the camera and how well it is known
    misses_px : by curve, root mean square distance of its readings from where it is drawn [px]
    scene : to be written down, with the landmarks in view as its points
    """

    refined: Refined
    misses_px: Mapping[str, float]
    scene: Scene

    @property
    def camera(self) -> Camera:
        """The camera itself."""
        return self.refined.camera


def camera_from_photo(
    image: Image,
    clicks: Mapping[str, tuple[float, float]],
    *,
    sheet: Sheet = PAPER_SHEET,
    end: Direction = Direction.AWAY,
    height: float | None = None,
    stone: tuple[float, float] = (Scene.stone_radius, Scene.stone_height),
) -> PhotoCamera:
    """The camera that took a photo of one house and its hog line.

    Parameters
    ----------
    image : (rows, columns, 3) BGR, best of the empty ice
    clicks : some of `PLACES` in the image [px]: tee and hog at least, good to 0.3 m
    end : the house that is seen
    height : of the camera above the ice [m], where it is known: straight down, the paint cannot
        tell it
    stone : radius and height of the stones [m], for the scene

    Raises
    ------
    InputError : clicks that are too few, unknown, outside or contradict, or no such paint there
    """
    size = (image.shape[1], image.shape[0])
    _check(clicks, size)
    places = _with_rings(image, clicks)
    sheet_points = end * (np.array([PLACES[name] for name in places]) + np.array([0.0, TEE_Y]))
    points_px = np.array(list(places.values()), dtype=np.float64)
    starts = _starts(sheet_points, points_px, size)
    marks = marks_of(sheet)
    marks = marks[marks.of(*SURE)]
    # Without the border, the hog line and the outermost ring are what stands out.
    marks = replace(marks, strong=marks.of("12-foot ring", "hog line"))
    lens = FreeLens(focal=True, bends=True, frame=True)
    refined = refine_from(starts, sheet_points, points_px, image, marks, lens, height=height)
    if refined is None:
        raise InputError("no rings and hog line are found near what was clicked")
    misses = misses_of(refined.camera, image, marks)
    judged = [misses.get(name, np.inf) for name in ("12-foot ring", "hog line")]
    if max(judged) > MAX_RMS_PX:
        raise InputError(
            f"the 12-foot ring is met to {judged[0]:.1f} px and the hog line to "
            f"{judged[1]:.1f} px; check the clicks"
        )
    return PhotoCamera(
        refined=refined,
        misses_px=misses,
        scene=_scene(refined.camera, sheet, end, stone),
    )


def misses_of(camera: Camera, image: Image, marks: Marks) -> dict[str, float]:
    """How far each curve is seen from where a camera puts it, root mean square [px].

    Only curves of which a third or more is seen near there are named.
    """
    readings = read_marks(brightness(image), (0, 0), camera, marks, FAR_PX)
    expected = np.bincount(
        marks.curve[camera.sees(np.column_stack([marks.xy, np.zeros(len(marks.xy))]))],
        minlength=len(CURVES),
    )
    found: dict[str, float] = {}
    for k, name in enumerate(CURVES):
        own = readings.offset_px[marks.curve[readings.index] == k]
        if len(own) > max(8, expected[k] / 3):
            found[name] = float(np.sqrt(np.mean(own**2)))
    return found


def draw_landmarks(image: Image, camera: Camera, sheet: Sheet, scale: int = 1) -> Image:
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
            _draw_curve(picture, camera, xy, PATHS[name], scale)
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


def _check(clicks: Mapping[str, tuple[float, float]], size: tuple[int, int]) -> None:
    for name, (u, v) in clicks.items():
        if name not in PLACES:
            raise InputError(f"nothing is called {name!r}; there are {', '.join(PLACES)}")
        if not (0 <= u < size[0] and 0 <= v < size[1]):
            raise InputError(
                f"{name} at ({u:g}, {v:g}) px lies outside the photo of {size[0]} × {size[1]} px"
            )
    if missing := [name for name in ("tee", "hog") if name not in clicks]:
        raise InputError(f"{' and '.join(missing)} must be marked; the other places are optional")
    for (one, a), (other, b) in combinations(clicks.items(), 2):
        if np.hypot(a[0] - b[0], a[1] - b[1]) < CLICKS_APART_PX:
            raise InputError(f"{one} and {other} are marked at the same place")


def _with_rings(
    image: Image, clicks: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """The clicks, and the ends of the 12-foot ring as the image has them."""
    tee, hog = np.array(clicks["tee"], dtype=np.float64), np.array(clicks["hog"], dtype=np.float64)
    centre, along, across = _rings_around(image, tee, hog)
    ahead = (hog - tee) / np.linalg.norm(hog - tee)
    # Seen from the hog line, the house is ahead; v of the image grows downwards.
    right = np.array([ahead[1], -ahead[0]])
    found = {
        "tee": centre,
        "ring_near": centre + HOUSE_RADIUS * along * ahead,
        "ring_far": centre - HOUSE_RADIUS * along * ahead,
        "ring_left": centre - HOUSE_RADIUS * across * right,
        "ring_right": centre + HOUSE_RADIUS * across * right,
    }
    return {**clicks, **{name: (float(px[0]), float(px[1])) for name, px in found.items()}}


def _rings_around(image: Image, tee: Floats, hog: Floats) -> tuple[Floats, float, float]:
    """Centre (2,) [px] and scale along and across [px/m] of the rings around a rough click.

    Three concentric ellipses in the proportions of the rings, at whose edges the image changes most
    from inside to outside, whatever the colours: found blind, so that neither a click some tenths
    of a metre off nor a bent or stretched picture leads astray.
    """
    ahead = hog - tee
    metre_px = float(np.linalg.norm(ahead)) / (TEE_Y - HOG_LINE_Y)
    ahead = ahead / np.linalg.norm(ahead)
    aside = np.array([-ahead[1], ahead[0]])
    soft = cv2.GaussianBlur(brightness(image), (0, 0), max(1.0, RING_BLUR * metre_px))
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

    bounds = [(-CLICK_REACH, CLICK_REACH)] * 2 + [RING_SCALES] * 2
    found = differential_evolution(flatness, bounds, seed=1, maxiter=60, tol=1e-4)
    return tee + found.x[:2] * metre_px, *(found.x[2:] * metre_px)


def _starts(sheet_points: Floats, points_px: Floats, size: tuple[int, int]) -> list[Camera]:
    """Cameras that see the points about where they are, of several lenses, the best first."""
    half = max(size) / 2
    starts: list[tuple[float, Camera]] = []
    for share, bend, aspect in product(FOCALS, BENDS, ASPECTS):
        matrix = intrinsics(2 * share * half, size)
        matrix[1, 1] *= np.exp(aspect)
        distortion = NO_DISTORTION.copy()
        distortion[0] = bend * (2 * share) ** 2
        for pose in poses_from_points(sheet_points, points_px, matrix, distortion)[:1]:
            camera = Camera(
                matrix=matrix,
                distortion=distortion,
                rotation=pose.rotation,
                translation=pose.translation,
                size=size,
            )
            starts.append((pose.rms_px, camera))
    starts.sort(key=lambda start: start[0])
    return [camera for rms, camera in starts[:STARTS] if rms < FAR_OFF * half]


def _scene(camera: Camera, sheet: Sheet, end: Direction, stone: tuple[float, float]) -> Scene:
    """The camera as a scene: the landmarks it sees, where the paint has them, and its lens."""
    places = end * (np.array(list(PLACES.values())) + np.array([0.0, TEE_Y]))
    points = np.column_stack([places, np.zeros(len(places))])
    seen = camera.sees(points)
    return Scene(
        sheet_points=places[seen],
        points_px=camera.project(points[seen]),
        camera_matrix=camera.matrix,
        distortion=camera.distortion,
        image_size=camera.size,
        stone_radius=stone[0],
        stone_height=stone[1],
        sheet=sheet,
    )
