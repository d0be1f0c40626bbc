"""Compiled change of a stone's picture by one parameter of its shape, or by its heading."""

from __future__ import annotations

import numpy as np

from curling_env.physics.compiled import compiled
from friction_estimation.appearance.kernels.paint_kernels import (
    paint_body,
    paint_handle,
    paint_shade,
)
from friction_estimation.appearance.kernels.picture_kernels import blur, colour_planes
from friction_estimation.appearance.shape import HANDLE, SHADE, SUMS_IN_ANY_ORDER


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def change_of_picture(
    pose,
    shape,
    body,
    shade,
    handle,
    colours,
    blurs,
    ray_xy,
    ray_slope,
    scale,
    planes,
    light,
    behind,
    unit,
    change,
):
    """Fill in the change of a stone's picture by another shape or heading.

    Only the parts that depend on it are painted again. Colouring and blurring are linear, so the
    changed light is blurred and not the picture, and only where there is any.

    Parameters
    ----------
    pose, shape : changed pose (3,), and changed `StoneModel.values`
    body, shade, handle : whether each depends on the change
    colours : (5, 3) colours of the parts
    blurs : standard deviations of the point spread in brightness and in colour [px]
    ray_xy, ray_slope, scale : rays of a `PixelWindow`
    planes, light : the stone before the change, painted and coloured
    behind : (3, rows, columns) channels of the ice
    unit : (3,) the channels' units of the change
    change : (3, rows, columns), filled
    """
    rows, columns = behind.shape[1:]
    again, changed = planes.copy(), np.empty_like(light)
    if body:
        paint_body(pose[0], pose[1], shape, ray_xy, ray_slope, scale, rows, columns, again)
    if shade:
        paint_shade(pose[0], pose[1], shape, ray_xy, rows, columns, again[SHADE])
    if handle:
        paint_handle(
            *(pose[0], pose[1], pose[2], shape, ray_xy, ray_slope, scale, rows, columns),
            again[HANDLE],
        )
    colour_planes(again, colours, changed)
    seen = np.zeros((5, 3, rows, columns), np.float32)
    for c in range(5):
        total = np.float32(0.0)
        for i in range(light.shape[1]):
            row, before = changed[c, i], light[c, i]
            for j in range(light.shape[2]):
                row[j] -= before[j]
                total += abs(row[j])
        if total > 0.0:
            sigma = blurs[0] if c < 2 else blurs[1]
            blur(changed[c : c + 1], rows, columns, sigma, 0.0, 0.0, False, seen[c : c + 1])
    for channel in range(3):
        own, hidden = (channel + 1, 4) if channel else (0, 1)
        for i in range(rows):
            for j in range(columns):
                lost = behind[channel, i, j] * seen[hidden, 0, i, j]
                change[channel, i, j] = (seen[own, 0, i, j] - lost) / unit[channel]
