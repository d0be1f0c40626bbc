"""Compiled arithmetic of the stone's picture.

All of it stands in one file, because numba notices a change only in the file it compiled.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingTypeStubs]

compiled = njit(cache=True, nogil=True, error_model="numpy")


@compiled
def sight_lines(u0, v0, rows, columns, matrix, distortion, rotation, position, foot, lean):
    """Fill `foot` and `lean` of a window; the lens is inverted by Newton's method."""
    fx, skew, cx = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    fy, cy = matrix[1, 1], matrix[1, 2]
    k1, k2, p1, p2, k3 = distortion[0], distortion[1], distortion[2], distortion[3], distortion[4]
    x, y = 0.0, 0.0
    for row in range(rows):
        yd = (v0 + row - cy) / fy
        for column in range(columns):
            xd = (u0 + column - cx - skew * yd) / fx
            if column == 0:
                x, y = xd, yd
            for _ in range(12):
                r2 = x * x + y * y
                radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
                slope = k1 + r2 * (2 * k2 + 3 * r2 * k3)
                ex = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) - xd
                ey = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y - yd
                if ex * ex + ey * ey < 1e-20:
                    break
                a = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x
                b = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
                d = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x
                det = a * d - b * b
                x -= (d * ex - b * ey) / det
                y -= (a * ey - b * ex) / det
            gx = rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0]
            gy = rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1]
            gz = rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2]
            i = row * columns + column
            lean[i, 0], lean[i, 1] = gx / gz, gy / gz
            foot[i, 0] = position[0] - position[2] * gx / gz
            foot[i, 1] = position[1] - position[2] * gy / gz


FOOT_LEVELS = 3
SIDE_LEVELS = 7
HANDLE_LEVELS = 4
BEVEL_LEVELS = 3


@compiled
def _filled(distance, blur):
    """Share of a blurred pixel inside an edge at a signed distance [px], negative inside."""
    scaled = distance / blur
    if scaled > 4.0:
        return 0.0
    if scaled < -4.0:
        return 1.0
    return 0.5 * math.erfc(scaled * 0.7071067811865476)


@compiled
def coverage(x, y, theta, shape, foot, lean, scale, with_handle, out):
    """How much of each pixel every part covers.

    Parameters
    ----------
    x, y, theta : place and heading of the stone, sheet frame [m, rad]
    shape : (18,) see `SHAPE_PARAMETERS`
    foot, lean, scale : of a `Window`
    with_handle : whether there is a handle
    out : (2, n, 5) filled with the visible share of side, bevel, top and handle, and the share of
        light that the shadow takes: first as brightness is blurred, then as colour is
    """
    radius, height, foot_inset, foot_height = shape[0], shape[1], shape[2], shape[3]
    bevel_height, bevel_inset = shape[4], shape[5]
    handle_z = height + shape[6]
    side_top = height - bevel_height
    levels = SIDE_LEVELS + BEVEL_LEVELS
    # per level: height, radius, and ice per pixel as a 2 × 2 matrix
    level = np.zeros((levels, 6))
    for k in range(levels):
        if k < FOOT_LEVELS:
            share = k / FOOT_LEVELS
            z, r = foot_height * share, radius - foot_inset * (1 - share)
        elif k < SIDE_LEVELS:
            share = (k - FOOT_LEVELS) / (SIDE_LEVELS - 1 - FOOT_LEVELS)
            z, r = foot_height + (side_top - foot_height) * share, radius
        else:
            share = (k - SIDE_LEVELS + 1) / BEVEL_LEVELS
            z = side_top + bevel_height * share
            r = radius - bevel_inset * share
        level[k, 0], level[k, 1] = z, r
        level[k, 2] = scale[0, 0, 0] + z * scale[1, 0, 0]
        level[k, 3] = scale[0, 0, 1] + z * scale[1, 0, 1]
        level[k, 4] = scale[0, 1, 0] + z * scale[1, 1, 0]
        level[k, 5] = scale[0, 1, 1] + z * scale[1, 1, 1]
    cosine, sine = math.cos(theta), math.sin(theta)
    bars = np.empty((HANDLE_LEVELS, 3))
    for k in range(HANDLE_LEVELS):
        z = handle_z - shape[17] * k / (HANDLE_LEVELS - 1)
        h00 = scale[0, 0, 0] + z * scale[1, 0, 0]
        h01 = scale[0, 0, 1] + z * scale[1, 0, 1]
        h10 = scale[0, 1, 0] + z * scale[1, 1, 0]
        h11 = scale[0, 1, 1] + z * scale[1, 1, 1]
        bars[k, 0] = z
        bars[k, 1] = math.hypot(cosine * h00 + sine * h10, cosine * h01 + sine * h11)
        bars[k, 2] = math.hypot(-sine * h00 + cosine * h10, -sine * h01 + cosine * h11)
    for i in range(foot.shape[0]):
        side, bevel, top = 1e9, 1e9, 1e9
        for k in range(levels):
            dx = foot[i, 0] + level[k, 0] * lean[i, 0] - x
            dy = foot[i, 1] + level[k, 0] * lean[i, 1] - y
            rho = math.sqrt(dx * dx + dy * dy) + 1e-9
            nx, ny = dx / rho, dy / rho
            gu = nx * level[k, 2] + ny * level[k, 4]
            gv = nx * level[k, 3] + ny * level[k, 5]
            distance = (rho - level[k, 1]) / math.sqrt(gu * gu + gv * gv)
            if k < SIDE_LEVELS:
                side = min(side, distance)
                if k == SIDE_LEVELS - 1:
                    bevel = distance
            else:
                bevel = min(bevel, distance)
                top = distance
        body = min(side, bevel)
        dx = foot[i, 0] - x - shape[12]
        dy = foot[i, 1] - y - shape[13]
        rho = math.sqrt(dx * dx + dy * dy) + 1e-9
        gu = (dx * scale[0, 0, 0] + dy * scale[0, 1, 0]) / rho
        gv = (dx * scale[0, 0, 1] + dy * scale[0, 1, 1]) / rho
        slope = math.sqrt(gu * gu + gv * gv)
        shadow = (rho - shape[14]) / slope
        softness = shape[15] / slope
        for channel in range(2):
            blur = shape[10 + channel]
            c_handle = 0.0
            if with_handle:
                for k in range(HANDLE_LEVELS):
                    ax = foot[i, 0] + bars[k, 0] * lean[i, 0] - x
                    ay = foot[i, 1] + bars[k, 0] * lean[i, 1] - y
                    along = cosine * ax + sine * ay
                    across = -sine * ax + cosine * ay
                    bar = _filled((shape[7] - along) / bars[k, 1], blur) - _filled(
                        (shape[8] - along) / bars[k, 1], blur
                    )
                    if bar <= c_handle:
                        continue
                    width = _filled((-0.5 * shape[9] - across) / bars[k, 2], blur) - _filled(
                        (0.5 * shape[9] - across) / bars[k, 2], blur
                    )
                    c_handle = max(c_handle, bar * width)
            c_body = _filled(body, blur)
            c_bevel = min(_filled(bevel, blur), c_body)
            c_top = min(_filled(top, blur), c_bevel)
            out[channel, i, 0] = (c_body - c_bevel) * (1 - c_handle)
            out[channel, i, 1] = (c_bevel - c_top) * (1 - c_handle)
            out[channel, i, 2] = c_top * (1 - c_handle)
            out[channel, i, 3] = c_handle
            out[channel, i, 4] = shape[16] * _filled(
                shadow, math.sqrt(blur * blur + softness * softness)
            )


@compiled
def gauss_newton(
    picture,
    behind,
    foot,
    lean,
    scale,
    shape,
    colours,
    noise,
    has_handle,
    outlier_at,
    pose,
    covariance,
    quality,
):
    """Minimise the robust misfit over `pose`, and fill `covariance` and `quality`."""
    n = picture.shape[0]
    size = 3 if has_handle else 2
    steps = np.array([1e-3, 1e-3, 1e-2])
    cover = np.empty((2, n, 5))
    moved = np.empty((3, 2, n, 5))
    normal = np.zeros((3, 3))
    right = np.zeros(3)
    residual = np.empty(3)
    slopes = np.empty((3, 3))
    trial = np.empty(3)
    squares, weights = 0.0, 0.0
    stone_pixels, seen_pixels = 0.0, 0.0
    for _ in range(25):
        coverage(pose[0], pose[1], pose[2], shape, foot, lean, scale, has_handle, cover)
        for p in range(size):
            trial[:] = pose
            trial[p] += steps[p]
            coverage(trial[0], trial[1], trial[2], shape, foot, lean, scale, has_handle, moved[p])
        normal[:] = 0.0
        right[:] = 0.0
        squares, weights = 0.0, 0.0
        stone_pixels, seen_pixels = 0.0, 0.0
        for i in range(n):
            total = 0.0
            for channel in range(3):
                blur = 0 if channel == 0 else 1
                ice = behind[i, channel] * (1 - cover[blur, i, 4])
                if channel > 0:  # a shadow takes light, not colour
                    ice = behind[i, channel]
                value = ice
                for k in range(4):
                    value += cover[blur, i, k] * (colours[k, channel] - ice)
                residual[channel] = (picture[i, channel] - value) / noise[channel]
                total += residual[channel] ** 2
                for p in range(size):
                    ice = behind[i, channel]
                    if channel == 0:
                        ice *= 1 - moved[p, blur, i, 4]
                    slope = ice - value
                    for k in range(4):
                        slope += moved[p, blur, i, k] * (colours[k, channel] - ice)
                    slopes[p, channel] = slope / (steps[p] * noise[channel])
            weight = 1.0 / (1.0 + total / (3.0 * outlier_at**2)) ** 2
            squares += weight * total / 3.0
            weights += weight
            covered = cover[0, i, 0] + cover[0, i, 1] + cover[0, i, 2] + cover[0, i, 3]
            stone_pixels += covered
            seen_pixels += covered * weight
            for p in range(size):
                for channel in range(3):
                    right[p] += weight * slopes[p, channel] * residual[channel]
                    for q in range(p + 1):
                        normal[p, q] += weight * slopes[p, channel] * slopes[q, channel]
        for p in range(size):
            for q in range(p):
                normal[q, p] = normal[p, q]
        scaled = normal[:size, :size].copy()
        for p in range(size):
            scaled[p, p] = scaled[p, p] * 1.0001 + 1e-6
        step = np.linalg.solve(scaled, right[:size])
        # A step larger than a handful of centimetres leaves the range of the linearisation.
        length = np.hypot(step[0], step[1])
        shrink = min(1.0, 0.08 / (length + 1e-12))
        if size == 3:
            shrink = min(shrink, 0.3 / (abs(step[2]) + 1e-12))
        for p in range(size):
            pose[p] += shrink * step[p]
        if length < 1e-5 and (size == 2 or abs(step[2]) < 1e-4):
            break
    covariance[:] = 0.0
    covariance[2, 2] = np.inf
    inverse = np.linalg.inv(scaled)
    spread = max(squares / max(weights, 1.0), 0.01)
    for p in range(size):
        for q in range(size):
            covariance[p, q] = inverse[p, q] * spread
    quality[0] = np.sqrt(squares / max(weights, 1e-9))
    quality[1] = seen_pixels / max(stone_pixels, 1e-9)


@compiled
def normal_equations(jacobian, residual, weight, normal, right):
    """Add a weighted least-squares problem, (n, m), to its normal equations.

    Written out, because a threaded library call on such slim matrices mostly waits for its threads.
    """
    n, m = jacobian.shape
    for i in range(n):
        for p in range(m):
            scaled = weight[i] * jacobian[i, p]
            if scaled == 0.0:
                continue
            right[p] += scaled * residual[i]
            for q in range(m):
                normal[p, q] += scaled * jacobian[i, q]
