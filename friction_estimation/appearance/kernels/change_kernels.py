"""Compiled derivatives of a stone's picture by the parameters of its shape and by its heading.

One parameter after the other is changed. Only the parts that depend on it are painted again, and
only changed light is blurred: colouring and blurring are linear, so that the change is blurred and
not the picture.
"""

from __future__ import annotations

import math

import numpy as np

from curling_env.physics.compiled import compiled
from friction_estimation.appearance.kernels.paint_kernels import (
    paint_body,
    paint_dark,
    paint_handle,
    shade_ice,
)
from friction_estimation.appearance.kernels.picture_kernels import BLUR_REACH, blur, colour_planes
from friction_estimation.appearance.shape import (
    BEVEL,
    BLUR_PX,
    COLOUR_BLUR_PX,
    FINE,
    FOOT,
    FOOT_INSET,
    HANDLE,
    SIDE,
    SUMS_IN_ANY_ORDER,
    TOP,
)

BODY, LIGHT, DARK, GRIP, BLUR = range(5)
"""Targets of a step: the body, the light on it from one side, the light that the ice loses, the
handle, or the blur."""


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def picture_changes(
    pose,
    shape,
    colours,
    steps,
    kinds,
    ray_xy,
    ray_slope,
    scale,
    planes,
    light,
    seen,
    behind,
    noise,
    places,
    changes,
):
    """Fill in how a stone's picture changes with its shape and heading.

    Parameters
    ----------
    pose : (3,) x, y [m] and heading [rad]
    shape : (29,) see `shape.SHAPE_PARAMETERS`
    colours : (5, 3) colours of the parts
    steps : (n, 30) steps of the shape, and last of the heading; in each one entry is not zero
    kinds : (n,) what each step changes
    ray_xy, ray_slope, scale : rays of a `PixelWindow`
    planes : (7, rows·FINE, columns·FINE) the painted stone
    light : (5, rows·FINE, columns·FINE) the same coloured, see `colour_planes`
    seen : (5, 3, rows, columns) the same blurred, see `blur`
    behind : (3, rows, columns) channels of the ice
    noise : (3,) standard deviation of each channel
    places : (n,) where each change goes
    changes : (m, 3, rows, columns), of which n are filled: change per unit [standard deviations]
    """
    one, rows, columns = np.float32(1.0), behind.shape[1], behind.shape[2]
    x, y, theta = pose[0], pose[1], pose[2]
    size = (rows * FINE, columns * FINE)
    handle, none = planes[HANDLE], np.zeros(size, np.float32)
    dark, other = np.empty(size, np.float32), np.empty(size, np.float32)
    body, change = np.empty_like(light), np.empty_like(light)
    again, softer = np.empty_like(planes), np.empty((5, 3, rows, columns), np.float32)
    colour_planes(planes, none, colours, body)
    paint_dark(x, y, shape, ray_xy, rows, columns, dark)
    grip = np.ones(5, np.float32)
    grip[0], grip[2], grip[3] = colours[HANDLE, 0], colours[HANDLE, 1], colours[HANDLE, 2]
    for p in range(len(steps)):
        moved, turn, step = shape + steps[p, :-1], steps[p, -1], steps[p].sum()
        out = changes[places[p]]
        out[:] = 0.0
        if kinds[p] == BLUR:
            first, last, at = 0, 2, BLUR_PX
            if steps[p, COLOUR_BLUR_PX] != 0.0:
                first, last, at = 2, 5, COLOUR_BLUR_PX
            blur(light[first:last], rows, columns, moved[at], 0.0, 0.0, False, softer[first:last])
            for c in range(first, last):
                softer[c, 0] -= seen[c, 0]
            _compose(softer, first, last, behind, noise, step, 0, 0, out)
            continue
        first, last = 0, 5
        if kinds[p] == GRIP:  # the handle's light replaces the body's
            turned = theta + turn
            paint_handle(x, y, turned, moved, ray_xy, ray_slope, scale, rows, columns, other)
            for c in range(5):
                for i in range(size[0]):
                    now, then, own, row = other[i], handle[i], body[c, i], change[c, i]
                    for j in range(size[1]):
                        row[j] = (now[j] - then[j]) * (grip[c] - own[j])
        elif kinds[p] == DARK:  # only beside the stone, and only brightness
            first, last = 1, 2
            paint_dark(x, y, moved, ray_xy, rows, columns, other)
            for i in range(size[0]):
                foot, side, bevel = planes[FOOT, i], planes[SIDE, i], planes[BEVEL, i]
                top, now, then, held = planes[TOP, i], other[i], dark[i], handle[i]
                row = change[1, i]
                for j in range(size[1]):
                    bare = (one - held[j]) * (one - (foot[j] + side[j] + bevel[j] + top[j]))
                    row[j] = bare * (now[j] - then[j])
        else:
            last = 1 if kinds[p] == LIGHT else 5
            paint_body(x, y, moved, ray_xy, ray_slope, scale, rows, columns, again)
            if steps[p, FOOT_INSET] != 0.0:  # contact shade begins below the foot
                paint_dark(x, y, moved, ray_xy, rows, columns, other)
                shade_ice(again, other)
            else:
                shade_ice(again, dark)
            colour_planes(again, none, colours, change)
            for c in range(last):
                for i in range(size[0]):
                    held, then, row = handle[i], body[c, i], change[c, i]
                    for j in range(size[1]):
                        row[j] = (one - held[j]) * (row[j] - then[j])
        _add_blurred(change, first, last, shape, behind, noise, step, out)


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def _add_blurred(light, first, last, shape, behind, noise, step, change):
    """Fill in how the picture changes where the light of a stone changes.

    Parameters
    ----------
    light : (5, rows·FINE, columns·FINE) of which planes from `first` to before `last` change
    change : (3, rows, columns) zeros
    """
    tall, wide = np.zeros(light.shape[1], np.float32), np.zeros(light.shape[2], np.float32)
    for c in range(first, last):
        for i in range(light.shape[1]):
            row, total = light[c, i], np.float32(0.0)
            for j in range(light.shape[2]):
                total += abs(row[j])
                wide[j] += abs(row[j])
            tall[i] += total
    changed, across = np.flatnonzero(tall), np.flatnonzero(wide)
    if len(changed) == 0:
        return
    top, bottom, left, right = changed[0], changed[-1], across[0], across[-1]
    reach = math.ceil(BLUR_REACH * max(shape[BLUR_PX], shape[COLOUR_BLUR_PX])) + 2
    top, bottom = max(top // FINE - reach, 0), min(bottom // FINE + reach + 1, behind.shape[1])
    left, right = max(left // FINE - reach, 0), min(right // FINE + reach + 1, behind.shape[2])
    rows, columns = bottom - top, right - left
    part = np.empty((5, rows * FINE, columns * FINE), np.float32)
    for c in range(first, last):
        for i in range(rows * FINE):
            for j in range(columns * FINE):
                part[c, i, j] = light[c, top * FINE + i, left * FINE + j]
    seen = np.zeros((5, 3, rows, columns), np.float32)
    end = min(last, 2)
    blur(part[first:end], rows, columns, shape[BLUR_PX], 0.0, 0.0, False, seen[first:end])
    if last == 5:
        blur(part[2:5], rows, columns, shape[COLOUR_BLUR_PX], 0.0, 0.0, False, seen[2:5])
    _compose(seen, first, last, behind, noise, step, top, left, change)


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def _compose(seen, first, last, behind, noise, step, top, left, change):
    """Fill in the change of the picture from that of the blurred planes `first` to before `last`.

    Parameters
    ----------
    seen : (5, 3, rows, columns) a part of the window, whose upper left pixel is at (top, left)
    """
    for channel in range(1 if first == 2 else 0, 3 if last == 5 else 1):
        own, hidden = channel + 1 if channel else 0, 4 if channel else 1
        unit = 1.0 / (step * noise[channel])
        for i in range(seen.shape[2]):
            for j in range(seen.shape[3]):
                more = 0.0
                if first <= own < last:
                    more += seen[own, 0, i, j]
                if first <= hidden < last:
                    more -= behind[channel, top + i, left + j] * seen[hidden, 0, i, j]
                change[channel, top + i, left + j] = unit * more
