"""Compiled painting of a stone: the share of every fine pixel that each of its parts covers.

The body is a stack of cones, with each of which the line of sight of a pixel is intersected; the
handle is a bar and a round base, cut into level slices.
"""

from __future__ import annotations

import math

import numpy as np

from curling_env.physics.compiled import compiled
from friction_estimation.appearance.shape import (
    BEVEL,
    FINE,
    FOOT,
    LIT,
    SIDE,
    SUMS_IN_ANY_ORDER,
    TOP,
)

FOOT_STRIPS = 5
BEVEL_STRIPS = 5
NODES = FOOT_STRIPS + BEVEL_STRIPS + 2
"""Circles that bound the cones of which the body is made: foot, side and bevel."""
GRIP_LEVELS = 4
NECK_LEVELS = 2
MIRROR_NODES = 5
EDGE_WIDTH = math.sqrt(20 / 12)
"""Width of a smooth edge that has a fine pixel's variance [fine pixels]."""
SHADE_REACH = 3.5
"""Shade ends at this many lengths over which it fades."""
NORMAL_MIRROR = 0.02
"""Share of upright light that water ice mirrors (Schlick's form of Fresnel's law)."""


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def _ramp(distance):
    """Share of a fine pixel inside an edge at a signed distance [fine pixels].

    The transition is as wide as a square pixel's (`EDGE_WIDTH`), and smooth at both ends.
    """
    inside = min(max(0.5 - distance / EDGE_WIDTH, 0.0), 1.0)
    return inside * inside * (3 - 2 * inside)


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def _outline(shape, nodes, turned, level):
    """Fill in the outline of the body and the direction of its surface there.

    Between two circles both change linearly. If each cone had a single colour, the picture would
    jump where its edges pass from one fine pixel to the next, and a fit would stop at such a jump.

    Parameters
    ----------
    shape : see `StoneModel.values`
    nodes : (NODES, 2) height and radius of the circles that bound its cones [m]
    turned : (NODES,) how far the surface is turned from upright, 0 to 1 within foot and bevel
    level : (NODES,) horizontal part of its normal, 0 to 1
    """
    radius, height = shape.radius, shape.height
    foot_inset, foot_height = shape.foot_inset, shape.foot_height
    bevel_height, bevel_inset = shape.bevel_height, shape.bevel_inset
    roundness, foot_roundness = shape.roundness, shape.foot_roundness
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
    # The more the surface is inclined, the closer its colour is to that of foot or bevel. The side
    # between them is vertical.
    turned[FOOT_STRIPS], turned[FOOT_STRIPS + 1] = 0.0, 0.0
    level[FOOT_STRIPS], level[FOOT_STRIPS + 1] = 1.0, 1.0
    for first, last, end, step in (
        (0, FOOT_STRIPS, 0, -1),
        (FOOT_STRIPS + 1, NODES - 1, NODES - 1, 1),
    ):
        most, before, level_before = 1e-12, 0.0, 1.0
        for n in range(last - first):
            k = first + n if step > 0 else last - 1 - n
            outward, upward = nodes[k + 1, 1] - nodes[k, 1], nodes[k + 1, 0] - nodes[k, 0]
            length = math.hypot(outward, upward) + 1e-12
            own, own_level = abs(outward) / length, upward / length
            if n > 0:
                at = k if step > 0 else k + 1
                turned[at] = 0.5 * (before + own)
                level[at] = 0.5 * (level_before + own_level)
            most, before, level_before = max(most, own), own, own_level
        turned[end], level[end] = before, level_before
        for k in range(first, last + 1):
            turned[k] /= most


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def _px_per_metre(dx, dy, z, scale):
    """Pixels per metre in a direction (dx, dy) at a height, from a window's scale."""
    length = math.sqrt(dx * dx + dy * dy) + 1e-12
    gu = dx * (scale[0, 0, 0] + z * scale[1, 0, 0]) + dy * (scale[0, 1, 0] + z * scale[1, 1, 0])
    gv = dx * (scale[0, 0, 1] + z * scale[1, 0, 1]) + dy * (scale[0, 1, 1] + z * scale[1, 1, 1])
    return length / math.sqrt(gu * gu + gv * gv)


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def _on_ice(ray_xy, rows, columns, i, j):
    """Point at which the line of sight of a fine pixel meets the ice [m]."""
    row, column = min(i // FINE, rows - 2), min(j // FINE, columns - 2)
    down, along = (i + 0.5) / FINE - 0.5 - row, (j + 0.5) / FINE - 0.5 - column
    a = row * columns + column
    x = ray_xy[a, 0] + along * (ray_xy[a + 1, 0] - ray_xy[a, 0])
    y = ray_xy[a, 1] + along * (ray_xy[a + 1, 1] - ray_xy[a, 1])
    x += down * (ray_xy[a + columns, 0] - ray_xy[a, 0])
    y += down * (ray_xy[a + columns, 1] - ray_xy[a, 1])
    return x, y


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def paint_body(x, y, shape, ray_xy, ray_slope, scale, rows, columns, planes):
    """Paint the body: the share of every fine pixel that each of its parts covers.

    Parameters
    ----------
    x, y : place of the stone, sheet frame [m]
    shape : see `StoneModel.values`
    ray_xy, ray_slope, scale, rows, columns : rays and size of a `PixelWindow`
    planes : (7, rows·FINE, columns·FINE), of which foot, side, bevel, top and light from one
        side are filled. The body's mirror image in the ice counts as foot and side
    """
    radius, height = shape.radius, shape.height
    nodes, turned = np.empty((NODES, 2)), np.empty(NODES)
    level, slopes = np.empty(NODES), np.zeros(NODES)
    _outline(shape, nodes, turned, level)
    for k in range(NODES - 1):
        rise = nodes[k + 1, 0] - nodes[k, 0]
        slopes[k] = (nodes[k + 1, 1] - nodes[k, 1]) / rise if rise > 1e-9 else 0.0
    widest = np.abs(scale[0]).max() + height * np.abs(scale[1]).max()
    reach = radius + widest
    top_z, top_r = nodes[NODES - 1, 0], nodes[NODES - 1, 1]
    surely_top = max(top_r - 2 * widest, 0.0)
    mirrored = shape.mirror > 0.0 or shape.gloss > 0.0
    aslant = shape.light_x != 0.0 or shape.light_y != 0.0
    for row in range(rows):
        for column in range(columns):
            i0, j0 = row * FINE, column * FINE
            lx, ly = ray_slope[row * columns + column, 0], ray_slope[row * columns + column, 1]
            fx, fy = ray_xy[row * columns + column, 0] - x, ray_xy[row * columns + column, 1] - y
            # Most pixels are all top or all ice and need no closer examination.
            ox, oy = fx + top_z * lx, fy + top_z * ly
            whole = 1.0 if ox * ox + oy * oy < surely_top * surely_top else 0.0
            c2 = lx * lx + ly * ly
            c1 = fx * lx + fy * ly
            z = min(max(-c1 / (c2 + 1e-12), -height), height)
            away = fx * fx + fy * fy + z * (2 * c1 + z * c2)
            if whole > 0.0 or away > (reach + 3 * widest) ** 2:
                for i in range(i0, i0 + FINE):
                    for j in range(j0, j0 + FINE):
                        for k in range(TOP):
                            planes[k, i, j] = 0.0
                        planes[TOP, i, j] = whole
                        planes[LIT, i, j] = 0.0
                continue
            for i in range(i0, i0 + FINE):
                for j in range(j0, j0 + FINE):
                    fx, fy = _on_ice(ray_xy, rows, columns, i, j)
                    fx, fy = fx - x, fy - y
                    c0, c1 = fx * fx + fy * fy, fx * lx + fy * ly
                    for k in range(TOP + 1):
                        planes[k, i, j] = 0.0
                    planes[LIT, i, j] = 0.0
                    # Point of the ray nearest to the stone's axis, within its height.
                    z = min(max(-c1 / (c2 + 1e-12), 0.0), height)
                    cover, seen, strip, z_nearest, upper_edge = 0.0, -1, 0, 0.0, 0.0
                    if c0 + z * (2 * c1 + z * c2) < reach * reach:
                        z, r = nodes[NODES - 1, 0], nodes[NODES - 1, 1]
                        above = c0 + z * (2 * c1 + z * c2) - r * r
                        nearest, r_nearest = 1e18, 1.0
                        seen, upper_edge = NODES - 1 if above <= 0 else -1, above
                        for k in range(NODES - 2, -1, -1):
                            z, r = nodes[k, 0], nodes[k, 1]
                            value = c0 + z * (2 * c1 + z * c2) - r * r
                            rise = nodes[k + 1, 0] - z
                            least, at = value, 0.0
                            if above < least:
                                least, at = above, 1.0
                            if rise > 1e-9:
                                second = c2 - slopes[k] * slopes[k]
                                first = c1 + c2 * z - slopes[k] * r
                                if second > 0 and first < 0 and -first < second * rise:
                                    at = -first / second
                                    least = value + first * at
                                    at /= rise
                            if seen < 0 and least <= 0:
                                seen, upper_edge = k, above
                            r += at * (nodes[k + 1, 1] - r)
                            if least < nearest * r:
                                nearest, r_nearest, strip = least / r, r, k
                                z_nearest = z + at * rise
                            if seen >= 0 and least < -widest * r:
                                break  # all of this fine pixel is inside the body
                            above = value
                        dx, dy = fx + z_nearest * lx, fy + z_nearest * ly
                        rho = math.sqrt(max(nearest * r_nearest + r_nearest * r_nearest, 0.0))
                        distance = (rho - r_nearest) * _px_per_metre(dx, dy, z_nearest, scale)
                        cover = _ramp(distance * FINE)
                    if cover > 0:
                        ox, oy = fx + top_z * lx, fy + top_z * ly
                        rho = math.sqrt(ox * ox + oy * oy)
                        top = cover
                        if rho > 0.2 * top_r:
                            top *= _ramp((rho - top_r) * _px_per_metre(ox, oy, top_z, scale) * FINE)
                        planes[TOP, i, j] = top
                        side = cover - top
                        if side > 0.0:
                            # Intersection of the ray with the visible cone, from above.
                            z = z_nearest
                            if seen >= 0:
                                strip = min(seen, NODES - 2)
                            upper, slope = nodes[strip + 1, 0], slopes[strip]
                            second = c2 - slope * slope
                            rise = upper - nodes[strip, 0]
                            if seen == NODES - 1:
                                z = top_z
                            elif seen >= 0 and upper_edge > 0.0 and rise > 1e-9:
                                first = c1 + c2 * upper - slope * nodes[strip + 1, 1]
                                root = first * first - second * upper_edge
                                if root > 0.0 and first + math.sqrt(root) > 1e-12:
                                    z = upper - upper_edge / (first + math.sqrt(root))
                            up = min(max(1.0 - (upper - z) / (rise + 1e-12), 0.0), 1.0)
                            share = turned[strip] + up * (turned[strip + 1] - turned[strip])
                            rounded = BEVEL if strip > FOOT_STRIPS else FOOT
                            planes[rounded, i, j] = side * share
                            planes[SIDE, i, j] = side * (1 - share)
                            if aslant:
                                dx, dy = fx + z * lx, fy + z * ly
                                towards = shape.light_x * dx + shape.light_y * dy
                                towards *= level[strip] + up * (level[strip + 1] - level[strip])
                                planes[LIT, i, j] = side * towards / (math.hypot(dx, dy) + 1e-9)
                    if cover < 1 and mirrored:
                        z = min(max(c1 / (c2 + 1e-12), 0.0), height)
                        if c0 - z * (2 * c1 - z * c2) < (reach + 2 * widest) ** 2:
                            image = 1e9
                            for q in range(MIRROR_NODES):
                                k = q * (NODES - 1) // (MIRROR_NODES - 1)
                                z, r = nodes[k, 0], nodes[k, 1]
                                dx, dy = fx - z * lx, fy - z * ly
                                square = dx * dx + dy * dy
                                if square > (r + 2 * widest) ** 2:
                                    continue  # more than a pixel away
                                if r > 2 * widest and square < (r - 2 * widest) ** 2:
                                    image = -1.0  # more than a pixel inside
                                    break
                                distance = math.sqrt(square) - r
                                image = min(image, distance * _px_per_metre(dx, dy, -z, scale))
                            if image < 1.0:  # the pebble spreads the mirror image
                                steep = 1.0 - 1.0 / math.sqrt(1.0 + c2)
                                share = NORMAL_MIRROR + (1.0 - NORMAL_MIRROR) * steep**5
                                share = shape.gloss + share * shape.mirror
                                share *= (1 - cover) * _ramp(0.5 * image)
                                planes[FOOT, i, j] += 0.5 * share
                                planes[SIDE, i, j] += 0.5 * share


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def paint_shade(x, y, shape, ray_xy, rows, columns, dark):
    """Paint the share of its light that the ice loses in every fine pixel, beside the body or not.

    Parameters
    ----------
    x, y, shape, ray_xy, rows, columns : as of `paint_body`
    dark : (rows·FINE, columns·FINE), filled
    """
    contact_from = shape.radius - 0.5 * shape.foot_inset
    contact_ends = contact_from + SHADE_REACH * shape.contact_reach
    shadow_ends = shape.shadow_radius + SHADE_REACH * shape.shadow_blur
    full_shadow = max(shape.shadow_radius - SHADE_REACH * shape.shadow_blur, 0.0)
    for i in range(rows * FINE):
        for j in range(columns * FINE):
            fx, fy = _on_ice(ray_xy, rows, columns, i, j)
            fx, fy = fx - x, fy - y
            light, square = 1.0, fx * fx + fy * fy
            if square < contact_from * contact_from:
                light -= shape.contact
            elif square < contact_ends * contact_ends:
                gap = (math.sqrt(square) - contact_from) / shape.contact_reach
                light -= shape.contact * math.exp(-gap * gap)
            dx, dy = fx - shape.shadow_x, fy - shape.shadow_y
            square = dx * dx + dy * dy
            if square < full_shadow * full_shadow:
                light *= 1 - shape.shadow
            elif square < shadow_ends * shadow_ends:
                beyond = (math.sqrt(square) - shape.shadow_radius) / shape.shadow_blur
                light *= 1 - shape.shadow * 0.5 * math.erfc(beyond * math.sqrt(0.5))
            dark[i, j] = 1 - light


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def paint_handle(x, y, theta, shape, ray_xy, ray_slope, scale, rows, columns, handle):
    """Paint the handle: the share of every fine pixel that it covers.

    Parameters
    ----------
    x, y, shape, ray_xy, ray_slope, scale, rows, columns : as of `paint_body`
    theta : heading of the stone [rad]
    handle : (rows·FINE, columns·FINE), filled
    """
    height = shape.height
    handle_z = height + shape.handle_rise
    cosine, sine = math.cos(theta), math.sin(theta)
    widest = np.abs(scale[0]).max() + handle_z * np.abs(scale[1]).max()
    back = shape.handle_back
    longest = max(shape.handle_front, back + shape.neck_length)
    half_width, play = 0.5 * shape.handle_width, 2 * widest
    collar, rise = shape.collar_radius + widest, shape.collar_rise
    for row in range(rows):
        for column in range(columns):
            i0, j0 = row * FINE, column * FINE
            lx, ly = ray_slope[row * columns + column, 0], ray_slope[row * columns + column, 1]
            fx = ray_xy[row * columns + column, 0] - x + height * lx
            fy = ray_xy[row * columns + column, 1] - y + height * ly
            # Does the ray pass near the bar or the collar, between top and handle?
            forward, aside = cosine * fx + sine * fy, cosine * fy - sine * fx
            ahead, beside = (
                shape.handle_rise * (cosine * lx + sine * ly),
                shape.handle_rise * (cosine * ly - sine * lx),
            )
            by_bar = (
                aside + min(beside, 0.0) < half_width + play
                and aside + max(beside, 0.0) > -half_width - play
                and forward + min(ahead, 0.0) < longest + play
                and forward + max(ahead, 0.0) > back - play
            )
            near = collar + widest + rise * (abs(lx) + abs(ly))
            by_collar = fx * fx + fy * fy < near * near
            if not by_bar and not by_collar:
                for i in range(i0, i0 + FINE):
                    for j in range(j0, j0 + FINE):
                        handle[i, j] = 0.0
                continue
            for i in range(i0, i0 + FINE):
                for j in range(j0, j0 + FINE):
                    fx, fy = _on_ice(ray_xy, rows, columns, i, j)
                    fx, fy = fx - x, fy - y
                    share = 0.0
                    for k in range(3 if by_collar else 0):
                        z = height + 0.5 * k * rise
                        dx, dy = fx + z * lx, fy + z * ly
                        square = dx * dx + dy * dy
                        if square < collar * collar:
                            distance = math.sqrt(square) - shape.collar_radius
                            distance *= _px_per_metre(dx, dy, z, scale) * FINE
                            share = max(share, _ramp(distance))
                    for k in range(GRIP_LEVELS + NECK_LEVELS if by_bar else 0):
                        if share >= 1.0:
                            break
                        front = shape.handle_front
                        z = handle_z - shape.handle_depth * k / (GRIP_LEVELS - 1)
                        if k >= GRIP_LEVELS:
                            front = back + shape.neck_length
                            up = (k - GRIP_LEVELS + 0.5) / NECK_LEVELS
                            z = height + max(shape.handle_rise - shape.handle_depth, 0.0) * up
                        dx, dy = fx + z * lx, fy + z * ly
                        forward, aside = cosine * dx + sine * dy, -sine * dx + cosine * dy
                        ahead = abs(forward - 0.5 * (back + front)) - 0.5 * (front - back)
                        beside = abs(aside) - half_width
                        if ahead < widest and beside < widest:
                            ahead *= _px_per_metre(cosine, sine, z, scale) * FINE
                            beside *= _px_per_metre(-sine, cosine, z, scale) * FINE
                            share = max(share, _ramp(ahead) * _ramp(beside))
                    handle[i, j] = share
