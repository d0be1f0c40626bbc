"""Drawing in metres into a rectangle of a picture that shows part of the sheet, and text in pixels.

The sheet lies on its side and play runs to the right: a point (x, y) of the delivery frame is drawn
y metres to the right and x metres down.
"""

# OpenCV's stubs leave images untyped.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from curling_env.typing import Floats, Image, Singles

Colour = tuple[int, int, int]

_BITS = 5
"""Number of binary places of a pixel in coordinates for OpenCV."""


@dataclass(frozen=True, kw_only=True)
class Canvas:
    """Part of a picture that shows a part of the sheet.

    Parameters
    ----------
    image : (height, width, 3) RGB, a view into the whole picture, drawn on in place
    left_y : y at its left edge, delivery frame [m]
    top_x : x at its upper edge, delivery frame [m]
    scale : pixels per metre
    """

    image: Image
    left_y: float
    top_x: float
    scale: float

    def pixels(self, xy: ArrayLike) -> Floats:
        """Return pixel coordinates (..., 2) of points in the delivery frame [m]."""
        points = np.asarray(xy, dtype=np.float64)
        along = (points[..., 1] - self.left_y) * self.scale
        down = (points[..., 0] - self.top_x) * self.scale
        return np.stack([along, down], axis=-1) - 0.5

    def points(self) -> Floats:
        """Return the point of the delivery frame under every pixel, (height, width, 2) [m]."""
        height, width = self.image.shape[:2]
        y = self.left_y + (np.arange(width) + 0.5) / self.scale
        x = self.top_x + (np.arange(height) + 0.5) / self.scale
        return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)

    def _fixed(self, xy: ArrayLike) -> NDArray[np.int32]:
        return np.round(self.pixels(xy) * (1 << _BITS)).astype(np.int32)

    def disc(self, centre: ArrayLike, radius: float, colour: Colour) -> None:
        """Draw a filled circle; radius in metres."""
        self._circle(centre, radius * self.scale, colour, cv2.FILLED)

    def ring(self, centre: ArrayLike, radius: float, colour: Colour, width_px: int = 1) -> None:
        """Draw the outline of a circle; radius in metres."""
        self._circle(centre, radius * self.scale, colour, width_px)

    def dot(self, centre: ArrayLike, radius_px: float, colour: Colour) -> None:
        """Draw a filled circle; radius in pixels."""
        self._circle(centre, radius_px, colour, cv2.FILLED)

    def _circle(self, centre: ArrayLike, radius_px: float, colour: Colour, width: int) -> None:
        u, v = (int(k) for k in self._fixed(centre))
        size = round(radius_px * (1 << _BITS))
        cv2.circle(self.image, (u, v), size, colour, width, cv2.LINE_AA, _BITS)

    def polygon(self, corners: ArrayLike, colour: Colour) -> None:
        """Draw a filled polygon through corners (n, 2)."""
        cv2.fillPoly(self.image, [self._fixed(corners)], colour, cv2.LINE_AA, _BITS)

    def line(self, path: ArrayLike, colour: Colour, width_px: int = 1) -> None:
        """Draw a line through points (n, 2)."""
        cv2.polylines(self.image, [self._fixed(path)], False, colour, width_px, cv2.LINE_AA, _BITS)

    def band(self, low: ArrayLike, high: ArrayLike, colour: Colour) -> None:
        """Draw a rectangle between two corners, at least one pixel thick."""
        u0, v0 = np.floor(self.pixels(low) + 0.5).astype(int)
        u1, v1 = np.ceil(self.pixels(high) + 0.5).astype(int)
        height, width = self.image.shape[:2]
        u0, u1 = max(u0, 0), min(max(u1, u0 + 1), width)
        v0, v1 = max(v0, 0), min(max(v1, v0 + 1), height)
        self.image[v0:v1, u0:u1] = colour


@lru_cache(maxsize=16)
def _font(size: int, bold: bool) -> Any:
    import matplotlib
    from PIL import ImageFont

    # DejaVu Sans comes with matplotlib and has μ, σ and ω.
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name, size)


@lru_cache(maxsize=512)
def _mask(text: str, size: int, bold: bool) -> Singles:
    """Return the opacity of a text's pixels, (height, width) in 0–1."""
    from PIL import Image as Picture
    from PIL import ImageDraw

    font = _font(size, bold)
    ascent, descent = font.getmetrics()
    width = max(int(np.ceil(font.getlength(text))) + 2, 1)
    picture = Picture.new("L", (width, ascent + descent))
    ImageDraw.Draw(picture).text((0, 0), text, font=font, fill=255)
    return np.asarray(picture, dtype=np.float32) / np.float32(255)


def write(
    image: Image,
    text: str,
    at: tuple[float, float],
    *,
    size: int = 15,
    colour: Colour = (230, 236, 242),
    bold: bool = False,
    align: float = 0.0,
) -> None:
    """Write one line of text into a picture.

    Parameters
    ----------
    image : the picture, drawn on in place
    text : the line; nothing is written for an empty one
    at : column of the line's left end (align 0), middle (0.5) or right end (1), and row of its top
        [pixels]
    size : height of the type [pixels]
    colour : colour of the text
    bold : use bold type
    align : point of the line at the column
    """
    if not text:
        return
    mask = _mask(text, size, bold)
    height, width = mask.shape
    u, v = round(at[0] - align * width), round(at[1])
    left, top = max(u, 0), max(v, 0)
    right, bottom = min(u + width, image.shape[1]), min(v + height, image.shape[0])
    if left >= right or top >= bottom:
        return
    weight = mask[top - v : bottom - v, left - u : right - u, None]
    patch = image[top:bottom, left:right]
    patch[:] = np.round(patch + weight * (np.array(colour, dtype=np.float32) - patch))
