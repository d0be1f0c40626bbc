"""Pictures of a stone in a window: painted in fine pixels, coloured, and blurred by the camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.appearance.kernels.paint_kernels import (
    paint_body,
    paint_dark,
    paint_handle,
    shade_ice,
)
from friction_estimation.appearance.kernels.picture_kernels import blur, colour_planes
from friction_estimation.appearance.model import PixelWindow
from friction_estimation.appearance.shape import (
    BEVEL,
    BLUR_PX,
    COLOUR_BLUR_PX,
    FINE,
    FOOT,
    HANDLE,
    LIT,
    PLANES,
    SHADE,
    SIDE,
    TOP,
)

Planes = NDArray[np.float32]
"""Painted planes; single precision suffices for their accuracy of a tenth of a grey level."""

SHARP, SOFT = slice(0, 2), slice(2, 5)
"""Tinted planes with the blur of brightness, and with that of colour."""


def painted(window: PixelWindow, shape: Floats, pose: Floats, *, with_handle: bool) -> Planes:
    """Return a painted stone: its planes in fine pixels (`shape.PLANES`), (7, rows·FINE,
    columns·FINE).

    Parameters
    ----------
    shape : (29,) see `SHAPE_PARAMETERS`
    pose : (3,) x, y [m] and theta [rad]
    """
    rows, columns = window.shape
    planes = np.empty((PLANES, rows * FINE, columns * FINE), dtype=np.float32)
    paint_body(
        pose[0],
        pose[1],
        shape,
        window.ray_xy,
        window.ray_slope,
        window.scale,
        rows,
        columns,
        planes,
    )
    dark = np.empty(planes.shape[1:], dtype=np.float32)
    paint_dark(pose[0], pose[1], shape, window.ray_xy, rows, columns, dark)
    shade_ice(planes, dark)
    if with_handle:
        turn_handle(planes, window, shape, pose)
    else:
        planes[HANDLE] = 0.0
    return planes


def turn_handle(planes: Planes, window: PixelWindow, shape: Floats, pose: Floats) -> None:
    """Paint the handle over a painted body, in place."""
    paint_handle(
        pose[0],
        pose[1],
        pose[2],
        shape,
        window.ray_xy,
        window.ray_slope,
        window.scale,
        *window.shape,
        planes[HANDLE],
    )


def coloured(planes: Planes, colours: Floats) -> Planes:
    """Return the stone's light and the ice's that it hides, (5, rows·FINE, columns·FINE)."""
    out = np.empty((5, *planes.shape[1:]), dtype=np.float32)
    colour_planes(planes, planes[HANDLE], colours.astype(np.float32), out)
    return out


def blurred(
    light: Planes,
    window: PixelWindow,
    shape: Floats,
    shift_px: tuple[float, float] = (0.0, 0.0),
    *,
    sloped: bool = False,
) -> Planes:
    """Tinted planes at the camera's resolution, (5, 3, rows, columns): values and slopes by
    shift.
    """
    rows, columns = window.shape
    out = np.empty((5, 3, rows, columns), dtype=np.float32)
    for planes, parameter in ((SHARP, BLUR_PX), (SOFT, COLOUR_BLUR_PX)):
        blur(light[planes], rows, columns, shape[parameter], *shift_px, sloped, out[planes])
    return out


def composite_change(seen: Planes, behind: Planes) -> Planes:
    """Return the change of the ice's picture by the stone, (3, rows, columns).

    Parameters
    ----------
    seen : (5, 3, rows, columns) output of `blurred`
    behind : (3, rows, columns) channels of the ice
    """
    added = seen[[0, 2, 3], 0] - behind * seen[[1, 4, 4], 0]
    return added.astype(np.float32, copy=False)


def shares(window: PixelWindow, shape: Floats, pose: Floats, *, with_handle: bool) -> Planes:
    """Return the share of each pixel that every part covers, and the light that its ice loses.

    Returns
    -------
    (2, rows·columns, 7) first as brightness is blurred, then as colour is: the parts, the light
    that the ice loses, and the light from one side
    """
    rows, columns = window.shape
    planes = painted(window, shape, pose, with_handle=with_handle)
    planes[[FOOT, SIDE, BEVEL, TOP, SHADE, LIT]] *= 1 - planes[HANDLE]
    out = np.empty((2, rows * columns, PLANES), dtype=np.float32)
    seen = np.empty((PLANES, 3, rows, columns), dtype=np.float32)
    for channel, parameter in enumerate((BLUR_PX, COLOUR_BLUR_PX)):
        blur(planes, rows, columns, shape[parameter], 0.0, 0.0, False, seen)
        out[channel] = seen[:, 0].reshape(PLANES, -1).T
    return out
