"""Compiled sums of the fits: a step of a stone's pose, robust misfits, normal equations."""

from __future__ import annotations

import numpy as np

from curling_env.physics.compiled import compiled
from friction_estimation.appearance.shape import (
    SUMS_IN_ANY_ORDER,
)

PIXELS_AT_ONCE = 256
"""Number of pixels whose normal equations are summed at once."""


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def pose_step(
    picture,
    behind,
    seen,
    slow,
    turn,
    px,
    noise,
    outlier_at,
    size,
    pull,
    step,
    covariance,
    totals,
):
    """One Gauss-Newton step of a stone's place and heading in one window.

    Parameters
    ----------
    picture, behind : (n, 3) channels of the frame and of the ice
    seen : (5, 3, rows, columns) coloured planes, blurred, with their derivatives by shift
    slow : (5, 3, rows, columns) derivative of the same by the heading, values only
    turn : heading less that of the painting [rad]
    px : (2, 2) pixels per metre on the ice
    noise : (3,) standard deviation of each channel
    outlier_at : residual at which a pixel counts a quarter [standard deviations]
    size : number of parameters: 3, or 2 for a stone without a heading
    pull : (2,) by how much the heading is expected to be greater [rad], and the weight of that
    step, covariance : (3,) and (3, 3), filled, as if pixels were independent
    totals : (5,), filled: sums of weighted squares, of weights, of the stone's pixels and of those
        that are visible, and the squared standard errors that the step gains
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
    xx, yy, tt = 1.0001 * xx + 1e-6, 1.0001 * yy + 1e-6, 1.0001 * ntt + 1e-6 + pull[1]
    rt += pull[1] * pull[0]
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


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def robust_misfit(picture, behind, seen, noise, outlier_at):
    """Robust sum of squared residuals of a stone's picture [standard deviations].

    It saturates where residuals are large.

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


@compiled(allocates=True, fastmath=SUMS_IN_ANY_ORDER)
def normal_equations(jacobian, residual, weight, normal, right):
    """Fill the normal equations of a weighted least-squares problem.

    Explicit loops, because a threaded library call on such slim matrices mostly waits for its
    threads, and many derivatives are zero in some channels.

    Parameters
    ----------
    jacobian : (m, 3, n) derivatives of residuals by m parameters; they are weighted in place
    residual : (3, n), weighted in place
    weight : (n,) of the pixels
    normal, right : (m, m) and (m,)
    """
    m, n = jacobian.shape[0], jacobian.shape[2]
    root, active = np.sqrt(weight), np.empty(m, np.int64)
    normal[:], right[:] = 0.0, 0.0
    for channel in range(3):
        left = residual[channel]
        for i in range(n):
            left[i] *= root[i]
        count = 0
        for p in range(m):
            own, total, size = jacobian[p, channel], 0.0, 0.0
            for i in range(n):
                own[i] *= root[i]
                total += own[i] * left[i]
                size += abs(own[i])
            if size > 0.0:
                right[p] += total
                active[count] = p
                count += 1
        # Few enough pixels for repeatedly read data to stay in the fastest memory.
        for start in range(0, n, PIXELS_AT_ONCE):
            end = min(start + PIXELS_AT_ONCE, n)
            for a in range(count):
                p = active[a]
                own = jacobian[p, channel, start:end]
                for b in range(0, a + 1, 4):
                    # The last ones may be computed twice.
                    q0, q1 = active[b], active[min(b + 1, a)]
                    q2, q3 = active[min(b + 2, a)], active[min(b + 3, a)]
                    one, two = jacobian[q0, channel, start:end], jacobian[q1, channel, start:end]
                    three = jacobian[q2, channel, start:end]
                    four = jacobian[q3, channel, start:end]
                    t0, t1, t2, t3 = 0.0, 0.0, 0.0, 0.0
                    for i in range(end - start):
                        t0 += own[i] * one[i]
                        t1 += own[i] * two[i]
                        t2 += own[i] * three[i]
                        t3 += own[i] * four[i]
                    normal[p, q0] += t0
                    if b + 1 <= a:
                        normal[p, q1] += t1
                    if b + 2 <= a:
                        normal[p, q2] += t2
                    if b + 3 <= a:
                        normal[p, q3] += t3
    for p in range(m):
        for q in range(p):
            normal[q, p] = normal[p, q]
