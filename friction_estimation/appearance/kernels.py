"""Compiled arithmetic of the stone's picture.

All of it stands in one file, because numba notices a change only in the file it compiled. Each
kernel does one thing and `painting` calls them in turn: a kernel that calls another compiles it
once more, and compiling is what a first run waits for.
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
def paint_body(x, y, shape, foot, lean, scale, rows, columns, fine, planes):
    """What part of the body is seen in every fine pixel of a window, as if it had no handle.

    Parameters
    ----------
    x, y : place of the stone, sheet frame [m]
    shape : (26,) see `SHAPE_PARAMETERS`
    foot, lean, scale, rows, columns : of a `Window`
    fine : fine pixels along a pixel's side
    planes : (6, rows·fine, columns·fine), of which the first four are filled with the shares of
        foot, side, bevel and top. What the ice mirrors of the body counts as foot and side
    """
    radius, height = shape[0], shape[1]
    nodes, turned = np.empty((NODES, 2)), np.zeros(NODES)
    _outline(shape, nodes, turned)
    widest = np.abs(scale[0]).max() + height * np.abs(scale[1]).max()
    reach = radius + widest
    top_z, top_r = nodes[NODES - 1, 0], nodes[NODES - 1, 1]
    surely_top = max(top_r - widest, 0.0)
    values = np.empty(NODES)
    for i in range(rows * fine):
        row = i // fine
        below = min(row, rows - 2)
        down = (i + 0.5) / fine - 0.5 - below
        for j in range(columns * fine):
            for k in range(4):
                planes[k, i, j] = 0.0
            column = j // fine
            right = min(column, columns - 2)
            along = (j + 0.5) / fine - 0.5 - right
            a = below * columns + right
            fx = foot[a, 0] + along * (foot[a + 1, 0] - foot[a, 0])
            fx += down * (foot[a + columns, 0] - foot[a, 0]) - x
            fy = foot[a, 1] + along * (foot[a + 1, 1] - foot[a, 1])
            fy += down * (foot[a + columns, 1] - foot[a, 1]) - y
            lx, ly = lean[row * columns + column, 0], lean[row * columns + column, 1]
            ox, oy = fx + top_z * lx, fy + top_z * ly
            if ox * ox + oy * oy < surely_top * surely_top:
                planes[3, i, j] = 1.0
                continue
            c0, c1, c2 = fx * fx + fy * fy, fx * lx + fy * ly, lx * lx + ly * ly
            # nearest approach of the line of sight to the stone's axis, within its height
            z = min(max(-c1 / (c2 + 1e-12), 0.0), height)
            cover, seen = 0.0, -1
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
                rho = math.sqrt(ox * ox + oy * oy)
                top = cover
                if rho > 0.2 * top_r:
                    top *= _ramp((rho - top_r) * _px_per_metre(ox, oy, top_z, scale) * fine)
                planes[3, i, j] = top
                side = cover - top
                strip = min(seen, NODES - 2)
                rounded = 2 if strip > FOOT_STRIPS else 0
                planes[rounded, i, j] = side * turned[strip]
                planes[1, i, j] = side * (1 - turned[strip])
            if cover < 1 and shape[21] > 0.0:
                z = min(max(c1 / (c2 + 1e-12), 0.0), height)
                if c0 - z * (2 * c1 - z * c2) < (reach + 2 * widest) ** 2:
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
                        share *= (1 - cover) * _ramp(0.5 * image)
                        planes[0, i, j] += 0.5 * share
                        planes[1, i, j] += 0.5 * share


@compiled
def paint_shade(x, y, shape, foot, rows, columns, fine, planes):
    """What light the ice lacks in every fine pixel where it is seen beside the body.

    Parameters
    ----------
    as of `paint_body`, whose four planes are read; the last plane is filled
    """
    contact_from = shape[0] - 0.5 * shape[2]
    for i in range(rows * fine):
        below = min(i // fine, rows - 2)
        down = (i + 0.5) / fine - 0.5 - below
        for j in range(columns * fine):
            planes[5, i, j] = 0.0
            bare = 1.0 - planes[0, i, j] - planes[1, i, j] - planes[2, i, j] - planes[3, i, j]
            if bare < 1e-9:
                continue
            right = min(j // fine, columns - 2)
            along = (j + 0.5) / fine - 0.5 - right
            a = below * columns + right
            fx = foot[a, 0] + along * (foot[a + 1, 0] - foot[a, 0])
            fx += down * (foot[a + columns, 0] - foot[a, 0]) - x
            fy = foot[a, 1] + along * (foot[a + 1, 1] - foot[a, 1])
            fy += down * (foot[a + columns, 1] - foot[a, 1]) - y
            gap = max(math.sqrt(fx * fx + fy * fy) - contact_from, 0.0) / shape[20]
            light = 1.0
            if gap < 3.0:
                light -= shape[19] * math.exp(-gap * gap)
            dx, dy = fx - shape[12], fy - shape[13]
            distance = math.sqrt(dx * dx + dy * dy) - shape[14]
            if distance < 3 * shape[15]:
                light *= 1 - shape[16] * 0.5 * math.erfc(distance / shape[15] * math.sqrt(0.5))
            planes[5, i, j] = bare * (1 - light)


@compiled
def paint_handle(x, y, theta, shape, foot, lean, scale, rows, columns, fine, handle):
    """The share of every fine pixel that the handle covers.

    Parameters
    ----------
    theta : heading of the stone [rad]; the others as of `paint_body`
    handle : (rows·fine, columns·fine), filled
    """
    height = shape[1]
    handle_z = height + shape[6]
    cosine, sine = math.cos(theta), math.sin(theta)
    widest = np.abs(scale[0]).max() + handle_z * np.abs(scale[1]).max()
    for i in range(rows * fine):
        row = i // fine
        below = min(row, rows - 2)
        down = (i + 0.5) / fine - 0.5 - below
        for j in range(columns * fine):
            handle[i, j] = 0.0
            column = j // fine
            right = min(column, columns - 2)
            along = (j + 0.5) / fine - 0.5 - right
            a = below * columns + right
            fx = foot[a, 0] + along * (foot[a + 1, 0] - foot[a, 0])
            fx += down * (foot[a + columns, 0] - foot[a, 0]) - x
            fy = foot[a, 1] + along * (foot[a + 1, 1] - foot[a, 1])
            fy += down * (foot[a + columns, 1] - foot[a, 1]) - y
            lx, ly = lean[row * columns + column, 0], lean[row * columns + column, 1]
            ax, ay = fx + height * lx, fy + height * ly
            extent = 0.16 + shape[6] * (abs(lx) + abs(ly)) + widest
            if ax * ax + ay * ay >= extent * extent:
                continue
            share = 0.0
            for k in range(3):
                z = height + 0.5 * k * shape[23]
                dx, dy = fx + z * lx, fy + z * ly
                distance = math.sqrt(dx * dx + dy * dy) - shape[22]
                if distance < widest:
                    distance *= _px_per_metre(dx, dy, z, scale) * fine
                    share = max(share, _ramp(distance))
            for k in range(GRIP_LEVELS + NECK_LEVELS):
                if share >= 1.0:
                    break
                front = shape[8]
                z = handle_z - shape[17] * k / (GRIP_LEVELS - 1)
                if k >= GRIP_LEVELS:
                    front = shape[7] + shape[25]
                    up = (k - GRIP_LEVELS + 0.5) / NECK_LEVELS
                    z = height + max(shape[6] - shape[17], 0.0) * up
                dx, dy = fx + z * lx, fy + z * ly
                forward, aside = cosine * dx + sine * dy, -sine * dx + cosine * dy
                ahead = abs(forward - 0.5 * (shape[7] + front)) - 0.5 * (front - shape[7])
                beside = abs(aside) - 0.5 * shape[9]
                if ahead < widest and beside < widest:
                    ahead *= _px_per_metre(cosine, sine, z, scale) * fine
                    beside *= _px_per_metre(-sine, cosine, z, scale) * fine
                    share = max(share, _ramp(ahead) * _ramp(beside))
            handle[i, j] = share


@compiled
def tint(planes, handle, colours, tinted):
    """The stone's light in every fine pixel, and what it hides of the ice.

    Parameters
    ----------
    planes : (6, height, width) of `paint_body` and `paint_shade`
    handle : (height, width) of `paint_handle`
    colours : (5, 3) of the parts
    tinted : (5, height, width) filled with the stone's brightness and the share of the ice's that
        is lost behind it and in its shade; its two colours and the share of the ice's lost
    """
    for i in range(handle.shape[0]):
        for j in range(handle.shape[1]):
            h = handle[i, j]
            free = 1.0 - h
            luma, blue, red, cover = 0.0, 0.0, 0.0, 0.0
            for k in range(4):
                share = planes[k, i, j]
                cover += share
                luma += share * colours[k, 0]
                blue += share * colours[k, 1]
                red += share * colours[k, 2]
            tinted[0, i, j] = free * luma + h * colours[4, 0]
            tinted[1, i, j] = free * (cover + planes[5, i, j]) + h
            tinted[2, i, j] = free * blue + h * colours[4, 1]
            tinted[3, i, j] = free * red + h * colours[4, 2]
            tinted[4, i, j] = free * cover + h


@compiled
def blur(planes, rows, columns, fine, sigma, shift_u, shift_v, sloped, out):
    """Fine planes as the camera's pixels see them, moved by a shift.

    Parameters
    ----------
    planes : (p, rows·fine, columns·fine)
    sigma : of the point spread [px]
    shift_u, shift_v : by how much the planes are moved [px]
    sloped : whether derivatives are asked for
    out : (p, 3, rows, columns) filled with values and their derivatives by both shifts; without
        slopes only with values
    """
    taps = 2 * math.ceil(BLUR_REACH * sigma * fine) + 1
    weights, slopes = np.empty((2, taps)), np.empty((2, taps))
    first = np.empty(2, np.int64)
    for axis in range(2):  # all pixels have the same weights: they lie alike among fine ones
        centre = 0.5 * fine - 0.5 - (shift_v if axis == 0 else shift_u) * fine
        first[axis] = math.floor(centre - 0.5 * (taps - 1))
        total = 0.0
        for q in range(taps):
            away = (first[axis] + q - centre) / (fine * sigma)
            weights[axis, q] = math.exp(-0.5 * away * away)
            slopes[axis, q] = -weights[axis, q] * away / sigma
            total += weights[axis, q]
        for q in range(taps):
            weights[axis, q] /= total
            slopes[axis, q] /= total
    height, width = rows * fine, columns * fine
    # Upright first. Fine pixels of one phase then lie side by side, so that all sums run along
    # memory.
    span = columns + taps // fine + 2
    lines, phases = np.empty((2, width)), np.empty((2, fine, span))
    sums = np.empty((3, columns))
    for p in range(planes.shape[0]):
        for row in range(rows):
            lines[:] = 0.0
            for q in range(taps):
                source = planes[p, min(max(row * fine + first[0] + q, 0), height - 1)]
                weight, slope = weights[0, q], slopes[0, q]
                if sloped:
                    for j in range(width):
                        lines[0, j] += weight * source[j]
                        lines[1, j] += slope * source[j]
                else:
                    for j in range(width):
                        lines[0, j] += weight * source[j]
            for f in range(fine):
                for m in range(span):
                    j = min(max(first[1] + m * fine + f, 0), width - 1)
                    phases[0, f, m] = lines[0, j]
                    phases[1, f, m] = lines[1, j]
            sums[:] = 0.0
            for q in range(taps):
                m = q // fine
                weight, slope = weights[1, q], slopes[1, q]
                plain = phases[0, q % fine, m : m + columns]
                if sloped:
                    upright = phases[1, q % fine, m : m + columns]
                    for column in range(columns):
                        sums[0, column] += weight * plain[column]
                        sums[1, column] += slope * plain[column]
                        sums[2, column] += weight * upright[column]
                else:
                    for column in range(columns):
                        sums[0, column] += weight * plain[column]
            for d in range(3 if sloped else 1):
                for column in range(columns):
                    out[p, d, row, column] = sums[d, column]


@compiled
def pose_equations(picture, behind, seen, slow, turn, px, noise, outlier_at, normal, right, totals):
    """Weighted normal equations of a stone's place and heading in one window.

    Parameters
    ----------
    picture, behind : (n, 3) channels of the frame and of the ice
    seen : (5, 3, rows, columns) tinted planes, blurred, with their slopes
    slow : the same of their derivative by the heading, without slopes
    turn : how far the heading is from that of the painting [rad]
    px : (2, 2) pixels per metre on the ice
    noise : (3,) of each channel
    normal, right : (3, 3) and (3,) filled
    totals : (4,) filled with the sums of weighted squares and of weights, and of the stone's
        pixels and of those that are seen
    """
    columns = seen.shape[3]
    residual, slopes = np.empty(3), np.empty((3, 3))
    normal[:] = 0.0
    right[:] = 0.0
    totals[:] = 0.0
    for i in range(picture.shape[0]):
        row, column = i // columns, i % columns
        total = 0.0
        for channel in range(3):
            ice = behind[i, channel]
            at = channel + 1 if channel else 0
            hidden = 4 if channel else 1
            sigma = noise[channel]
            value = ice + seen[at, 0, row, column] - ice * seen[hidden, 0, row, column]
            by_u = seen[at, 1, row, column] - ice * seen[hidden, 1, row, column]
            by_v = seen[at, 2, row, column] - ice * seen[hidden, 2, row, column]
            by_turn = slow[at, 0, row, column] - ice * slow[hidden, 0, row, column]
            slopes[0, channel] = (by_u * px[0, 0] + by_v * px[1, 0]) / sigma
            slopes[1, channel] = (by_u * px[0, 1] + by_v * px[1, 1]) / sigma
            slopes[2, channel] = by_turn / sigma
            residual[channel] = (picture[i, channel] - value - turn * by_turn) / sigma
            total += residual[channel] ** 2
        weight = 1.0 / (1.0 + total / (3.0 * outlier_at**2)) ** 2
        totals[0] += weight * total / 3.0
        totals[1] += weight
        totals[2] += seen[4, 0, row, column]
        totals[3] += weight * seen[4, 0, row, column]
        for p in range(3):
            for channel in range(3):
                right[p] += weight * slopes[p, channel] * residual[channel]
                for q in range(p + 1):
                    normal[p, q] += weight * slopes[p, channel] * slopes[q, channel]
    for p in range(3):
        for q in range(p):
            normal[q, p] = normal[p, q]


@compiled
def normal_equations(jacobian, residual, weight, normal, right):
    """Fill in the normal equations of a weighted least-squares problem, (n, m).

    Written out, because a threaded library call on such slim matrices mostly waits for its threads.
    """
    n, m = jacobian.shape
    for i in range(n):
        for p in range(m):
            scaled = weight[i] * jacobian[i, p]
            if scaled == 0.0:
                continue
            right[p] += scaled * residual[i]
            for q in range(p + 1):
                normal[p, q] += scaled * jacobian[i, q]
    for p in range(m):
        for q in range(p):
            normal[q, p] = normal[p, q]
