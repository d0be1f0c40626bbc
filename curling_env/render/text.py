"""Words in pictures, set in a real typeface."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.render.canvas import Colour, Image


@lru_cache(maxsize=16)
def _font(size: int, bold: bool) -> Any:
    import matplotlib
    from PIL import ImageFont

    # DejaVu Sans comes with matplotlib and knows μ, σ and ω.
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name, size)


@lru_cache(maxsize=512)
def _mask(text: str, size: int, bold: bool) -> NDArray[np.float32]:
    """Opacity of the text, (height, width) in 0–1."""
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
    """Write one line into a picture.

    Parameters
    ----------
    at : pixel of the line's left end (align 0), middle (0.5) or right end (1), and of its top
    size : of the type, in pixels
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
