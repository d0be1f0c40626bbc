"""Systematic errors of a track: displacements by the camera and the stone's outline.

A smoother estimates only noise. Errors of the camera's pose, of the lens and of the stone's outline
are the same in every frame, so they are propagated to the ice separately.
"""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import ShapeUncertainty, StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.camera.tuning import CLICK_SIGMA_PX, EDGE_ERROR_PX
from friction_estimation.tracking import tuning


def systematic_sigma(
    refined: RefinedCamera,
    xy: Floats,
    model: StoneModel,
    unseen: Floats | None = None,
    shape: ShapeUncertainty | None = None,
    hidden: Floats | None = None,
) -> Floats:
    """Standard error of each coordinate that neighbouring frames share, (n,) [m].

    Parameters
    ----------
    refined : the camera with which the film was measured
    xy : (n, 2) places on the ice [m]
    model : the stone; its size counts
    unseen : (n, 2) way that the pictures may not show because of compression [m]; None: none
    shape : uncertainty of the stone's shape
    hidden : (n,) share of the stone that something hides, see `smoothed_occlusion`; None: nothing
    """
    camera, middle = refined.camera, model.height / 2
    variance = refined.place_variance(xy, middle)
    # Without paint, the camera depends on the clicked points alone.
    loose_px = 0.0 if refined.measured else CLICK_SIGMA_PX / 2
    small_px = tuning.SMALL_STONE_ERROR_PX / (model.radius * camera.scale(xy, model.height / 2))
    hidden_px = tuning.HIDDEN_ERROR_PX * np.sqrt(0.0 if hidden is None else hidden)
    edge_px = np.sqrt(EDGE_ERROR_PX**2 + small_px**2 + loose_px**2 + hidden_px**2)
    variance += (edge_px[:, None] * camera.metres_per_px(xy, middle)) ** 2
    if shape is not None:
        variance += shape.at(xy) ** 2
    if unseen is not None:
        variance += unseen**2
    least = tuning.LARGER_COORDINATE_SHARE * variance.max(axis=1)
    return np.sqrt(np.maximum(variance.mean(axis=1), least))


def hidden_sigma(camera: Camera, xy: Floats, hidden: Floats, model: StoneModel) -> Floats:
    """Standard error of each coordinate due to partial occlusion, (n, 2) [m].

    Parameters
    ----------
    xy : (n, 2) places on the ice [m]; NaN where it was not seen
    hidden : (n,) share of the stone that was excluded from its measurement
    """
    sigma = np.zeros_like(xy)
    some = (hidden > 0) & np.isfinite(xy[:, 0])
    px = tuning.HIDDEN_ERROR_PX * np.sqrt(hidden[some])
    sigma[some] = px[:, None] * camera.metres_per_px(xy[some], model.height / 2)
    return sigma


def smoothed_occlusion(t: Floats, hidden: Floats) -> Floats:
    """Occluded share of a stone (n,), as its mean over the frames around each.

    The occluder moves with the stone, so errors of neighbouring frames are correlated.
    """
    if not hidden.any():
        return hidden
    around = np.abs(t[:, None] - t) <= tuning.HIDDEN_NEIGHBOURS
    return around @ hidden / around.sum(axis=1)


def unseen_displacement(t: Floats, velocity: Floats, age: Floats) -> Floats:
    """Return the displacement of a stone since its pixels last changed, (n, 2) [m].

    It is assumed to decelerate as on ice: a stone that does not move in the picture need not be at
    rest.

    Parameters
    ----------
    t, velocity : (n,) times [s], and (n, 2) velocities then [m/s]
    age : (n,) how long ago the pixels last changed [s]
    """
    then = np.column_stack([np.interp(t - age, t, axis) for axis in velocity.T])
    rate = tuning.DECELERATION / np.maximum(np.hypot(*then.T), 1e-6)
    going = np.minimum(age, 1 / rate)
    return then * (going - 0.5 * rate * going**2)[:, None]


def block_sigma(single: Floats, repeated: Floats) -> Floats:
    """Standard error of each coordinate due to blocks that a codec did not send, (n, 2) [m].

    Errors of their pixels are common, and follow neither the travel nor the line of sight: they
    increase with low contrast and in low views.

    Parameters
    ----------
    single : (n, 2) standard errors of the measurements, were each pixel to err by itself [m]
    repeated : (n,) share of the stone's rim that shows what it did in the frame before
    """
    return tuning.BLOCK_ERROR * np.sqrt(repeated)[:, None] * single


def heading_sigma(camera: Camera, xy: Floats, model: StoneModel) -> Floats:
    """Standard error of the heading that neighbouring frames share, (n,) [rad].

    Parameters
    ----------
    xy : (n, 2) places on the ice [m]
    model : the stone; the length of its handle counts
    """
    length = model.handle_front - model.handle_back
    z = model.height + model.handle_rise
    across = tuning.HANDLE_ERROR_PX / np.linalg.norm(camera.px_per_metre(xy, z), -2, axis=(1, 2))
    away = np.linalg.norm(xy - camera.position[:2], axis=1)
    tilted = tuning.HANDLE_TILT_ERROR * away / (camera.position[2] - z)
    return np.hypot(across, tilted) / length
