"""Compiled step of the fit of a stone's pose."""

from __future__ import annotations

from curling_env.physics.compiled import compiled
from friction_estimation.appearance.shape import SUMS_IN_ANY_ORDER


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
