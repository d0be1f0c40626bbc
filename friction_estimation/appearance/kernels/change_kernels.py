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
def change_of_light(
    pose, shape, body, shade, handle, colours, blurs, ray_xy, ray_slope, scale, planes, light, seen
):
    """Fill in the change of the light of a stone by another shape or heading.

    Only the parts that depend on it are painted again. Colouring and blurring are linear, so the
    change is blurred and not the picture.

    Parameters
    ----------
    pose, shape : changed pose (3,), and changed `StoneModel.values`
    body, shade, handle : whether each depends on the change
    colours : (5, 3) colours of the parts
    blurs : standard deviations of the point spread in brightness and in colour [px]
    ray_xy, ray_slope, scale : rays of a `PixelWindow`
    planes, light : the stone before the change, painted and coloured
    seen : (5, 3, rows, columns), of which the values are filled
    """
    rows, columns = seen.shape[2:]
    again, change = planes.copy(), np.empty_like(light)
    if body:
        paint_body(pose[0], pose[1], shape, ray_xy, ray_slope, scale, rows, columns, again)
    if shade:
        paint_shade(pose[0], pose[1], shape, ray_xy, rows, columns, again[SHADE])
    if handle:
        paint_handle(
            *(pose[0], pose[1], pose[2], shape, ray_xy, ray_slope, scale, rows, columns),
            again[HANDLE],
        )
    colour_planes(again, colours, change)
    for c in range(5):
        for i in range(light.shape[1]):
            row, before = change[c, i], light[c, i]
            for j in range(light.shape[2]):
                row[j] -= before[j]
    blur(change[:2], rows, columns, blurs[0], 0.0, 0.0, False, seen[:2])
    blur(change[2:], rows, columns, blurs[1], 0.0, 0.0, False, seen[2:])
