"""Compiled arithmetic of the stone's picture.

Most kernels do one thing and `painting` calls them in turn: a kernel that calls another compiles it
once more, and compiling is what a first run waits for.
"""

from __future__ import annotations

import math

import numpy as np

from curling_env.physics.compiled import compiled as compiled_in_order

compiled = compiled_in_order(
    allocates=True,
    fastmath={"reassoc", "nsz", "contract", "arcp"},  # sums may be taken in any order
)


@compiled
def separate(picture, channels):
    """Fill in brightness and the two colour differences that films store (ITU-R BT.601).

    Parameters
    ----------
    picture : (rows, columns, 3) BGR
    channels : (rows·columns, 3)
    """
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            i = row * picture.shape[1] + column
            blue = float(picture[row, column, 0])
            red = float(picture[row, column, 2])
            luma = 0.114 * blue + 0.587 * picture[row, column, 1] + 0.299 * red
            channels[i, 0] = luma
            channels[i, 1] = 0.564 * (blue - luma)
            channels[i, 2] = 0.713 * (red - luma)


FOOT_STRIPS = 5
BEVEL_STRIPS = 5
NODES = FOOT_STRIPS + BEVEL_STRIPS + 2
"""Circles that bound the cones of which the body is made: foot, side and bevel."""
GRIP_LEVELS = 4
NECK_LEVELS = 2
MIRROR_NODES = 5
FINE = 2
"""Into how many parts a pixel's side is cut when a stone is painted: with soft edges two err by
less than half a grey level on average, and four by no less. `blur` is written for two."""
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
def paint_body(x, y, shape, foot, lean, scale, rows, columns, planes):
    """What part of the body is seen in every fine pixel of a window, as if it had no handle.

    Parameters
    ----------
    x, y : place of the stone, sheet frame [m]
    shape : (26,) see `SHAPE_PARAMETERS`
    foot, lean, scale, rows, columns : of a `PixelWindow`
    planes : (6, rows·FINE, columns·FINE), of which the first four are filled with the shares of
        foot, side, bevel and top. What the ice mirrors of the body counts as foot and side
    """
    radius, height = shape[0], shape[1]
    nodes, turned, slopes = np.empty((NODES, 2)), np.zeros(NODES), np.zeros(NODES)
    _outline(shape, nodes, turned)
    for k in range(NODES - 1):
        rise = nodes[k + 1, 0] - nodes[k, 0]
        slopes[k] = (nodes[k + 1, 1] - nodes[k, 1]) / rise if rise > 1e-9 else 0.0
    widest = np.abs(scale[0]).max() + height * np.abs(scale[1]).max()
    reach = radius + widest
    top_z, top_r = nodes[NODES - 1, 0], nodes[NODES - 1, 1]
    surely_top = max(top_r - 2 * widest, 0.0)
    values = np.empty(NODES)
    for row in range(rows):
        below = min(row, rows - 2)
        for column in range(columns):
            right = min(column, columns - 2)
            a = below * columns + right
            i0, j0 = row * FINE, column * FINE
            lx, ly = lean[row * columns + column, 0], lean[row * columns + column, 1]
            fx, fy = foot[row * columns + column, 0] - x, foot[row * columns + column, 1] - y
            # Most pixels are all top or all ice; their fine ones need no closer look.
            ox, oy = fx + top_z * lx, fy + top_z * ly
            whole = 1.0 if ox * ox + oy * oy < surely_top * surely_top else 0.0
            c2 = lx * lx + ly * ly
            c1 = fx * lx + fy * ly
            z = min(max(-c1 / (c2 + 1e-12), -height), height)
            away = fx * fx + fy * fy + z * (2 * c1 + z * c2)
            if whole > 0.0 or away > (reach + 3 * widest) ** 2:
                for m in range(FINE):
                    for n in range(FINE):
                        planes[0, i0 + m, j0 + n] = 0.0
                        planes[1, i0 + m, j0 + n] = 0.0
                        planes[2, i0 + m, j0 + n] = 0.0
                        planes[3, i0 + m, j0 + n] = whole
                continue
            for m in range(FINE):
                down = row + (m + 0.5) / FINE - 0.5 - below
                for n in range(FINE):
                    i, j = i0 + m, j0 + n
                    along = column + (n + 0.5) / FINE - 0.5 - right
                    fx = foot[a, 0] + along * (foot[a + 1, 0] - foot[a, 0])
                    fx += down * (foot[a + columns, 0] - foot[a, 0]) - x
                    fy = foot[a, 1] + along * (foot[a + 1, 1] - foot[a, 1])
                    fy += down * (foot[a + columns, 1] - foot[a, 1]) - y
                    c0, c1 = fx * fx + fy * fy, fx * lx + fy * ly
                    for k in range(4):
                        planes[k, i, j] = 0.0
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
                                second = c2 - slopes[k] * slopes[k]
                                first = c1 + c2 * nodes[k, 0] - slopes[k] * nodes[k, 1]
                                if second > 0 and first < 0 and -first < second * rise:
                                    at = -first / second
                                    least = values[k] + first * at
                                    at /= rise
                            if seen < 0 and least <= 0:
                                seen = k
                            r = nodes[k, 1] + at * (nodes[k + 1, 1] - nodes[k, 1])
                            if least < nearest * r:
                                nearest, r_nearest, strip = least / r, r, k
                                z_nearest = nodes[k, 0] + at * rise
                        dx, dy = fx + z_nearest * lx, fy + z_nearest * ly
                        rho = math.sqrt(max(nearest * r_nearest + r_nearest * r_nearest, 0.0))
                        distance = (rho - r_nearest) * _px_per_metre(dx, dy, z_nearest, scale)
                        cover = _ramp(distance * FINE)
                        if seen < 0:
                            seen = strip
                    if cover > 0:
                        ox, oy = fx + top_z * lx, fy + top_z * ly
                        rho = math.sqrt(ox * ox + oy * oy)
                        top = cover
                        if rho > 0.2 * top_r:
                            top *= _ramp((rho - top_r) * _px_per_metre(ox, oy, top_z, scale) * FINE)
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
                            for q in range(MIRROR_NODES):
                                k = q * (NODES - 1) // (MIRROR_NODES - 1)
                                z = nodes[k, 0]
                                dx, dy = fx - z * lx, fy - z * ly
                                distance = math.sqrt(dx * dx + dy * dy) - nodes[k, 1]
                                image = min(image, distance * _px_per_metre(dx, dy, -z, scale))
                            if image < 1.0:  # pebble spreads the mirror image
                                steep = 1.0 - 1.0 / math.sqrt(1.0 + c2)
                                share = NORMAL_MIRROR + (1.0 - NORMAL_MIRROR) * steep**5
                                share *= shape[21] * (1 - cover) * _ramp(0.5 * image)
                                planes[0, i, j] += 0.5 * share
                                planes[1, i, j] += 0.5 * share


@compiled
def paint_shade(x, y, shape, foot, rows, columns, planes):
    """What light the ice lacks in every fine pixel where it is seen beside the body.

    Parameters
    ----------
    as of `paint_body`, whose four planes are read; the last plane is filled
    """
    contact_from = shape[0] - 0.5 * shape[2]
    contact_ends = contact_from + 3.0 * shape[20]
    shadow_ends = shape[14] + 3.0 * shape[15]
    for i in range(rows * FINE):
        below = min(i // FINE, rows - 2)
        down = (i + 0.5) / FINE - 0.5 - below
        for j in range(columns * FINE):
            planes[5, i, j] = 0.0
            bare = 1.0 - planes[0, i, j] - planes[1, i, j] - planes[2, i, j] - planes[3, i, j]
            if bare < 1e-6:
                continue
            right = min(j // FINE, columns - 2)
            along = (j + 0.5) / FINE - 0.5 - right
            a = below * columns + right
            fx = foot[a, 0] + along * (foot[a + 1, 0] - foot[a, 0])
            fx += down * (foot[a + columns, 0] - foot[a, 0]) - x
            fy = foot[a, 1] + along * (foot[a + 1, 1] - foot[a, 1])
            fy += down * (foot[a + columns, 1] - foot[a, 1]) - y
            light, square = 1.0, fx * fx + fy * fy
            if square < contact_ends * contact_ends:
                gap = max(math.sqrt(square) - contact_from, 0.0) / shape[20]
                light -= shape[19] * math.exp(-gap * gap)
            dx, dy = fx - shape[12], fy - shape[13]
            square = dx * dx + dy * dy
            if square < shadow_ends * shadow_ends:
                distance = math.sqrt(square) - shape[14]
                light *= 1 - shape[16] * 0.5 * math.erfc(distance / shape[15] * math.sqrt(0.5))
            planes[5, i, j] = bare * (1 - light)


@compiled
def paint_handle(x, y, theta, shape, foot, lean, scale, rows, columns, handle):
    """The share of every fine pixel that the handle covers.

    Parameters
    ----------
    theta : heading of the stone [rad]; the others as of `paint_body`
    handle : (rows·FINE, columns·FINE), filled
    """
    height = shape[1]
    handle_z = height + shape[6]
    cosine, sine = math.cos(theta), math.sin(theta)
    widest = np.abs(scale[0]).max() + handle_z * np.abs(scale[1]).max()
    reach_front, reach_back = max(shape[8], shape[7] + shape[25]), shape[7]
    half_width, collar, rise, play = 0.5 * shape[9], shape[22] + widest, shape[23], 2 * widest
    for row in range(rows):
        below = min(row, rows - 2)
        for column in range(columns):
            right = min(column, columns - 2)
            a = below * columns + right
            i0, j0 = row * FINE, column * FINE
            lx, ly = lean[row * columns + column, 0], lean[row * columns + column, 1]
            fx = foot[row * columns + column, 0] - x + height * lx
            fy = foot[row * columns + column, 1] - y + height * ly
            # Does the line of sight come by bar or collar, between top and handle?
            forward, aside = cosine * fx + sine * fy, cosine * fy - sine * fx
            ahead, beside = (
                shape[6] * (cosine * lx + sine * ly),
                shape[6] * (cosine * ly - sine * lx),
            )
            by_bar = (
                aside + min(beside, 0.0) < half_width + play
                and aside + max(beside, 0.0) > -half_width - play
                and forward + min(ahead, 0.0) < reach_front + play
                and forward + max(ahead, 0.0) > reach_back - play
            )
            near = collar + widest + rise * (abs(lx) + abs(ly))
            by_collar = fx * fx + fy * fy < near * near
            if not by_bar and not by_collar:
                for m in range(FINE):
                    for n in range(FINE):
                        handle[i0 + m, j0 + n] = 0.0
                continue
            for m in range(FINE):
                down = row + (m + 0.5) / FINE - 0.5 - below
                for n in range(FINE):
                    along = column + (n + 0.5) / FINE - 0.5 - right
                    fx = foot[a, 0] + along * (foot[a + 1, 0] - foot[a, 0])
                    fx += down * (foot[a + columns, 0] - foot[a, 0]) - x
                    fy = foot[a, 1] + along * (foot[a + 1, 1] - foot[a, 1])
                    fy += down * (foot[a + columns, 1] - foot[a, 1]) - y
                    share = 0.0
                    for k in range(3 if by_collar else 0):
                        z = height + 0.5 * k * rise
                        dx, dy = fx + z * lx, fy + z * ly
                        square = dx * dx + dy * dy
                        if square < collar * collar:
                            distance = math.sqrt(square) - shape[22]
                            distance *= _px_per_metre(dx, dy, z, scale) * FINE
                            share = max(share, _ramp(distance))
                    for k in range(GRIP_LEVELS + NECK_LEVELS if by_bar else 0):
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
                        beside = abs(aside) - half_width
                        if ahead < widest and beside < widest:
                            ahead *= _px_per_metre(cosine, sine, z, scale) * FINE
                            beside *= _px_per_metre(-sine, cosine, z, scale) * FINE
                            share = max(share, _ramp(ahead) * _ramp(beside))
                    handle[i0 + m, j0 + n] = share


@compiled
def colour_planes(planes, handle, colours, coloured):
    """The stone's light in every fine pixel, and what it hides of the ice.

    Parameters
    ----------
    planes : (6, height, width) of `paint_body` and `paint_shade`
    handle : (height, width) of `paint_handle`
    colours : (5, 3) of the parts
    coloured : (5, height, width) filled with the stone's brightness and the share of the ice's that
        is lost behind it and in its shade; its two colours and the share of the ice's lost
    """
    one = np.float32(1.0)
    for i in range(handle.shape[0]):
        foot, side, bevel, top = planes[0, i], planes[1, i], planes[2, i], planes[3, i]
        shade, grip = planes[5, i], handle[i]
        lost, light = coloured[1, i], coloured[4, i]
        for j in range(handle.shape[1]):
            free = one - grip[j]
            cover = foot[j] + side[j] + bevel[j] + top[j]
            lost[j] = free * (cover + shade[j]) + grip[j]
            light[j] = free * cover + grip[j]
        for channel in range(3):
            out = coloured[channel + 1 if channel else 0, i]
            a, b, c = colours[0, channel], colours[1, channel], colours[2, channel]
            d, e = colours[3, channel], colours[4, channel]
            for j in range(handle.shape[1]):
                own = foot[j] * a + side[j] * b + bevel[j] * c + top[j] * d
                out[j] = (one - grip[j]) * own + grip[j] * e


@compiled
def blur(planes, rows, columns, sigma, shift_u, shift_v, sloped, out):
    """Fine planes as the camera's pixels see them, moved by a shift.

    Parameters
    ----------
    planes : (p, rows·FINE, columns·FINE)
    sigma : of the point spread [px]
    shift_u, shift_v : by how much the planes are moved [px]
    sloped : whether derivatives are asked for
    out : (p, 3, rows, columns) filled with values and their derivatives by both shifts; without
        slopes only with values
    """
    # Taps go four at a time, so that sums stay in registers; the last ones may weigh nothing.
    needed = 2 * math.ceil(BLUR_REACH * sigma * FINE) + 1
    taps = 4 * ((needed + 3) // 4)
    weights, slopes = np.zeros((2, taps), np.float32), np.zeros((2, taps), np.float32)
    first = np.empty(2, np.int64)
    for axis in range(2):  # all pixels have the same weights: they lie alike among fine ones
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
    # Upright first. Fine pixels of one phase then lie side by side, so that all sums run along
    # memory.
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


@compiled
def pose_step(
    picture, behind, seen, slow, turn, px, noise, outlier_at, size, step, covariance, totals
):
    """One Gauss-Newton step of a stone's place and heading in one window.

    Parameters
    ----------
    picture, behind : (n, 3) channels of the frame and of the ice
    seen : (5, 3, rows, columns) coloured planes, blurred, with their slopes
    slow : the same of their derivative by the heading, without slopes
    turn : how far the heading is from that of the painting [rad]
    px : (2, 2) pixels per metre on the ice
    noise : (3,) of each channel
    size : 3, or 2 for a stone without a heading
    step, covariance : (3,) and (3, 3) filled; of independent pixels
    totals : (5,) filled with the sums of weighted squares and of weights, of the stone's pixels
        and of those that are seen, and the squared standard errors that the step gains
    """
    columns = seen.shape[3]
    outlier = 1.0 / (3.0 * outlier_at**2)
    n0, n1, n2 = 1.0 / noise[0], 1.0 / noise[1], 1.0 / noise[2]
    nxx, nxy, nyy, nxt, nyt, ntt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    rx, ry, rt = 0.0, 0.0, 0.0
    squares, weights, stone, visible = 0.0, 0.0, 0.0, 0.0
    for i in range(picture.shape[0]):
        row, column = i // columns, i % columns
        total = 0.0
        uu, uv, vv, ut, vt, tt, u, v, t = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for channel in range(3):
            ice = behind[i, channel]
            at = channel + 1 if channel else 0
            hidden = 4 if channel else 1
            scale = n2 if channel == 2 else (n1 if channel == 1 else n0)
            value = ice + seen[at, 0, row, column] - ice * seen[hidden, 0, row, column]
            by_u = scale * (seen[at, 1, row, column] - ice * seen[hidden, 1, row, column])
            by_v = scale * (seen[at, 2, row, column] - ice * seen[hidden, 2, row, column])
            by_turn = scale * (slow[at, 0, row, column] - ice * slow[hidden, 0, row, column])
            residual = scale * (picture[i, channel] - value) - turn * by_turn
            total += residual * residual
            uu += by_u * by_u
            uv += by_u * by_v
            vv += by_v * by_v
            ut += by_u * by_turn
            vt += by_v * by_turn
            tt += by_turn * by_turn
            u += by_u * residual
            v += by_v * residual
            t += by_turn * residual
        weight = 1.0 / (1.0 + total * outlier)
        weight *= weight
        squares += weight * total / 3.0
        weights += weight
        stone += seen[4, 0, row, column]
        visible += weight * seen[4, 0, row, column]
        nxx += weight * uu
        nxy += weight * uv
        nyy += weight * vv
        nxt += weight * ut
        nyt += weight * vt
        ntt += weight * tt
        rx += weight * u
        ry += weight * v
        rt += weight * t
    # From pixels to metres, damped a little, and solved by cofactors.
    a, b, c, d = px[0, 0], px[0, 1], px[1, 0], px[1, 1]
    xx = a * a * nxx + 2 * a * c * nxy + c * c * nyy
    xy = a * b * nxx + (a * d + b * c) * nxy + c * d * nyy
    yy = b * b * nxx + 2 * b * d * nxy + d * d * nyy
    xt, yt = a * nxt + c * nyt, b * nxt + d * nyt
    gx, gy = a * rx + c * ry, b * rx + d * ry
    xx, yy, tt = 1.0001 * xx + 1e-6, 1.0001 * yy + 1e-6, 1.0001 * ntt + 1e-6
    if size == 2:
        xt, yt, tt, rt = 0.0, 0.0, 1.0, 0.0
    covariance[0, 0] = yy * tt - yt * yt
    covariance[0, 1] = xt * yt - xy * tt
    covariance[0, 2] = xy * yt - xt * yy
    covariance[1, 1] = xx * tt - xt * xt
    covariance[1, 2] = xy * xt - xx * yt
    covariance[2, 2] = xx * yy - xy * xy
    det = xx * covariance[0, 0] + xy * covariance[0, 1] + xt * covariance[0, 2]
    for p in range(3):
        for q in range(p, 3):
            covariance[p, q] /= det
            covariance[q, p] = covariance[p, q]
    for p in range(3):
        step[p] = covariance[p, 0] * gx + covariance[p, 1] * gy + covariance[p, 2] * rt
    totals[0], totals[1], totals[2], totals[3] = squares, weights, stone, visible
    totals[4] = step[0] * gx + step[1] * gy + step[2] * rt


@compiled
def composite_change(seen, behind, added):
    """Fill in what the stone adds to the ice's picture and takes from it.

    Parameters
    ----------
    seen : (5, 3, rows, columns) of `blur`, of which the values count
    behind : (3, rows, columns) channels of the ice
    added : (3, rows, columns)
    """
    for row in range(seen.shape[2]):
        for channel in range(3):
            light = seen[channel + 1 if channel else 0, 0, row]
            hidden = seen[4 if channel else 1, 0, row]
            ice, out = behind[channel, row], added[channel, row]
            for column in range(seen.shape[3]):
                out[column] = light[column] - ice[column] * hidden[column]


@compiled
def robust_misfit(picture, behind, seen, noise, outlier_at):
    """Sum of squares of what a stone's picture leaves, in standard deviations; outliers saturate.

    Parameters
    ----------
    as of `pose_step`
    """
    columns = seen.shape[3]
    outlier = 1.0 / (3.0 * outlier_at**2)
    n0, n1, n2 = 1.0 / noise[0], 1.0 / noise[1], 1.0 / noise[2]
    total = 0.0
    for i in range(picture.shape[0]):
        row, column = i // columns, i % columns
        bare = 1.0 - seen[1, 0, row, column]
        luma = n0 * (picture[i, 0] - behind[i, 0] * bare - seen[0, 0, row, column])
        bare = 1.0 - seen[4, 0, row, column]
        blue = n1 * (picture[i, 1] - behind[i, 1] * bare - seen[2, 0, row, column])
        red = n2 * (picture[i, 2] - behind[i, 2] * bare - seen[3, 0, row, column])
        square = luma * luma + blue * blue + red * red
        total += square / (1.0 + square * outlier)
    return total


@compiled
def normal_equations(jacobian, residual, weight, normal, right):
    """Fill the normal equations of a weighted least-squares problem.

    Written out, because a threaded library call on such slim matrices mostly waits for its threads.

    Parameters
    ----------
    jacobian : (m, n) derivatives of n residuals by m parameters; they are weighted in place
    residual, weight : (n,)
    normal, right : (m, m) and (m,)
    """
    m, n = jacobian.shape
    for i in range(n):
        weight[i] = math.sqrt(weight[i])
        residual[i] *= weight[i]
    for p in range(m):
        own = jacobian[p]
        total = 0.0
        for i in range(n):
            own[i] *= weight[i]
            total += own[i] * residual[i]
        right[p] = total
        for q in range(p + 1):
            other = jacobian[q]
            total = 0.0
            for i in range(n):
                total += own[i] * other[i]
            normal[p, q] = total
            normal[q, p] = total
