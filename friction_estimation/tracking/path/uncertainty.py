"""What stays the same from frame to frame: how far camera and stone's shape may misplace a track.

A smoother sees only noise. The pose found from the paint, the lens, and the outline learnt for the
stone move every frame together, so they are carried over to the ice by their own covariances.
"""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.markings_fit import CLICK_PX
from friction_estimation.camera.refinement import RefinedCamera

EDGE_SYSTEMATIC_PX = 0.068
"""How far the outline learnt for a stone is off in the image, seen from above."""
OBLIQUITY = 32.0
"""Low views hardly tell a stone's foot from its far rim: the outline's error grows with the squared
cotangent of the line of sight's elevation over this. Set on films that
`friction_estimation.synthetic` rendered: from 7 to 9 m above the far end, of stones with four
outlines, and from the gantry at 540 and 1080 lines."""
OUTLINE = 0.0055
"""How far the outline learnt for a stone is off along the ice where it is seen from one side [m];
from straight above both its sides show, and nothing of it. What lamps and shadows do to a stone's
sides passes for shape. Set on eight films that `friction_estimation.synthetic` rendered of ceiling
cameras and gantries past which a stone slides, or short of which it stays: errors grow there with
the slant of the view to 2 to 4 mm, and in two of them to 6 mm."""
ONE_WAY = 0.7
"""Most of what frames share lies along the line of sight, and one number stands for both
coordinates: with so much of the larger one's square, 95 % of all coordinates lie in their intervals
even where only one of the two is off."""
HANDLE_PX = 0.25
"""How far the handle learnt for a stone is off across its length. On three of the same films 93 to
96 % of the headings lie within 1.96 standard errors; on the fourth no heading is found."""
STEP = 1e-5


def camera_variance(landmarks: RefinedCamera, xy: Floats, z: float) -> Floats:
    """Squared standard errors of both coordinates that pose and lens leave, (n, 2) [m²].

    Parameters
    ----------
    landmarks : the camera, and how well the paint told it
    xy : (n, 2) places [m]
    z : their height above the ice [m]
    """
    px = landmarks.camera.project(np.column_stack([xy, np.full(len(xy), z)]))
    count = len(landmarks.covariance)
    moved = np.zeros((len(xy), 2, count))
    if landmarks.readings:
        for p in range(count):
            moved[:, :, p] = (landmarks.moved(p, STEP).on_plane(px, z) - xy) / STEP
    variance = np.einsum("nip,pq,niq->ni", moved, landmarks.covariance, moved)
    if landmarks.farther is not None:
        variance += (landmarks.farther.on_plane(px, z) - xy) ** 2
    return variance


def systematic_sigma(
    landmarks: RefinedCamera, xy: Floats, height: float, lag_px: float = 0.0
) -> Floats:
    """Standard error of each coordinate that is common to all frames, (n,) [m].

    Parameters
    ----------
    landmarks : the camera that measured
    xy : (n, 2) places on the ice [m]
    height : of the stone [m]
    lag_px : how far the film's compression may have left its picture behind [px]
    """
    camera, middle = landmarks.camera, height / 2
    variance = camera_variance(landmarks, xy, middle)
    metre = _metres_per_px(camera, xy, middle)
    sight = xy - camera.position[:2]
    cotangent = np.linalg.norm(sight, axis=1) / (camera.position[2] - middle)
    edge_px = EDGE_SYSTEMATIC_PX * np.hypot(1.0, cotangent**2 / OBLIQUITY)
    # Without paint to check them, the clicked points are all there is.
    loose_px = 0.0 if landmarks.readings else CLICK_PX / 2
    edge = (np.hypot(np.hypot(edge_px, loose_px), lag_px)[:, None] * metre) ** 2
    rise = camera.position[2] - middle
    outline = OUTLINE**2 * sight**2 / (rise**2 + np.sum(sight**2, axis=1))[:, None]
    seen_less = np.sum(outline, axis=1) > np.sum(edge, axis=1)
    variance += np.where(seen_less[:, None], outline, edge)
    return np.sqrt(np.maximum(variance.mean(axis=1), ONE_WAY * variance.max(axis=1)))


def heading_sigma(camera: Camera, xy: Floats, model: StoneModel) -> Floats:
    """Standard error of the heading that neighbouring frames share, (n,) [rad].

    Parameters
    ----------
    xy : (n, 2) places on the ice [m]
    model : whose handle shows the heading
    """
    length = model.handle_front - model.handle_back
    z = model.height + model.handle_rise
    squeezed = [np.linalg.norm(camera.px_per_metre(place, z), -2) for place in xy]
    return HANDLE_PX / (length * np.array(squeezed, dtype=np.float64))


def _metres_per_px(camera: Camera, xy: Floats, z: float) -> Floats:
    """How far each coordinate moves per pixel along the image direction that moves it most."""
    found = np.empty((len(xy), 2))
    for i, place in enumerate(xy):
        found[i] = np.linalg.norm(np.linalg.inv(camera.px_per_metre(place, z)), axis=1)
    return found
