"""Names of the colours of handles."""

from __future__ import annotations

from enum import StrEnum

import cv2
import numpy as np

from curling_env.typing import Floats, Image


class HandleColour(StrEnum):
    """Colours of handles as people call them."""

    RED = "red"
    YELLOW = "yellow"
    GREEN = "green"
    BLUE = "blue"
    PURPLE = "purple"
    BLACK = "black"
    GREY = "grey"
    WHITE = "white"


HUES = {
    HandleColour.RED: 0.0,
    HandleColour.YELLOW: 50.0,
    HandleColour.GREEN: 130.0,
    HandleColour.BLUE: 215.0,
    HandleColour.PURPLE: 285.0,
}
"""Hue of each colour on the colour circle [degrees]."""
FAINT = 0.25
"""Saturation below which a handle has no colour, and brightness below which such a one is black;
above the rest of the scale it is white."""
CHROMATIC_SHARE = 0.12
"""Share of a stone that its handle covers at least; the granite around it has no colour."""
INNER = 0.7
"""Share of a stone's width and length that contains its handle; farther out ice is visible too."""


def handle_colour(picture: Image) -> Floats:
    """Colour of a stone's handle, (3,) BGR: the median of the most saturated pixels.

    Parameters
    ----------
    picture : (rows, columns, 3) BGR, the stone from edge to edge
    """
    rows, columns = picture.shape[:2]
    down, right = np.mgrid[:rows, :columns] + 0.5
    inside = np.hypot(2 * down / rows - 1, 2 * right / columns - 1) <= INNER
    values = picture[inside].astype(np.float64)
    chroma = np.ptp(values, axis=1)
    count = max(int(CHROMATIC_SHARE * len(values)), 1)
    return np.median(values[np.argsort(-chroma)[:count]], axis=0)


def colour_name(colour: Floats) -> HandleColour:
    """Name a colour, (3,) BGR."""
    pixel = np.asarray(colour, dtype=np.float32).reshape(1, 1, 3) / 255
    hue, saturation, value = (float(v) for v in cv2.cvtColor(pixel, cv2.COLOR_BGR2HSV)[0, 0])
    if saturation < FAINT:
        if value < FAINT:
            return HandleColour.BLACK
        return HandleColour.WHITE if value > 1 - FAINT else HandleColour.GREY

    def apart(name: HandleColour) -> float:
        return abs((hue - HUES[name] + 180) % 360 - 180)

    return min(HUES, key=apart)
