"""A camera above the home half of a sheet, for throws that end there.

The tracker searches all visible ice for stones at rest, at a fixed number of pixels for each metre.
Half of the ice takes half of that time.
"""

from __future__ import annotations

from friction_estimation.camera import Camera
from friction_estimation.synthetic import CAMERAS

MIDDLE = -9.5
"""Place along the sheet below the camera [m]."""


def home_half(whole: tuple[int, int]) -> Camera:
    """Return a camera like "gantry", whose picture is the part of one of this size [px]."""
    gantry = CAMERAS["gantry"]
    (x, y, z), (to_x, to_y, to_z) = gantry.position, gantry.target
    scale = min(whole[0] / gantry.size[0], whole[1] / gantry.size[1])
    return Camera.looking_at(
        position=(x, y + MIDDLE, z),
        target=(to_x, to_y + MIDDLE, to_z),
        up=gantry.up,
        focal_px=gantry.focal_px * scale,
        size=(2 * round(0.27 * whole[0]), 2 * round(0.28 * whole[1])),
        distortion=gantry.distortion,
    )
