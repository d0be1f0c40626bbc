"""Light and a camera with a known view."""

from __future__ import annotations

from friction_estimation.camera import Camera
from friction_estimation.synthetic import Light

EVEN = Light(vignette=0, gradient=0, gloss=0, pebble=0, shadow=0, flicker=0)
"""Light that leaves every colour unchanged."""
PLACES_SEEN = {"ceiling_middle": (0.5, 9.0), "ceiling_home": (-16.9, -11.3)}
"""Along the sheet [m], for cameras that do not see the away house."""


def above(x: float, y: float, height: float = 6.0, focal_px: float = 600.0) -> Camera:
    """A camera straight above a point; the image's u grows with y and its v with x."""
    return Camera.looking_at(
        position=(x, y, height),
        target=(x, y, 0.0),
        up=(-1.0, 0.0, 0.0),
        focal_px=focal_px,
        size=(320, 240),
    )
