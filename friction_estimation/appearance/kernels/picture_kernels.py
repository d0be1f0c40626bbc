"""Compiled operations on painted stones: colouring and blur."""

from __future__ import annotations

import math

import numpy as np

from curling_env.physics.compiled import compiled
from friction_estimation.appearance.shape import (
    BEVEL,
    FINE,
    FOOT,
    HANDLE,
    LIT,
    SHADE,
    SIDE,
    SUMS_IN_ANY_ORDER,
    TOP,
)

BLUR_REACH = 3.2
"""A point spread ends at this many standard deviations."""


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def colour_planes(planes, colours, coloured):
    """Fill in the light of a painted stone in every fine pixel, and the light of the ice that it
    hides.

    Parameters
    ----------
    planes : (7, height, width) the painted stone
    colours : (5, 3) colours of the parts
    coloured : (5, height, width), filled: the stone's brightness; the share of the ice's brightness
        that is lost behind it and in its shade; its two colour differences; the share of the ice's
        colour that is lost behind it
    """
    one = np.float32(1.0)
    for i in range(planes.shape[1]):
        foot, side, bevel, top = planes[FOOT, i], planes[SIDE, i], planes[BEVEL, i], planes[TOP, i]
        shade, grip, lit = planes[SHADE, i], planes[HANDLE, i], planes[LIT, i]
        lost, light = coloured[1, i], coloured[4, i]
        for j in range(planes.shape[2]):
            free = one - grip[j]
            cover = foot[j] + side[j] + bevel[j] + top[j]
            dark = np.float32((1.0 - cover) * shade[j])  # the difference in double precision
            lost[j] = free * (cover + dark) + grip[j]
            light[j] = free * cover + grip[j]
        for channel in range(3):
            out = coloured[channel + 1 if channel else 0, i]
            a, b, c = colours[0, channel], colours[1, channel], colours[2, channel]
            d, e = colours[3, channel], colours[4, channel]
            slanting = np.float32(0.0) if channel else b  # light changes brightness, not colour
            for j in range(planes.shape[2]):
                own = foot[j] * a + side[j] * b + bevel[j] * c + top[j] * d + slanting * lit[j]
                out[j] = (one - grip[j]) * own + grip[j] * e


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def blur(planes, rows, columns, sigma, shift_u, shift_v, sloped, out):
    """Fill in fine planes at the camera's resolution, moved by a shift.

    Parameters
    ----------
    planes : (p, rows·FINE, columns·FINE)
    sigma : standard deviation of the point spread [px]
    shift_u, shift_v : by how much the planes are moved [px]
    sloped : whether the derivatives are wanted
    out : (p, 3, rows, columns), filled: values and their derivatives by both shifts; only the
        values where `sloped` is false
    """
    # Four taps at a time keep the sums in registers; the last taps may have no weight.
    needed = 2 * math.ceil(BLUR_REACH * sigma * FINE) + 1
    taps = 4 * ((needed + 3) // 4)
    weights, slopes = np.zeros((2, taps), np.float32), np.zeros((2, taps), np.float32)
    first = np.empty(2, np.int64)
    for axis in range(2):  # all pixels have the same weights
        centre = 0.5 * FINE - 0.5 - (shift_v if axis == 0 else shift_u) * FINE
        first[axis] = math.floor(centre - 0.5 * (needed - 1))
        total = 0.0
        for q in range(needed):
            away = (first[axis] + q - centre) / (FINE * sigma)
            total += math.exp(-0.5 * away * away)
        for q in range(needed):
            away = (first[axis] + q - centre) / (FINE * sigma)
            weights[axis, q] = math.exp(-0.5 * away * away) / total
            slopes[axis, q] = -weights[axis, q] * away / sigma
    height, width = rows * FINE, columns * FINE
    # Columns are blurred first. Fine pixels of one phase then lie side by side, so that all sums
    # run along memory.
    span = columns + taps // FINE + 1
    lines, phases = np.empty((2, width), np.float32), np.empty((2, FINE, span), np.float32)
    for p in range(planes.shape[0]):
        for row in range(rows):
            lines[:] = 0.0
            plain, upright = lines[0], lines[1]
            for q in range(0, taps, 4):
                top = row * FINE + first[0] + q
                s0 = planes[p, min(max(top, 0), height - 1)]
                s1 = planes[p, min(max(top + 1, 0), height - 1)]
                s2 = planes[p, min(max(top + 2, 0), height - 1)]
                s3 = planes[p, min(max(top + 3, 0), height - 1)]
                w0, w1 = weights[0, q], weights[0, q + 1]
                w2, w3 = weights[0, q + 2], weights[0, q + 3]
                for j in range(width):
                    plain[j] += w0 * s0[j] + w1 * s1[j] + w2 * s2[j] + w3 * s3[j]
                if sloped:
                    w0, w1 = slopes[0, q], slopes[0, q + 1]
                    w2, w3 = slopes[0, q + 2], slopes[0, q + 3]
                    for j in range(width):
                        upright[j] += w0 * s0[j] + w1 * s1[j] + w2 * s2[j] + w3 * s3[j]
            for d in range(2 if sloped else 1):
                line = lines[d]
                for f in range(FINE):
                    phase, start = phases[d, f], first[1] + f
                    inner = min(max(-(start // FINE), 0), span)
                    outer = max(min((width - 1 - start) // FINE + 1, span), inner)
                    for m in range(inner):
                        phase[m] = line[0]
                    part = line[start + inner * FINE :]
                    for m in range(outer - inner):
                        phase[inner + m] = part[m * FINE]
                    for m in range(outer, span):
                        phase[m] = line[width - 1]
            for d in range(3 if sloped else 1):
                total = out[p, d, row]
                total[:] = 0.0
                own = slopes[1] if d == 1 else weights[1]
                even, odd = phases[1 if d == 2 else 0, 0], phases[1 if d == 2 else 0, 1]
                for q in range(0, taps, 4):
                    m = q // FINE
                    e0, e1 = even[m : m + columns], even[m + 1 : m + 1 + columns]
                    o0, o1 = odd[m : m + columns], odd[m + 1 : m + 1 + columns]
                    w0, w1, w2, w3 = own[q], own[q + 1], own[q + 2], own[q + 3]
                    for column in range(columns):
                        total[column] += (
                            w0 * e0[column] + w1 * o0[column] + w2 * e1[column] + w3 * o1[column]
                        )
