"""Text in pictures."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.render.canvas import Colour
from curling_env.typing import Image, Singles


@lru_cache(maxsize=16)
def _font(size: int, bold: bool) -> Any:
    import matplotlib
    from PIL import ImageFont

    # DejaVu Sans comes with matplotlib and knows μ, σ and ω.
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name, size)


@lru_cache(maxsize=512)
def _mask(text: str, size: int, bold: bool) -> Singles:
    """Opacity of a text's pixels, (height, width) in 0–1."""
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
    bold : whether the type is bold
    align : which point of the line is at the column
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
