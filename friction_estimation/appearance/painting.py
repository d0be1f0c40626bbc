"""Pictures of a stone in a window: painted in fine pixels, coloured, and blurred by the camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.appearance.kernels.paint_kernels import (
    paint_body,
    paint_handle,
    paint_shade,
)
from friction_estimation.appearance.kernels.picture_kernels import blur, colour_planes
from friction_estimation.appearance.model import PixelWindow, ShapeValues
from friction_estimation.appearance.shape import FINE, HANDLE, PLANES, SHADE

Planes = NDArray[np.float32]
"""Painted planes; single precision suffices for their accuracy of a tenth of a grey level."""

SHARP, SOFT = slice(0, 2), slice(2, 5)
"""Tinted planes with the blur of brightness, and with that of colour."""


def painted(window: PixelWindow, shape: ShapeValues, pose: Floats, *, with_handle: bool) -> Planes:
    """Return a painted stone: its planes in fine pixels (`shape.PLANES`), (7, rows·FINE,
    columns·FINE).

    Parameters
    ----------
    pose : (3,) x, y [m] and theta [rad]
    """
    rows, columns = window.shape
    planes = np.empty((PLANES, rows * FINE, columns * FINE), dtype=np.float32)
    rays = window.ray_xy, window.ray_slope, window.scale
    paint_body(pose[0], pose[1], shape, *rays, rows, columns, planes)
    paint_shade(pose[0], pose[1], shape, window.ray_xy, rows, columns, planes[SHADE])
    if with_handle:
        repaint_handle(planes, window, shape, pose)
    else:
        planes[HANDLE] = 0.0
    return planes


def repaint_handle(planes: Planes, window: PixelWindow, shape: ShapeValues, pose: Floats) -> None:
    """Paint the handle, in place."""
    rays = window.ray_xy, window.ray_slope, window.scale
    paint_handle(*pose, shape, *rays, *window.shape, planes[HANDLE])


def coloured(planes: Planes, colours: Floats) -> Planes:
    """Return the stone's light and the ice's that it hides, (5, rows·FINE, columns·FINE)."""
    out = np.empty((5, *planes.shape[1:]), dtype=np.float32)
    colour_planes(planes, colours.astype(np.float32), out)
    return out


def blurred(
    light: Planes,
    window: PixelWindow,
    shape: ShapeValues,
    shift_px: tuple[float, float] = (0.0, 0.0),
    *,
    sloped: bool = False,
) -> Planes:
    """Tinted planes at the camera's resolution, (5, 3, rows, columns): values and slopes by
    shift.
    """
    rows, columns = window.shape
    out = np.empty((5, 3, rows, columns), dtype=np.float32)
    for planes, sigma in ((SHARP, shape.blur_px), (SOFT, shape.colour_blur_px)):
        blur(light[planes], rows, columns, sigma, *shift_px, sloped, out[planes])
    return out


def composite_change(seen: Planes, behind: Planes | Floats) -> Planes | Floats:
    """Return the change of the ice's picture by the stone, (3, ...).

    Parameters
    ----------
    seen : (5, ...) values or slopes of `blurred`
    behind : (3, ...) channels of the ice
    """
    own, hidden = seen[[0, 2, 3]], seen[[1, 4, 4]]
    own -= behind * hidden
    return own


def shares(planes: Planes, window: PixelWindow, shape: ShapeValues) -> Planes:
    """Return the share of each pixel that every part covers, and the light that its ice loses.

    Parameters
    ----------
    planes, window, shape : see `painted`

    Returns
    -------
    (2, rows·columns, 7) first as brightness is blurred, then as colour is: the parts, the light
    that the ice loses, and the light from one side
    """
    rows, columns = window.shape
    visible = planes * (1 - planes[HANDLE])
    visible[HANDLE] = planes[HANDLE]
    visible[SHADE] *= 1 - planes[:HANDLE].sum(axis=0)
    out = np.empty((2, rows * columns, PLANES), dtype=np.float32)
    seen = np.empty((PLANES, 3, rows, columns), dtype=np.float32)
    for channel, sigma in enumerate((shape.blur_px, shape.colour_blur_px)):
        blur(visible, rows, columns, sigma, 0.0, 0.0, False, seen)
        out[channel] = seen[:, 0].reshape(PLANES, -1).T
    return out
