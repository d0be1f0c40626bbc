"""Named cameras that look at a sheet, and their scenes as marked by a user."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from curling_env.errors import InputError
from curling_env.sheet import (
    HOG_LINE_Y,
    HOUSE_RADIUS,
    PAPER_SHEET,
    RULE_BOOK_STONE,
    TEE_Y,
    Sheet,
    Stone,
)
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import CORNERS, MIN_POINTS, Scene


@dataclass(frozen=True, kw_only=True)
class CameraPlacement:
    """Position, direction and lens of a camera; sheet frame, pixels at `size`.

    Parameters
    ----------
    position : place of the camera [m]
    target : the point it looks at [m]
    up : direction that points up in the image
    focal_px : focal length at `size`
    size : width and height of the image that `focal_px` belongs to [px]
    distortion : distortion terms in the order of `lens.TERMS`
    shows : visible part of the sheet, for users
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    focal_px: float
    shows: str
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    size: tuple[int, int] = (1920, 1080)
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)


# These are typical places for a camera in a club, not those of a real hall. Each is a little off
# the axis of symmetry, as a camera mounted by hand is, and the sheet fills its image.
CAMERAS: dict[str, CameraPlacement] = {
    "end": CameraPlacement(
        position=(0.9, -35.5, 8.5),
        target=(0.05, -13.2, 0.0),
        focal_px=2150.0,
        distortion=(-0.11, 0.025, 0.0004, -0.0003, 0.0),
        shows="the whole sheet from a gallery behind the home end",
    ),
    "gantry": CameraPlacement(
        position=(0.4, -0.3, 15.0),
        target=(0.1, 0.0, 0.0),
        up=(-1.0, 0.0, 0.0),
        focal_px=620.0,
        distortion=(-0.045, 0.004, 0.0002, 0.0003, 0.0),
        shows="the whole sheet from above its middle",
    ),
    "side": CameraPlacement(
        position=(-13.5, 0.5, 10.0),
        target=(0.6, 0.1, 0.0),
        focal_px=640.0,
        distortion=(-0.07, 0.009, -0.0003, 0.0004, 0.0),
        shows="the whole sheet from the stand beside its middle",
    ),
    "ceiling": CameraPlacement(
        position=(0.25, 15.4, 6.0),
        target=(0.1, 15.2, 0.0),
        up=(-1.0, 0.0, 0.0),
        focal_px=690.0,
        size=(1280, 960),
        distortion=(-0.16, 0.02, 0.0003, -0.0002, 0.0),
        shows="the away house and its hog line from the ceiling",
    ),
    "ceiling_middle": CameraPlacement(
        position=(-0.3, 0.5, 7.0),
        target=(-0.2, 0.2, 0.0),
        up=(-1.0, 0.0, 0.0),
        focal_px=400.0,
        size=(1280, 960),
        distortion=(-0.045, 0.004, 0.0002, 0.0003, 0.0),
        shows="the hog lines and the ice between them from the ceiling",
    ),
    "ceiling_home": CameraPlacement(
        position=(-0.2, -15.2, 6.2),
        target=(0.0, -15.1, 0.0),
        up=(-1.0, 0.0, 0.0),
        focal_px=690.0,
        size=(1280, 960),
        distortion=(-0.15, 0.018, -0.0002, 0.0003, 0.0),
        shows="the home house and its hog line from the ceiling",
    ),
    "phone": CameraPlacement(
        position=(0.6, -22.73, 1.7),
        target=(0.0, -6.0, 0.0),
        focal_px=1390.0,
        distortion=(0.03, -0.02, 0.0, 0.0, 0.0),
        shows="the sheet from a phone on a tripod, 1.7 m high and 1.7 m behind the home hack",
    ),
    "gallery": CameraPlacement(
        position=(1.5, -31.0, 4.5),
        target=(0.0, -8.0, 0.0),
        focal_px=2250.0,
        shows="the sheet from a gallery window, 8.8 m behind the ice",
    ),
}


def default_size(name: str) -> tuple[int, int]:
    """Default width and height of a named camera's film [px]; the width is 1280."""
    width, height = _placement(name).size
    return 1280, 1280 * height // width


@lru_cache(maxsize=8)
def named_camera(name: str, size: tuple[int, int] | None = None) -> Camera:
    """Return the camera of that name in `CAMERAS`, for an image of `size` (width, height) [px].

    Raises
    ------
    InputError : an unknown name, or an image that is too small to show a stone
    """
    placement = _placement(name)
    width, height = size or default_size(name)
    if width < 64 or height < 48:
        raise InputError(f"expected an image of at least 64 × 48 px, got {width} × {height}")
    scale = min(width / placement.size[0], height / placement.size[1])
    return Camera.looking_at(
        position=placement.position,
        target=placement.target,
        up=placement.up,
        focal_px=placement.focal_px * scale,
        size=(width, height),
        distortion=placement.distortion,
    )


def _placement(name: str) -> CameraPlacement:
    if name not in CAMERAS:
        raise InputError(f"unknown camera {name!r}; expected one of {', '.join(CAMERAS)}")
    return CAMERAS[name]


def scene_of(
    camera: Camera,
    *,
    sheet: Sheet = PAPER_SHEET,
    stone: Stone = RULE_BOOK_STONE,
    click_px: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Scene:
    """Return the scene that a user of a camera would mark: the four corners if all are in view,
    else all painted keypoints in view.

    Parameters
    ----------
    camera : the film's camera
    sheet, stone : the ice and the kind of stone
    click_px : standard error of each click [px]; with 0 the clicks are exact
    rng : generator for the errors of the clicks; needed unless `click_px` is 0

    Raises
    ------
    InputError : fewer than four known points of the sheet are in view
    """
    corners = np.array([sheet.corners[name] for name in CORNERS])
    points = corners
    if not camera.sees(_on_ice(corners)).all():
        points = _painted_keypoints(sheet)
        points = points[camera.sees(_on_ice(points), margin_px=2.0)]
    if len(points) < MIN_POINTS:
        raise InputError(
            f"the camera sees {len(points)} known points of the ice; expected at least four"
        )
    px = camera.project(_on_ice(points))
    if click_px:
        if rng is None:
            raise ValueError("clicks with an error need a generator")
        limit = np.array(camera.size) - 1.0
        px = np.clip(px + rng.normal(0.0, click_px, px.shape), 0.0, limit)
    return Scene(
        sheet_points=points,
        points_px=px,
        camera_matrix=camera.lens.matrix,
        distortion=camera.lens.distortion,
        paint_depth=0.0,
        stone_radius=stone.radius,
        stone_height=stone.height,
        sheet=sheet,
    )


def _on_ice(points: Floats) -> Floats:
    return np.column_stack([points, np.zeros(len(points))])


def _painted_keypoints(sheet: Sheet) -> Floats:
    """Return painted keypoints of both ends, (n, 2) [m]; for a line, its edge towards mid-sheet."""
    side = sheet.width / 2
    one_end = [
        (0.0, TEE_Y),
        (-HOUSE_RADIUS, TEE_Y),
        (HOUSE_RADIUS, TEE_Y),
        (0.0, TEE_Y - HOUSE_RADIUS),
        (0.0, TEE_Y + HOUSE_RADIUS),
        (0.0, HOG_LINE_Y),
        (-side, HOG_LINE_Y),
        (side, HOG_LINE_Y),
    ]
    return np.array(one_end + [(x, -y) for x, y in one_end])
