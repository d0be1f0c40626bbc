"""Stones in a single picture, found with the help of a picture of the empty ice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.appearance.colour_names import HandleColour, colour_name, handle_colour
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background, Blob, moving_blobs

RED = (40, 40, 230)
"""Colour of drawings, blue-green-red."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DetectedStone:
    """A stone found in a picture.

    Parameters
    ----------
    xy : (2,) its place on the ice [m]
    sigma : standard error of each coordinate [m]
    px : (2,) centre of what is seen of it [px]
    colour : (3,) median colour of what is seen of it, blue-green-red
    handle : the colour of its handle by name; it tells the teams apart
    """

    xy: Floats
    sigma: float
    px: Floats
    colour: Floats
    handle: HandleColour

    def as_dict(self, own: HandleColour | None = None) -> dict[str, Any]:
        """Its entry in a stones file; with the own team's handle colour, also its team."""
        return {
            "x": round(float(self.xy[0]), 4),
            "y": round(float(self.xy[1]), 4),
            "sigma": round(self.sigma, 4),
            "px": [float(value) for value in self.px],
            "colour": [int(value) for value in self.colour[::-1]],
            "handle": str(self.handle),
            **({} if own is None else {"team": "own" if self.handle is own else "other"}),
        }


def find_stones_in_image(
    picture: Image, empty: Image, camera: Camera, model: StoneModel, sheet: Sheet
) -> list[DetectedStone]:
    """Find the stones on the ice in one picture, those nearest to the away end first.

    A difference from the empty ice is a stone if it is as large as a stone would look there, about
    as long as wide, and filled. People are larger, or have limbs.

    Parameters
    ----------
    picture, empty : (rows, columns, 3) BGR, from the same camera, with and without stones

    Raises
    ------
    InputError : a picture has another size than the scene's
    """
    for name, image in (("the picture", picture), ("the empty ice", empty)):
        size = (image.shape[1], image.shape[0])
        if size != camera.size:
            raise InputError(
                f"{name} has {size[0]} × {size[1]} px, "
                f"the scene is of {camera.size[0]} × {camera.size[1]} px"
            )
    apart = cv2.absdiff(picture, empty).max(axis=2)
    ice = Background(
        origin_px=(0, 0),
        image=empty,
        noise=max(1.0, 1.4826 * float(np.median(apart))),
    )
    found = [
        stone
        for blob in moving_blobs(picture, ice)
        if (stone := _as_stone(blob, picture, camera, model, sheet)) is not None
    ]
    return sorted(found, key=lambda stone: -stone.xy[1])


def _as_stone(
    blob: Blob, picture: Image, camera: Camera, model: StoneModel, sheet: Sheet
) -> DetectedStone | None:
    """The blob as a stone; None where its size or shape is another."""
    rim = tuning.PICTURE_RIM_PX
    extent = blob.high_px - blob.low_px + 1
    middle = (blob.low_px + blob.high_px) / 2
    xy = camera.on_plane(middle[None], model.height / 2)[0]
    half = np.array([sheet.width, sheet.length]) / 2
    if not (np.isfinite(xy).all() and (np.abs(xy) < half + model.radius).all()):
        return None
    outline = model.outline_px(camera, xy)
    if len(outline) == 0:
        return None
    expected = np.ptp(outline, axis=0)
    share = (extent - rim / 2) / expected
    stretch = max(share) / min(share)
    filled = blob.area_px / float(np.prod(extent))
    if (
        (share < tuning.MIN_PICTURE_SHARE).any()
        or (extent > tuning.MAX_PICTURE_SHARE * expected + rim).any()
        or (blob.whole_px > tuning.MAX_PICTURE_SHARE_WITH_SHADOW * expected + rim).any()
        or stretch > tuning.MAX_PICTURE_STRETCH
        or filled < tuning.MIN_PICTURE_FILL
    ):
        return None
    (u, v), (right, below) = blob.low_px.astype(int), blob.high_px.astype(int)
    inner = picture[v : below + 1, u : right + 1]
    metre_px = float(np.sqrt(abs(np.linalg.det(camera.px_per_metre(xy, model.height / 2)))))
    # All that is missing of the outline may be missing on one side.
    off_px = max(1.0, float(np.abs(expected + rim / 2 - extent).max()) / 2)
    return DetectedStone(
        xy=xy,
        sigma=float(off_px / metre_px / np.sqrt(2)),
        px=middle,
        colour=np.median(inner.reshape(-1, 3), axis=0),
        handle=colour_name(handle_colour(inner)),
    )


def draw_stones(
    picture: Image, stones: Sequence[DetectedStone], camera: Camera, model: StoneModel
) -> Image:
    """The picture with the outline and the place of each stone; small pictures are enlarged."""
    scale = max(1, round(1200 / max(camera.size)))
    size = (picture.shape[1] * scale, picture.shape[0] * scale)
    sketch = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_CUBIC), dtype=np.uint8)
    for stone in stones:
        px = (model.outline_px(camera, stone.xy) + 0.5) * scale - 0.5
        outline = cv2.convexHull(px.astype(np.float32))
        cv2.polylines(sketch, [np.round(outline).astype(np.int32)], True, RED, 2, cv2.LINE_AA)
        at = px.max(axis=0) + 4
        text = f"{stone.xy[0]:.2f}, {stone.xy[1]:.2f} m, {stone.handle}"
        where = (int(min(at[0], size[0] - 160)), int(min(at[1] + 12, size[1] - 6)))
        cv2.putText(sketch, text, where, cv2.FONT_HERSHEY_SIMPLEX, 0.55, RED, 1, cv2.LINE_AA)
    return sketch
