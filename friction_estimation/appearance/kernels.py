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


FOOT_LEVELS = 4
SIDE_LEVELS = 7
GRIP_LEVELS = 3
HANDLE_LEVELS = 5
BEVEL_LEVELS = 4
MIRROR_LEVELS = 5
PARTS = 5
NORMAL_MIRROR = 0.02
"""Share of upright light that water ice mirrors (Schlick's form of Fresnel's law)."""


MAX_ITERATIONS = 25
NEGLIGIBLE_STEP = 0.1
"""A step of less than this share of a standard error ends the fit."""
RELINEARISE_AT = 0.01
RELINEARISE_TURN = 0.1
"""Steps [m, rad] beyond which the slopes are computed anew."""
EDGE_REACH = 4.0
"""An edge's blur ends at this many standard deviations."""
_EDGE_STEPS = 128
"""Entries of the table per standard deviation: linear in between errs by less than 2e-6."""
_EDGE = np.array(
    [
        0.5 * math.erfc((i / _EDGE_STEPS - EDGE_REACH) * math.sqrt(0.5))
        for i in range(int(2 * EDGE_REACH) * _EDGE_STEPS + 2)
    ]
)


@compiled
def _filled(distance, blur):
    """Share of a blurred pixel inside an edge at a signed distance [px], negative inside."""
    scaled = distance / blur
    if scaled >= EDGE_REACH:
        return 0.0
    if scaled <= -EDGE_REACH:
        return 1.0
    at = (scaled + EDGE_REACH) * _EDGE_STEPS
    i = int(at)
    return _EDGE[i] + (at - i) * (_EDGE[i + 1] - _EDGE[i])


@compiled
def coverage(x, y, theta, shape, foot, lean, scale, with_handle, out):
    """How much of each pixel every part covers.

    Parameters
    ----------
    x, y, theta : place and heading of the stone, sheet frame [m, rad]
    shape : (26,) see `SHAPE_PARAMETERS`
    foot, lean, scale : of a `Window`
    with_handle : whether there is a handle
    out : (2, n, 6) filled with the visible share of foot, side, bevel, top and handle, and the
        share of light that the shadow takes: first as brightness is blurred, then as colour is.
        What the ice mirrors of the body counts as foot and side
    """
    radius, height, foot_inset, foot_height = shape[0], shape[1], shape[2], shape[3]
    bevel_height, bevel_inset = shape[4], shape[5]
    handle_z = height + shape[6]
    side_top = height - bevel_height
    roundness, foot_roundness = shape[18], shape[24]
    contact_from = radius - 0.5 * foot_inset
    levels = SIDE_LEVELS + BEVEL_LEVELS
    # per level: height, radius, and ice per pixel as a 2 × 2 matrix
    level = np.zeros((levels, 6))
    # share of the foot's or bevel's own colour, against the side's, in the strip above each level
    turned = np.zeros(levels)
    for k in range(levels):
        if k < FOOT_LEVELS:
            share = k / FOOT_LEVELS
            # denser at the ice, where a rounded outline turns inwards fastest
            share = share * (0.5 + 0.5 * share)
            above = (k + 1) / FOOT_LEVELS
            middle = 0.5 * (share + above * (0.5 + 0.5 * above))
            # The outline's slope, and with it the light on it, goes with this power.
            turned[k] = (1 - middle) ** (foot_roundness - 1)
            z, r = foot_height * share, radius - foot_inset * (1 - share) ** foot_roundness
        elif k < SIDE_LEVELS:
            share = (k - FOOT_LEVELS) / (SIDE_LEVELS - 1 - FOOT_LEVELS)
            z, r = foot_height + (side_top - foot_height) * share, radius
        else:
            share = (k - SIDE_LEVELS + 1) / BEVEL_LEVELS
            below = (k - SIDE_LEVELS) / BEVEL_LEVELS
            share = share * (1.5 - 0.5 * share)
            middle = 0.5 * (share + below * (1.5 - 0.5 * below))
            turned[k - 1] = middle ** (roundness - 1)
            z = side_top + bevel_height * share
            r = radius - bevel_inset * share**roundness
        level[k, 0], level[k, 1] = z, r
        level[k, 2] = scale[0, 0, 0] + z * scale[1, 0, 0]
        level[k, 3] = scale[0, 0, 1] + z * scale[1, 0, 1]
        level[k, 4] = scale[0, 1, 0] + z * scale[1, 1, 0]
        level[k, 5] = scale[0, 1, 1] + z * scale[1, 1, 1]
    cosine, sine = math.cos(theta), math.sin(theta)
    # per bar: height, steps of a pixel along and across it, and where it ends: a grip on a neck
    bars = np.empty((HANDLE_LEVELS, 4))
    for k in range(HANDLE_LEVELS):
        z, bars[k, 3] = handle_z - shape[17] * k / (GRIP_LEVELS - 1), shape[8]
        if k >= GRIP_LEVELS:
            share = (k - GRIP_LEVELS + 0.5) / (HANDLE_LEVELS - GRIP_LEVELS)
            z, bars[k, 3] = height + max(shape[6] - shape[17], 0.0) * share, shape[7] + shape[25]
        h00 = scale[0, 0, 0] + z * scale[1, 0, 0]
        h01 = scale[0, 0, 1] + z * scale[1, 0, 1]
        h10 = scale[0, 1, 0] + z * scale[1, 1, 0]
        h11 = scale[0, 1, 1] + z * scale[1, 1, 1]
        bars[k, 0] = z
        bars[k, 1] = math.hypot(cosine * h00 + sine * h10, cosine * h01 + sine * h11)
        bars[k, 2] = math.hypot(-sine * h00 + cosine * h10, -sine * h01 + cosine * h11)
    # The handle's lower edge leans away by its depth times the steepest line of sight.
    slant = 0.0
    for i in range(foot.shape[0]):
        slant = max(slant, abs(lean[i, 0]) + abs(lean[i, 1]))
    widest = np.abs(scale[0]).max() + handle_z * np.abs(scale[1]).max()
    handle_reach = (
        max(abs(shape[7]), abs(shape[8]), shape[22] + shape[6] * slant)
        + 0.5 * shape[9]
        + shape[17] * slant
        + 2 * EDGE_REACH * max(shape[10], shape[11]) * widest
    )
    within = np.empty(levels)
    for i in range(foot.shape[0]):
        body = 1e9
        for k in range(levels - 1, -1, -1):
            dx = foot[i, 0] + level[k, 0] * lean[i, 0] - x
            dy = foot[i, 1] + level[k, 0] * lean[i, 1] - y
            squared = dx * dx + dy * dy + 1e-18
            gu = dx * level[k, 2] + dy * level[k, 4]
            gv = dx * level[k, 3] + dy * level[k, 5]
            # (rho - radius) over the ice that a pixel covers along the radius
            distance = (squared - level[k, 1] * math.sqrt(squared)) / math.sqrt(gu * gu + gv * gv)
            body = min(body, distance)
            within[k] = body  # of this level and all above, which hide what is below
        image, mirrored = 1e9, 0.0
        if shape[21] > 0.0:
            for m in range(MIRROR_LEVELS):
                k = m * (levels - 1) // (MIRROR_LEVELS - 1)
                dx = foot[i, 0] - level[k, 0] * lean[i, 0] - x
                dy = foot[i, 1] - level[k, 0] * lean[i, 1] - y
                squared = dx * dx + dy * dy + 1e-18
                gu = dx * level[k, 2] + dy * level[k, 4]
                gv = dx * level[k, 3] + dy * level[k, 5]
                distance = squared - level[k, 1] * math.sqrt(squared)
                image = min(image, distance / math.sqrt(gu * gu + gv * gv))
            sine_up = 1.0 / math.sqrt(1.0 + lean[i, 0] ** 2 + lean[i, 1] ** 2)
            mirrored = shape[21] * (NORMAL_MIRROR + (1.0 - NORMAL_MIRROR) * (1.0 - sine_up) ** 5)
        dx = foot[i, 0] - x
        dy = foot[i, 1] - y
        gap = max(math.sqrt(dx * dx + dy * dy) - contact_from, 0.0) / shape[20]
        contact = 0.0
        if gap < 3.0:
            contact = shape[19] * math.exp(-gap * gap)
        dx = foot[i, 0] - x - shape[12]
        dy = foot[i, 1] - y - shape[13]
        rho = math.sqrt(dx * dx + dy * dy) + 1e-9
        gu = (dx * scale[0, 0, 0] + dy * scale[0, 1, 0]) / rho
        gv = (dx * scale[0, 0, 1] + dy * scale[0, 1, 1]) / rho
        slope = math.sqrt(gu * gu + gv * gv)
        shadow = (rho - shape[14]) / slope
        softness = shape[15] / slope
        ax = foot[i, 0] + handle_z * lean[i, 0] - x
        ay = foot[i, 1] + handle_z * lean[i, 1] - y
        near = with_handle and ax * ax + ay * ay < handle_reach * handle_reach
        collar = 1e9
        if near:
            for k in range(2):
                z = height + k * shape[23]
                dx = foot[i, 0] + z * lean[i, 0] - x
                dy = foot[i, 1] + z * lean[i, 1] - y
                squared = dx * dx + dy * dy + 1e-18
                gu = dx * (scale[0, 0, 0] + z * scale[1, 0, 0])
                gu += dy * (scale[0, 1, 0] + z * scale[1, 1, 0])
                gv = dx * (scale[0, 0, 1] + z * scale[1, 0, 1])
                gv += dy * (scale[0, 1, 1] + z * scale[1, 1, 1])
                distance = squared - shape[22] * math.sqrt(squared)
                collar = min(collar, distance / math.sqrt(gu * gu + gv * gv))
        for channel in range(2):
            blur = shape[10 + channel]
            c_handle = 0.0
            if near:
                c_handle = _filled(collar, blur)
                for k in range(HANDLE_LEVELS):
                    ax = foot[i, 0] + bars[k, 0] * lean[i, 0] - x
                    ay = foot[i, 1] + bars[k, 0] * lean[i, 1] - y
                    along = cosine * ax + sine * ay
                    across = -sine * ax + cosine * ay
                    bar = _filled((shape[7] - along) / bars[k, 1], blur) - _filled(
                        (bars[k, 3] - along) / bars[k, 1], blur
                    )
                    if bar <= c_handle:
                        continue
                    width = _filled((-0.5 * shape[9] - across) / bars[k, 2], blur) - _filled(
                        (0.5 * shape[9] - across) / bars[k, 2], blur
                    )
                    c_handle = max(c_handle, bar * width)
            c_body = _filled(body, blur)
            share_foot, share_side, share_bevel = 0.0, 0.0, 0.0
            inner = _filled(within[levels - 1], blur)
            share_top = inner
            for k in range(levels - 2, -1, -1):
                if inner >= c_body:
                    break
                outer = _filled(within[k], blur)
                if k >= SIDE_LEVELS - 1:
                    share_bevel += (outer - inner) * turned[k]
                    share_side += (outer - inner) * (1 - turned[k])
                else:
                    share_foot += (outer - inner) * turned[k]
                    share_side += (outer - inner) * (1 - turned[k])
                inner = outer
            c_image = 0.0
            if mirrored > 0.0:  # pebble spreads the mirror image
                c_image = mirrored * _filled(image, 1.5 * blur) * (1 - c_body)
            free = 1 - c_handle
            out[channel, i, 0] = (share_foot + 0.5 * c_image) * free
            out[channel, i, 1] = (share_side + 0.5 * c_image) * free
            out[channel, i, 2] = share_bevel * free
            out[channel, i, 3] = share_top * free
            out[channel, i, 4] = c_handle
            cast = shape[16] * _filled(shadow, math.sqrt(blur * blur + softness * softness))
            out[channel, i, 5] = 1 - (1 - cast) * (1 - contact)


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
    cover = np.empty((2, n, PARTS + 1))
    moved = np.empty((2, n, PARTS + 1))
    normal = np.zeros((3, 3))
    right = np.zeros(3)
    residual = np.empty(3)
    slopes = np.empty((n, 3, 3))
    trial = np.empty(3)
    scaled = np.eye(size)
    squares, weights = 0.0, 0.0
    stone_pixels, seen_pixels = 0.0, 0.0
    linearised = False
    step = np.zeros(size)
    for _ in range(MAX_ITERATIONS):
        coverage(pose[0], pose[1], pose[2], shape, foot, lean, scale, has_handle, cover)
        # Slopes hold for a small step: only a long one is worth the price of new ones.
        if (
            not linearised
            or math.hypot(step[0], step[1]) > RELINEARISE_AT
            or (size == 3 and abs(step[2]) > RELINEARISE_TURN)
        ):
            for p in range(size):
                trial[:] = pose
                trial[p] += steps[p]
                coverage(trial[0], trial[1], trial[2], shape, foot, lean, scale, has_handle, moved)
                for i in range(n):
                    for channel in range(3):
                        blur = 0 if channel == 0 else 1
                        ice = behind[i, channel]
                        slope = 0.0
                        for k in range(PARTS):
                            change = moved[blur, i, k] - cover[blur, i, k]
                            slope += change * (colours[k, channel] - ice)
                        if channel == 0:
                            bare = 1.0
                            for k in range(PARTS):
                                bare -= moved[0, i, k]
                                gone = cover[0, i, k] - moved[0, i, k]
                                slope += cover[0, i, PARTS] * ice * gone
                            slope -= (moved[0, i, PARTS] - cover[0, i, PARTS]) * ice * bare
                        slopes[i, p, channel] = slope / (steps[p] * noise[channel])
            linearised = True
        normal[:] = 0.0
        right[:] = 0.0
        squares, weights = 0.0, 0.0
        stone_pixels, seen_pixels = 0.0, 0.0
        for i in range(n):
            total = 0.0
            for channel in range(3):
                blur = 0 if channel == 0 else 1
                ice = behind[i, channel]
                if channel == 0:  # a shadow takes light, not colour
                    ice *= 1 - cover[0, i, PARTS]
                value = ice
                for k in range(PARTS):
                    value += cover[blur, i, k] * (colours[k, channel] - ice)
                residual[channel] = (picture[i, channel] - value) / noise[channel]
                total += residual[channel] ** 2
            weight = 1.0 / (1.0 + total / (3.0 * outlier_at**2)) ** 2
            squares += weight * total / 3.0
            weights += weight
            covered = cover[0, i, 0] + cover[0, i, 1] + cover[0, i, 2] + cover[0, i, 3]
            stone_pixels += covered
            seen_pixels += covered * weight
            for p in range(size):
                for channel in range(3):
                    right[p] += weight * slopes[i, p, channel] * residual[channel]
                    for q in range(p + 1):
                        normal[p, q] += weight * slopes[i, p, channel] * slopes[i, q, channel]
        for p in range(size):
            for q in range(p):
                normal[q, p] = normal[p, q]
        scaled = normal[:size, :size].copy()
        for p in range(size):
            scaled[p, p] = scaled[p, p] * 1.0001 + 1e-6
        step = np.linalg.solve(scaled, right[:size])
        gain = 0.0  # of the step, in squared standard errors
        for p in range(size):
            gain += step[p] * right[p]
        # A step larger than a handful of centimetres leaves the range of the linearisation.
        length = math.hypot(step[0], step[1])
        shrink = min(1.0, 0.08 / (length + 1e-12))
        if size == 3:
            shrink = min(shrink, 0.3 / (abs(step[2]) + 1e-12))
        for p in range(size):
            step[p] *= shrink
            pose[p] += step[p]
        if gain < NEGLIGIBLE_STEP**2 * size:
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
