"""Brightness and two colour differences, as stored in films (ITU-R BT.601)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from curling_env.typing import Floats

BLUE_LIGHT, GREEN_LIGHT, RED_LIGHT = 0.114, 0.587, 0.299
"""Contribution of each colour to brightness."""
BLUE_DIFFERENCE, RED_DIFFERENCE = 0.564, 0.713
"""Scale of blue minus brightness, and of red minus brightness."""


def channels_of_colour(blue: float, green: float, red: float) -> Floats:
    """Return brightness and the two differences of a colour, (3,)."""
    light = BLUE_LIGHT * blue + GREEN_LIGHT * green + RED_LIGHT * red
    return np.array([light, BLUE_DIFFERENCE * (blue - light), RED_DIFFERENCE * (red - light)])


def blue_and_red(channels: ArrayLike) -> tuple[float, float]:
    """Return blue and red of a colour, from its channels (3,)."""
    light, blue, red = np.asarray(channels, dtype=np.float64).tolist()
    return light + blue / BLUE_DIFFERENCE, light + red / RED_DIFFERENCE


def green_beside(light: float, blue: float, red: float) -> float:
    """Return green of a colour whose brightness, blue and red are known."""
    return (light - BLUE_LIGHT * blue - RED_LIGHT * red) / GREEN_LIGHT
