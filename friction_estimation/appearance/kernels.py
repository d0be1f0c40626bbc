"""Compiled arithmetic of the stone's picture.

All of it stands in one file, because numba notices a change only in the file it compiled.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingTypeStubs]

compiled = njit(
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"reassoc", "nsz", "contract", "arcp"},  # sums may be taken in any order
)


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


FOOT_STRIPS = 5
BEVEL_STRIPS = 5
NODES = FOOT_STRIPS + BEVEL_STRIPS + 2
"""Circles that bound the cones of which the body is made: foot, side and bevel."""
GRIP_LEVELS = 4
NECK_LEVELS = 2
MIRROR_NODES = 5
FINE = 2
"""Into how many parts a pixel's side is cut when a stone is painted: with soft edges two err by
less than half a grey level on average, and four by no less."""
PARTS = 5
PLANES = PARTS + 1
"""Foot, side, bevel, top, handle; and the light that the ice has lost, where it is seen."""
NORMAL_MIRROR = 0.02
"""Share of upright light that water ice mirrors (Schlick's form of Fresnel's law)."""

MAX_ITERATIONS = 12
MAX_PAINTINGS = 8
NEGLIGIBLE_STEP = 0.1
"""A step of less than this share of a standard error ends the fit."""
REPAINT_AT_PX = 0.7
REPAINT_TURN = 0.15
"""Beyond these shifts [px] and turns [rad] a moved picture no longer is that of a moved stone."""
BLUR_REACH = 3.2
"""A point spread ends at this many standard deviations."""


@compiled
def _ramp(distance):
    """Share of a fine pixel inside an edge at a signed distance in fine pixels."""
    return min(max(0.5 - distance, 0.0), 1.0)


@compiled
def _outline(shape, nodes, turned):
    """Fill height and radius of the body's circles, and how far each is turned from upright."""
    radius, height, foot_inset, foot_height = shape[0], shape[1], shape[2], shape[3]
    bevel_height, bevel_inset = shape[4], shape[5]
    roundness, foot_roundness = shape[18], shape[24]
    # Foot and bevel are quarters of superellipses, cut at equal angles.
    for k in range(FOOT_STRIPS + 1):
        angle = 0.5 * math.pi * k / FOOT_STRIPS
        cosine, sine = max(math.cos(angle), 0.0), math.sin(angle)
        nodes[k, 0] = foot_height * (1 - cosine ** (2 / foot_roundness))
        nodes[k, 1] = radius - foot_inset * (1 - sine ** (2 / foot_roundness))
    for k in range(BEVEL_STRIPS + 1):
        angle = 0.5 * math.pi * k / BEVEL_STRIPS
        cosine, sine = max(math.cos(angle), 0.0), math.sin(angle)
        i = FOOT_STRIPS + 1 + k
        nodes[i, 0] = height - bevel_height * (1 - sine ** (2 / roundness))
        nodes[i, 1] = radius - bevel_inset * (1 - cosine ** (2 / roundness))
    # The light on a strip goes with how far it is turned; the most turned one has the full colour.
    for first, last in ((0, FOOT_STRIPS), (FOOT_STRIPS + 1, NODES - 1)):
        most = 1e-12
        for k in range(first, last):
            outward, upward = nodes[k + 1, 1] - nodes[k, 1], nodes[k + 1, 0] - nodes[k, 0]
            turned[k] = abs(outward) / (math.hypot(outward, upward) + 1e-12)
            most = max(most, turned[k])
        for k in range(first, last):
            turned[k] /= most
    turned[FOOT_STRIPS] = 0.0


@compiled
def _px_per_metre(dx, dy, z, scale):
    """Fine-image length of an ice vector's direction: pixels per metre along (dx, dy)."""
    length = math.sqrt(dx * dx + dy * dy) + 1e-12
    gu = dx * (scale[0, 0, 0] + z * scale[1, 0, 0]) + dy * (scale[0, 1, 0] + z * scale[1, 1, 0])
    gv = dx * (scale[0, 0, 1] + z * scale[1, 0, 1]) + dy * (scale[0, 1, 1] + z * scale[1, 1, 1])
    return length / math.sqrt(gu * gu + gv * gv)


@compiled
def paint(x, y, theta, shape, foot, lean, scale, rows, columns, fine, with_handle, out):
    """What part of the stone is seen in every fine pixel of a window.

    Parameters
    ----------
    x, y, theta : place and heading of the stone, sheet frame [m, rad]
    shape : (26,) see `SHAPE_PARAMETERS`
    foot, lean, scale, rows, columns : of a `Window`
    fine : fine pixels along a pixel's side
    with_handle : whether there is a handle
    out : (6, rows·fine, columns·fine) filled with the share of foot, side, bevel, top and handle,
        and the light that the ice lacks where it is seen. What the ice mirrors of the body counts
        as foot and side
    """
    radius, height = shape[0], shape[1]
    nodes, turned = np.empty((NODES, 2)), np.zeros(NODES)
    _outline(shape, nodes, turned)
    contact_from = radius - 0.5 * shape[2]
    handle_z = height + shape[6]
    cosine, sine = math.cos(theta), math.sin(theta)
    out[:] = 0.0
    widest = np.abs(scale[0]).max() + handle_z * np.abs(scale[1]).max()
    reach = radius + widest
    tall = handle_z if with_handle else height
    values = np.empty(NODES)
    for i in range(rows * fine):
        row = i // fine
        below = min(row, rows - 2)
        down = (i + 0.5) / fine - 0.5 - below
        for j in range(columns * fine):
            column = j // fine
            right = min(column, columns - 2)
            along = (j + 0.5) / fine - 0.5 - right
            a = below * columns + right
            fx = foot[a, 0] + along * (foot[a + 1, 0] - foot[a, 0])
            fx += down * (foot[a + columns, 0] - foot[a, 0]) - x
            fy = foot[a, 1] + along * (foot[a + 1, 1] - foot[a, 1])
            fy += down * (foot[a + columns, 1] - foot[a, 1]) - y
            lx, ly = lean[row * columns + column, 0], lean[row * columns + column, 1]
            c0, c1, c2 = fx * fx + fy * fy, fx * lx + fy * ly, lx * lx + ly * ly
            # nearest approach of the line of sight to the stone's axis, within its height
            z = min(max(-c1 / (c2 + 1e-12), 0.0), tall)
            cover = 0.0
            if c0 + z * (2 * c1 + z * c2) < reach * reach:
                for k in range(NODES):
                    z, r = nodes[k, 0], nodes[k, 1]
                    values[k] = c0 + z * (2 * c1 + z * c2) - r * r
                nearest, z_nearest, r_nearest, strip = 1e18, 0.0, 1.0, 0
                seen = NODES - 1 if values[NODES - 1] <= 0 else -1
                for k in range(NODES - 2, -1, -1):
                    rise = nodes[k + 1, 0] - nodes[k, 0]
                    least, at = values[k], 0.0
                    if values[k + 1] < least:
                        least, at = values[k + 1], 1.0
                    if rise > 1e-9:
                        slope = (nodes[k + 1, 1] - nodes[k, 1]) / rise
                        second = c2 - slope * slope
                        first = c1 + c2 * nodes[k, 0] - slope * nodes[k, 1]
                        if second > 0 and first < 0 and -first < second * rise:
                            least, at = values[k] - first * first / second, -first / second / rise
                    if seen < 0 and least <= 0:
                        seen = k
                    r = nodes[k, 1] + at * (nodes[k + 1, 1] - nodes[k, 1])
                    if least / r < nearest:
                        nearest, r_nearest, strip = least / r, r, k
                        z_nearest = nodes[k, 0] + at * rise
                dx, dy = fx + z_nearest * lx, fy + z_nearest * ly
                rho = math.sqrt(max(nearest * r_nearest + r_nearest * r_nearest, 0.0))
                distance = (rho - r_nearest) * _px_per_metre(dx, dy, z_nearest, scale)
                cover = _ramp(distance * fine)
                if seen < 0:
                    seen = strip
            if cover > 0:
                z, r = nodes[NODES - 1, 0], nodes[NODES - 1, 1]
                dx, dy = fx + z * lx, fy + z * ly
                rho = math.sqrt(dx * dx + dy * dy)
                top = cover
                if rho > 0.2 * r:
                    top *= _ramp((rho - r) * _px_per_metre(dx, dy, z, scale) * fine)
                out[3, i, j] = top
                side = cover - top
                if seen > FOOT_STRIPS:
                    strip = min(seen, NODES - 2)
                    out[2, i, j] = side * turned[strip]
                    out[1, i, j] = side * (1 - turned[strip])
                else:
                    out[0, i, j] = side * turned[seen]
                    out[1, i, j] = side * (1 - turned[seen])
            if cover < 1:
                bare = 1 - cover
                if shape[21] > 0.0:
                    image = 1e9
                    for m in range(MIRROR_NODES):
                        k = m * (NODES - 1) // (MIRROR_NODES - 1)
                        z = nodes[k, 0]
                        dx, dy = fx - z * lx, fy - z * ly
                        distance = math.sqrt(dx * dx + dy * dy) - nodes[k, 1]
                        image = min(image, distance * _px_per_metre(dx, dy, -z, scale))
                    if image < 1.0:  # pebble spreads the mirror image
                        steep = 1.0 - 1.0 / math.sqrt(1.0 + c2)
                        share = shape[21] * (NORMAL_MIRROR + (1.0 - NORMAL_MIRROR) * steep**5)
                        share *= bare * _ramp(0.5 * image)
                        out[0, i, j] += 0.5 * share
                        out[1, i, j] += 0.5 * share
                        bare -= share
                gap = max(math.sqrt(c0) - contact_from, 0.0) / shape[20]
                light = 1.0
                if gap < 3.0:
                    light -= shape[19] * math.exp(-gap * gap)
                dx, dy = fx - shape[12], fy - shape[13]
                distance = math.sqrt(dx * dx + dy * dy) - shape[14]
                if distance < 3 * shape[15]:
                    light *= 1 - shape[16] * 0.5 * math.erfc(distance / shape[15] * math.sqrt(0.5))
                out[5, i, j] = bare * (1 - light)
            if with_handle:
                ax, ay = fx + height * lx, fy + height * ly
                extent = 0.16 + shape[6] * (abs(lx) + abs(ly)) + widest
                if ax * ax + ay * ay < extent * extent:
                    handle = 0.0
                    for k in range(3):
                        z = height + 0.5 * k * shape[23]
                        dx, dy = fx + z * lx, fy + z * ly
                        distance = math.sqrt(dx * dx + dy * dy) - shape[22]
                        distance *= _px_per_metre(dx, dy, z, scale) * fine
                        handle = max(handle, _ramp(distance))
                    for k in range(GRIP_LEVELS + NECK_LEVELS):
                        front = shape[8]
                        z = handle_z - shape[17] * k / (GRIP_LEVELS - 1)
                        if k >= GRIP_LEVELS:
                            front = shape[7] + shape[25]
                            up = (k - GRIP_LEVELS + 0.5) / NECK_LEVELS
                            z = height + max(shape[6] - shape[17], 0.0) * up
                        dx, dy = fx + z * lx, fy + z * ly
                        forward, aside = cosine * dx + sine * dy, -sine * dx + cosine * dy
                        middle, half = 0.5 * (shape[7] + front), 0.5 * (front - shape[7])
                        ahead = (abs(forward - middle) - half) * fine
                        ahead *= _px_per_metre(cosine, sine, z, scale)
                        beside = (abs(aside) - 0.5 * shape[9]) * fine
                        beside *= _px_per_metre(-sine, cosine, z, scale)
                        handle = max(handle, _ramp(ahead) * _ramp(beside))
                    if handle > 0:
                        for k in range(PLANES):
                            out[k, i, j] *= 1 - handle
                        out[4, i, j] = handle


@compiled
def _spread_weights(count, fine, sigma, shift, weights, slopes, first):
    """Fill each pixel's weights of fine pixels under a Gaussian, and their slopes by the shift."""
    taps = weights.shape[1]
    for p in range(count):
        centre = (p - shift + 0.5) * fine - 0.5
        start = math.floor(centre - 0.5 * (taps - 1))
        first[p] = start
        total = 0.0
        for q in range(taps):
            away = (start + q - centre) / (fine * sigma)
            weights[p, q] = math.exp(-0.5 * away * away)
            slopes[p, q] = -weights[p, q] * away / sigma
            total += weights[p, q]
        for q in range(taps):
            weights[p, q] /= total
            slopes[p, q] /= total


@compiled
def blur(planes, rows, columns, fine, sigma, shift_u, shift_v, sloped, out):
    """Fine planes as the camera's pixels see them, moved by a shift.

    Parameters
    ----------
    planes : (p, rows·fine, columns·fine)
    sigma : of the point spread [px]
    shift_u, shift_v : by how much the planes are moved [px]
    sloped : whether derivatives are asked for
    out : (p, 3, rows, columns) filled with values and their derivatives by both shifts
    """
    taps = 2 * math.ceil(BLUR_REACH * sigma * fine) + 1
    across, across_slope = np.empty((columns, taps)), np.empty((columns, taps))
    upright, upright_slope = np.empty((rows, taps)), np.empty((rows, taps))
    first_u, first_v = np.empty(columns, np.int64), np.empty(rows, np.int64)
    _spread_weights(columns, fine, sigma, shift_u, across, across_slope, first_u)
    _spread_weights(rows, fine, sigma, shift_v, upright, upright_slope, first_v)
    height, width = rows * fine, columns * fine
    line, slope = np.empty(width), np.empty(width)
    for p in range(planes.shape[0]):
        for row in range(rows):
            line[:] = 0.0
            slope[:] = 0.0
            for q in range(taps):
                source = planes[p, min(max(first_v[row] + q, 0), height - 1)]
                weight = upright[row, q]
                for j in range(width):
                    line[j] += weight * source[j]
                if sloped:
                    weight = upright_slope[row, q]
                    for j in range(width):
                        slope[j] += weight * source[j]
            for column in range(columns):
                value, by_u, by_v = 0.0, 0.0, 0.0
                for q in range(taps):
                    j = min(max(first_u[column] + q, 0), width - 1)
                    value += across[column, q] * line[j]
                    if sloped:
                        by_u += across_slope[column, q] * line[j]
                        by_v += across[column, q] * slope[j]
                out[p, 0, row, column] = value
                out[p, 1, row, column] = by_u
                out[p, 2, row, column] = by_v


@compiled
def coverage(x, y, theta, shape, foot, lean, scale, rows, columns, fine, with_handle, out):
    """How much of each pixel every part covers, and the light that the ice in it lacks.

    Parameters
    ----------
    as of `paint`
    out : (2, rows·columns, 6) first as brightness is blurred, then as colour is
    """
    planes = np.empty((PLANES, rows * fine, columns * fine))
    paint(x, y, theta, shape, foot, lean, scale, rows, columns, fine, with_handle, planes)
    blurred = np.empty((PLANES, 3, rows, columns))
    for channel in range(2):
        blur(planes, rows, columns, fine, shape[10 + channel], 0.0, 0.0, False, blurred)
        for k in range(PLANES):
            for row in range(rows):
                for column in range(columns):
                    out[channel, row * columns + column, k] = blurred[k, 0, row, column]


@compiled
def _tint(parts, colours, planes):
    """Fill brightness, cover, lost light and both colours from the parts."""
    height, width = parts.shape[1], parts.shape[2]
    planes[:] = 0.0
    for i in range(height):
        for k in range(PARTS):
            for j in range(width):
                share = parts[k, i, j]
                planes[0, i, j] += share * colours[k, 0]
                planes[1, i, j] += share
                planes[3, i, j] += share * colours[k, 1]
                planes[4, i, j] += share * colours[k, 2]
        for j in range(width):
            planes[2, i, j] = parts[5, i, j]


@compiled
def gauss_newton(
    picture,
    behind,
    foot,
    lean,
    scale,
    rows,
    columns,
    fine,
    shape,
    colours,
    noise,
    has_handle,
    outlier_at,
    pose,
    covariance,
    quality,
):
    """Minimise the robust misfit over `pose`, and fill `covariance` and `quality`.

    The stone is painted once and its picture moved; only a long way asks for another painting.
    """
    n = rows * columns
    size = 3 if has_handle else 2
    parts = np.empty((PLANES, rows * fine, columns * fine))
    planes = np.empty((5, rows * fine, columns * fine))
    turned_planes = np.empty((5, rows * fine, columns * fine))
    # brightness: value, cover, lost light; colour: both values and their cover
    sharp, soft = np.empty((3, 3, rows, columns)), np.empty((3, 3, rows, columns))
    sharp_turned, soft_turned = np.empty((3, 3, rows, columns)), np.empty((3, 3, rows, columns))
    order = np.array([3, 4, 1])
    small_turn = 0.05
    # pixels per metre of ice, at half the stone's height
    metre = scale[0] + 0.5 * shape[1] * scale[1]
    det = metre[0, 0] * metre[1, 1] - metre[0, 1] * metre[1, 0]
    px = np.empty((2, 2))
    px[0, 0], px[0, 1] = metre[1, 1] / det, -metre[0, 1] / det
    px[1, 0], px[1, 1] = -metre[1, 0] / det, metre[0, 0] / det
    normal, right = np.zeros((3, 3)), np.zeros(3)
    residual, slopes = np.empty(3), np.empty((3, 3))
    scaled = np.eye(size)
    squares, weights, stone_pixels, seen_pixels = 0.0, 0.0, 0.0, 0.0
    done = False
    for _ in range(MAX_PAINTINGS):
        start = pose.copy()
        paint(
            pose[0], pose[1], pose[2],
            shape, foot, lean, scale, rows, columns, fine, has_handle, parts,
        )  # fmt: skip
        _tint(parts, colours, planes)
        if has_handle:
            paint(
                pose[0], pose[1], pose[2] + small_turn,
                shape, foot, lean, scale, rows, columns, fine, has_handle, parts,
            )  # fmt: skip
            _tint(parts, colours, turned_planes)
            turned_planes -= planes
            turned_planes /= small_turn
        for _ in range(MAX_ITERATIONS):
            dx, dy, turn = pose[0] - start[0], pose[1] - start[1], pose[2] - start[2]
            u = px[0, 0] * dx + px[0, 1] * dy
            v = px[1, 0] * dx + px[1, 1] * dy
            blur(planes[:3], rows, columns, fine, shape[10], u, v, True, sharp)
            blur(planes[order], rows, columns, fine, shape[11], u, v, True, soft)
            if has_handle:
                blur(turned_planes[:3], rows, columns, fine, shape[10], u, v, False, sharp_turned)
                blur(turned_planes[order], rows, columns, fine, shape[11], u, v, False, soft_turned)
            normal[:] = 0.0
            right[:] = 0.0
            squares, weights, stone_pixels, seen_pixels = 0.0, 0.0, 0.0, 0.0
            for i in range(n):
                row, column = i // columns, i % columns
                total = 0.0
                for channel in range(3):
                    ice = behind[i, channel]
                    if channel == 0:
                        seen, at, gone = sharp, 0, 1.0
                        slow = sharp_turned
                    else:
                        seen, at, gone = soft, channel - 1, 0.0
                        slow = soft_turned
                    cover = 1 if channel == 0 else 2
                    for d in range(3):
                        bare = seen[cover, d, row, column]
                        if channel == 0:
                            bare += seen[2, d, row, column]
                        slopes[d, channel] = seen[at, d, row, column] - ice * bare
                    value = slopes[0, channel] + ice
                    by_u, by_v = slopes[1, channel], slopes[2, channel]
                    slopes[0, channel] = by_u * px[0, 0] + by_v * px[1, 0]
                    slopes[1, channel] = by_u * px[0, 1] + by_v * px[1, 1]
                    slopes[2, channel] = 0.0
                    if has_handle:
                        bare = slow[cover, 0, row, column]
                        bare += gone * slow[2, 0, row, column]
                        slopes[2, channel] = slow[at, 0, row, column] - ice * bare
                        value += turn * slopes[2, channel]
                    for p in range(size):
                        slopes[p, channel] /= noise[channel]
                    residual[channel] = (picture[i, channel] - value) / noise[channel]
                    total += residual[channel] ** 2
                weight = 1.0 / (1.0 + total / (3.0 * outlier_at**2)) ** 2
                squares += weight * total / 3.0
                weights += weight
                covered = sharp[1, 0, row, column]
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
            done = gain < NEGLIGIBLE_STEP**2 * size
            dx, dy = pose[0] - start[0], pose[1] - start[1]
            far = math.hypot(px[0, 0] * dx + px[0, 1] * dy, px[1, 0] * dx + px[1, 1] * dy)
            if done or far > 2 * REPAINT_AT_PX or abs(pose[2] - start[2]) > 2 * REPAINT_TURN:
                break
        dx, dy = pose[0] - start[0], pose[1] - start[1]
        far = math.hypot(px[0, 0] * dx + px[0, 1] * dy, px[1, 0] * dx + px[1, 1] * dy)
        if done and far < REPAINT_AT_PX and abs(pose[2] - start[2]) < REPAINT_TURN:
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
