"""Stones in a single picture of the ice: positions and handle colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.appearance.colour_names import HandleColour, colour_name, handle_colour
from friction_estimation.appearance.model import CIRCLE
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.pose import place_sigma
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking.detection.detector import (
    MIN_STONE_PX,
    DetectedPlace,
    StoneFinder,
)
from friction_estimation.tracking.tuning import SAME_PLACE

RED, AMBER = (40, 40, 230), (0, 170, 255)
"""Colours of drawings of stones and of doubtful stones, blue-green-red."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DetectedStone:
    """Stone found in a picture.

    Parameters
    ----------
    xy : (2,) its place on the ice [m]
    sigma : standard error of each coordinate [m], see `with_camera_error`
    px : (2,) the centre of its foot [px]
    score : 0 to 1, how clearly it is a stone
    doubtful : True if it may be something else
    colour : (3,) median colour of its upper side, blue-green-red
    handle : the colour of its handle by name; it tells the teams apart
    """

    xy: Floats
    sigma: float
    px: Floats
    score: float
    doubtful: bool
    colour: Floats
    handle: HandleColour

    def as_dict(self, own: HandleColour | None = None) -> dict[str, Any]:
        """Return its entry in a stones file; with the own team's handle colour, also its team."""
        return {
            "x": round(float(self.xy[0]), 4),
            "y": round(float(self.xy[1]), 4),
            "sigma": round(self.sigma, 4),
            "px": [round(float(value), 1) for value in self.px],
            "score": round(self.score, 2),
            "colour": [int(value) for value in self.colour[::-1]],
            "handle": str(self.handle),
            **({"doubtful": True} if self.doubtful else {}),
            **({} if own is None else {"team": "own" if self.handle is own else "other"}),
        }


def find_stones_in_image(
    picture: Image, camera: Camera, model: StoneModel, sheet: Sheet
) -> list[DetectedStone]:
    """Find the stones in play in one picture, those nearest to the away end first.

    Stones beyond the back lines are out of play and not listed.

    Parameters
    ----------
    picture : (rows, columns, 3) BGR

    Raises
    ------
    InputError : the picture has another size than the scene's, or is too small
    """
    size = (picture.shape[1], picture.shape[0])
    if size != camera.size:
        raise InputError(
            f"expected a picture of {camera.size[0]} × {camera.size[1]} px as in the scene, "
            f"got {size[0]} × {size[1]} px"
        )
    finder = StoneFinder(camera, model, sheet)
    if not finder.sees_stones:
        raise InputError(
            f"the picture is too small: stones must be {MIN_STONE_PX:g} px wide or wider in it"
        )
    found = finder.detect(picture)
    stones = [_as_stone(one, picture, camera, model) for one in found if one.in_play]
    return sorted(stones, key=lambda stone: -stone.xy[1])


def without_paint(
    stones: Sequence[DetectedStone], empty: Sequence[DetectedStone]
) -> list[DetectedStone]:
    """Drop doubtful stones that are also found in a picture of the empty ice."""
    return [
        stone
        for stone in stones
        if not stone.doubtful
        or all(np.linalg.norm(stone.xy - paint.xy) > SAME_PLACE for paint in empty)
    ]


def with_camera_error(
    stones: Sequence[DetectedStone], scene: Scene, camera: Camera
) -> list[DetectedStone]:
    """Include the camera's error in the standard error of each place."""
    if not stones:
        return []
    camera_sigma = place_sigma(scene, camera, np.array([stone.xy for stone in stones]))
    return [
        replace(stone, sigma=float(np.hypot(stone.sigma, sigma)))
        for stone, sigma in zip(stones, camera_sigma, strict=True)
    ]


def _as_stone(
    one: DetectedPlace, picture: Image, camera: Camera, model: StoneModel
) -> DetectedStone:
    """Return the stone at a position, with the colours of its upper side."""
    circle = one.xy + model.radius * CIRCLE
    px = camera.project(np.column_stack([circle, np.full(len(circle), model.height)]))
    (left, top), (right, below) = np.maximum([px.min(axis=0), px.max(axis=0) + 1], 0).astype(int)
    rows, columns = slice(top, max(below, 1)), slice(left, max(right, 1))
    upper = picture[rows, columns]
    return DetectedStone(
        xy=one.xy,
        sigma=float(np.sqrt(np.trace(one.covariance) / 2)),
        px=one.px,
        score=one.score,
        doubtful=not one.is_sure,
        colour=np.median(upper.reshape(-1, 3), axis=0),
        handle=colour_name(handle_colour(upper)),
    )


def draw_stones(
    picture: Image, stones: Sequence[DetectedStone], camera: Camera, model: StoneModel
) -> Image:
    """Draw outline and position of each stone into the picture; small pictures are enlarged."""
    scale = max(1, round(1200 / max(camera.size)))
    size = (picture.shape[1] * scale, picture.shape[0] * scale)
    sketch = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_CUBIC), dtype=np.uint8)
    for stone in stones:
        colour = AMBER if stone.doubtful else RED
        px = (model.outline_px(camera, stone.xy) + 0.5) * scale - 0.5
        outline = cv2.convexHull(px.astype(np.float32))
        cv2.polylines(sketch, [np.round(outline).astype(np.int32)], True, colour, 2, cv2.LINE_AA)
        at = px.max(axis=0) + 4
        name = "stone?" if stone.doubtful else str(stone.handle)
        text = f"{stone.xy[0]:.2f}, {stone.xy[1]:.2f} m, {name}"
        where = (int(min(at[0], size[0] - 160)), int(min(at[1] + 12, size[1] - 6)))
        cv2.putText(sketch, text, where, cv2.FONT_HERSHEY_SIMPLEX, 0.55, colour, 1, cv2.LINE_AA)
    return sketch
