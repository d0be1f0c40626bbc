"""Range of camera heights that marked points allow."""

from __future__ import annotations

import numpy as np

from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import Lens
from friction_estimation.camera.pose import cameras_from_points
from friction_estimation.camera.refinement import RefinedCamera, log_height_prior
from friction_estimation.camera.scene import Scene

CLICK_PX = 2.0
"""Error of a click [px]."""
LOG_FOCALS = np.linspace(np.log(0.1), np.log(8.0), 45)
"""Logarithms of the focal lengths that are tried, in longer sides of the picture."""
BENDS = (0.02, 0.0, -0.03, -0.06, -0.1, -0.15)
"""Distortions that are tried where none is given: share by which the longer side's end is moved."""
OUTSIDE = 0.025
"""Probability of a height below the range, and of one above it."""


def height_from_clicks(scene: Scene, camera: Camera) -> tuple[float, float]:
    """The heights at which a camera may hang that sees points where they were marked [m].

    Where a camera looks straight down, a long lens high up and a short one low down give the same
    picture. The points then leave open what is usual: cameras hang a few metres above the ice.

    Parameters
    ----------
    scene : the points, and the lens where it is known
    camera : found from them

    Returns
    -------
    the height is between these two with 95 % probability
    """
    if scene.camera_matrix is not None:
        height = float(camera.position[2])
        return height, height
    side = max(camera.size)
    focals = side * np.exp(LOG_FOCALS)
    lenses = [Lens.centred(float(f), camera.size, camera.lens.distortion) for f in focals]
    if scene.distortion is None:
        lenses = [lens.bent(bend) for lens in lenses for bend in BENDS]
    points = scene.sheet_points, scene.points_px
    found = [one for lens in lenses for one in cameras_from_points(*points, lens)[:1]]
    heights = np.array([seen.position[2] for _, seen in found])
    costs = np.array(
        [
            len(scene.points_px) * (rms_px / CLICK_PX) ** 2
            + log_height_prior(seen, scene.camera_height)
            for rms_px, seen in found
        ]
    )
    order = np.argsort(heights)
    weight = np.exp(-0.5 * (costs - costs.min()))[order]
    share = np.cumsum(weight) / weight.sum()
    low, high = np.interp([OUTSIDE, 1 - OUTSIDE], share, heights[order])
    return float(low), float(high)


def height_from_paint(refined: RefinedCamera) -> tuple[float, float]:
    """The same for a camera that was fitted to the painted lines.

    The lens is what leaves the height open: its standard error moves the camera up or down.
    """
    height, spread = float(refined.camera.position[2]), refined.log_focal_sigma
    if spread == 0.0:
        return height, height
    drift = refined.covariance[:, 6] / refined.covariance[6, 6]
    step = min(spread, 0.05)
    moved = refined.camera.moved(drift * step, refined.lens)
    per_focal = abs(np.log(float(moved.position[2]) / height)) / step
    factor = float(np.exp(2 * spread * per_focal))
    return height / factor, height * factor
