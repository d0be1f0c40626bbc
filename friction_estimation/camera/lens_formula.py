"""The formula of the lens, its inverse, and the compiled loops that follow rays through it.

`distort` is the one place where the formula stands; the loops below call its compiled form.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit  # pyright: ignore[reportMissingTypeStubs]

from curling_env.physics.compiled import compiled

CIRCLE_POINTS = 48
"""Points in which a circle is projected."""

SUMS_IN_ANY_ORDER = {"reassoc", "nsz", "contract", "arcp"}
"""The arithmetic that the compiler may reorder."""

# numba puts these into their callers before anything is optimised, as if written out there.
_inlined = njit(inline="always", error_model="numpy", fastmath=SUMS_IN_ANY_ORDER)


def distort(x: Any, y: Any, terms: Any) -> tuple[Any, Any]:
    """Return the place at which a lens shows a ray, in focal lengths from its axis.

    Parameters
    ----------
    x, y : place at which a lens without distortion would show it, numbers or arrays
    terms : (5,) in the order of `lens.TERMS`

    Source
    ------
    Brown, Decentering distortion of lenses (1966), in the form and the order of OpenCV.
    """
    k1, k2, p1, p2, k3 = terms
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
    )


_distort = _inlined(distort)


@_inlined
def _slopes(x, y, terms):
    """Derivatives of `distort`: of its x by x; of x by y, which is that of y by x; of y by y."""
    k1, k2, p1, p2, k3 = terms
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = k1 + r2 * (2 * k2 + 3 * r2 * k3)
    return (
        radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x,
        2 * x * y * slope + 2 * p1 * x + 2 * p2 * y,
        radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x,
    )


@_inlined
def undistort(xd, yd, terms, x, y):
    """The inverse of `distort` by Newton's method, begun at (x, y)."""
    for _ in range(12):
        found_x, found_y = _distort(x, y, terms)
        ex, ey = found_x - xd, found_y - yd
        if ex * ex + ey * ey < 1e-20:
            break
        a, b, d = _slopes(x, y, terms)
        det = a * d - b * b
        x -= (d * ex - b * ey) / det
        y -= (a * ey - b * ex) / det
    return x, y


@compiled
def project_points(points, matrix, terms, px):
    """Fill in where points are seen; NaN for those behind the camera.

    Parameters
    ----------
    points : (n, 3) in the camera's frame [m]
    matrix, terms : (3, 3) camera matrix [px] and (5,) distortion of the lens
    px : (n, 2) columns and rows
    """
    fx, skew, cx = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    fy, cy = matrix[1, 1], matrix[1, 2]
    for i in range(points.shape[0]):
        depth = points[i, 2]
        xd, yd = _distort(points[i, 0] / depth, points[i, 1] / depth, terms)
        px[i, 0], px[i, 1] = fx * xd + skew * yd + cx, fy * yd + cy
        if depth <= 0:
            px[i, 0], px[i, 1] = np.nan, np.nan


@compiled(fastmath=SUMS_IN_ANY_ORDER)
def bounds_of_circles(x, y, circles, matrix, terms, rotation, translation, bounds):
    """Fill in the rectangle of pixels that level circles about an upright axis reach.

    Parameters
    ----------
    x, y : the axis, sheet frame [m]
    circles : (n, 2) radius and height of each [m]
    matrix, terms : (3, 3) camera matrix [px] and (5,) distortion of the lens
    rotation, translation : the camera's pose, (3, 3) and (3,) [m]
    bounds : (2, 2) lowest and highest column and row; NaN where a circle is behind the camera
    """
    fx, skew, cx = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    fy, cy = matrix[1, 1], matrix[1, 2]
    bounds[0] = np.inf
    bounds[1] = -np.inf
    for step in range(CIRCLE_POINTS):
        cosine = math.cos(2 * math.pi * step / CIRCLE_POINTS)
        sine = math.sin(2 * math.pi * step / CIRCLE_POINTS)
        for k in range(circles.shape[0]):
            a, b, c = x + circles[k, 0] * cosine, y + circles[k, 0] * sine, circles[k, 1]
            depth = rotation[2, 0] * a + rotation[2, 1] * b + rotation[2, 2] * c + translation[2]
            if depth <= 0:
                bounds[:] = np.nan
                return
            u = rotation[0, 0] * a + rotation[0, 1] * b + rotation[0, 2] * c + translation[0]
            v = rotation[1, 0] * a + rotation[1, 1] * b + rotation[1, 2] * c + translation[1]
            ud, vd = _distort(u / depth, v / depth, terms)
            column, row = fx * ud + skew * vd + cx, fy * vd + cy
            bounds[0, 0], bounds[1, 0] = min(bounds[0, 0], column), max(bounds[1, 0], column)
            bounds[0, 1], bounds[1, 1] = min(bounds[0, 1], row), max(bounds[1, 1], row)


@compiled(fastmath=SUMS_IN_ANY_ORDER)
def rays_of_pixels(left, top, shape, matrix, terms, rotation, position, ray_xy, ray_slope):
    """Fill in the rays of a rectangle of pixels, row by row.

    Parameters
    ----------
    left, top : column and row of its upper left pixel
    shape : rows and columns
    matrix, terms : (3, 3) camera matrix [px] and (5,) distortion of the lens
    rotation, position : the camera's rotation (3, 3), and its place in the sheet frame (3,) [m]
    ray_xy : (rows·columns, 2) point at which each ray meets the ice [m]
    ray_slope : (rows·columns, 2) sideways shift of the ray per metre of height
    """
    fx, skew, cx = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    fy, cy = matrix[1, 1], matrix[1, 2]
    rows, columns = shape
    x, y = 0.0, 0.0
    for row in range(rows):
        yd = (top + row - cy) / fy
        for column in range(columns):
            xd = (left + column - cx - skew * yd) / fx
            if column == 0:
                x, y = xd, yd
            x, y = undistort(xd, yd, terms, x, y)
            gx = rotation[0, 0] * x + rotation[1, 0] * y + rotation[2, 0]
            gy = rotation[0, 1] * x + rotation[1, 1] * y + rotation[2, 1]
            gz = rotation[0, 2] * x + rotation[1, 2] * y + rotation[2, 2]
            i = row * columns + column
            ray_slope[i, 0], ray_slope[i, 1] = gx / gz, gy / gz
            ray_xy[i, 0] = position[0] - position[2] * gx / gz
            ray_xy[i, 1] = position[1] - position[2] * gy / gz
