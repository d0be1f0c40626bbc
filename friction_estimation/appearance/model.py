"""Shape of a stone in a picture, and the rectangle of pixels in which it is painted.

The body is a solid of revolution with a rounded foot, a side, a rounded bevel and a flat top. The
handle is a bar above the top, on a round collar. Each part has a colour, and along a rounded part
the colour changes gradually to that of the next. The shadow of the stone and its mirror image in
the ice belong to its picture. The share of a pixel that each part covers is computed from signed
distances and blurred by the camera's point spread, so that a picture is linear in the colours.
"""

from __future__ import annotations

import math
from collections import namedtuple
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from curling_env.typing import Flags, Floats
from friction_estimation.camera.camera import Camera

CIRCLE = np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 48, endpoint=False)])
"""Points of a circle that are projected."""


@dataclass(frozen=True, kw_only=True)
class StoneModel:
    """Shape of a stone and the blur of its camera.

    Parameters
    ----------
    radius : largest radius of the body [m]
    height : height of the flat top above the ice [m]
    foot_inset : largest radius minus the radius on the ice [m]
    foot_height : height at which the side begins [m]
    bevel_height : height of the bevel, from the end of the side to the flat top [m]
    bevel_inset : largest radius minus that of the flat top [m]
    handle_rise : height of the handle's upper face above the flat top [m]
    handle_back, handle_front : ends of the handle along the heading, from the stone's axis [m]
    handle_width : width of the handle [m]
    blur_px : standard deviation of the point spread in brightness [px]
    colour_blur_px : the same in colour, which films store at half the resolution [px]
    shadow_x, shadow_y : centre of the shadow on the ice, relative to the stone's centre [m]
    shadow_radius, shadow_blur : radius and softness of the shadow [m]
    handle_depth : vertical thickness of the handle, downward from its upper face [m]
    shadow : share of the light that the shadow takes from the ice
    roundness, foot_roundness : exponents of the superellipses of bevel and foot; 1 is a straight
        cone, 2 a quarter of an ellipse
    contact : share of the light that the ice next to the stone's foot loses
    contact_reach : distance over which that darkness fades [m]
    mirror : strength of the stone's mirror image, relative to that in smooth ice
    gloss : share of light that the ice also mirrors, however steep the view: it hides lamps,
        which are brighter than walls
    neck_length : length along the heading of the post that carries the handle's back end [m]
    collar_radius, collar_rise : radius and height of the handle's round base on the flat top [m]
    light_x, light_y : how much brighter the side is that faces along x and y, as a share of the
        side's brightness
    """

    radius: float
    height: float
    foot_inset: float = 0.07
    foot_height: float = 0.025
    bevel_height: float = 0.025
    bevel_inset: float = 0.04
    handle_rise: float = 0.045
    handle_back: float = -0.03
    handle_front: float = 0.11
    handle_width: float = 0.03
    blur_px: float = 0.6
    colour_blur_px: float = 1.0
    shadow_x: float = 0.0
    shadow_y: float = 0.0
    shadow_radius: float = 0.15
    shadow_blur: float = 0.02
    shadow: float = 0.0
    handle_depth: float = 0.02
    roundness: float = 2.0
    contact: float = 0.0
    contact_reach: float = 0.04
    mirror: float = 0.0
    collar_radius: float = 0.03
    collar_rise: float = 0.008
    foot_roundness: float = 2.0
    neck_length: float = 0.02
    light_x: float = 0.0
    light_y: float = 0.0
    gloss: float = 0.0

    @cached_property
    def values(self) -> ShapeValues:
        """All parameters by name, as kernels read them."""
        return ShapeValues(**{name: float(getattr(self, name)) for name in ShapeValues._fields})

    def outline_px(self, camera: Camera, xy: ArrayLike) -> Floats:
        """Points on the body's outline in the raw image, (n, 2) [px], as a convex polygon."""
        import cv2

        px = self._rings_px(camera, xy)
        hull = px if len(px) == 0 else cv2.convexHull(px.astype(np.float32)).reshape(-1, 2)
        return hull.astype(np.float64)

    def extent_px(self, camera: Camera, xy: ArrayLike) -> Floats:
        """Corners of the rectangle around the outline, (2, 2) [px]; (0, 2) if it is not in view."""
        px = self._rings_px(camera, xy)
        return px if len(px) == 0 else np.array([px.min(axis=0), px.max(axis=0)])

    def _rings_px(self, camera: Camera, xy: ArrayLike) -> Floats:
        """Points on the circles that bound the body's image, (n, 2) [px]; none behind a camera."""
        rings = self._rings
        points = np.empty((len(rings), len(CIRCLE), 3))
        points[:, :, :2] = np.asarray(xy) + rings[:, :1, None] * CIRCLE
        points[:, :, 2] = rings[:, 1:]
        px = camera.project(points.reshape(-1, 3))
        return px if np.isfinite(px).all() else np.empty((0, 2))

    @cached_property
    def _rings(self) -> Floats:
        """Radius and height of the circles that bound the body's image, (4, 2) [m]."""
        return np.array(
            [
                (self.radius - self.foot_inset, 0.0),
                (self.radius, self.foot_height),
                (self.radius, self.height - self.bevel_height),
                (self.radius - self.bevel_inset, self.height),
            ]
        )


ShapeValues = namedtuple("ShapeValues", [field.name for field in fields(StoneModel)])


@dataclass(frozen=True, kw_only=True, eq=False)
class PixelWindow:
    """A rectangle of pixels, and the line of sight of each of them.

    Parameters
    ----------
    origin_px : column and row of the upper left pixel
    shape : rows and columns
    ray_xy : (rows·columns, 2) point at which each pixel's ray meets the ice [m]
    ray_slope : (rows·columns, 2) sideways shift of the ray per metre of height
    scale : (2, 2, 2) derivatives d(x, y)/d(u, v) at the centre: on the ice [m/px], and their change
        per metre of height [1/px]
    """

    origin_px: tuple[int, int]
    shape: tuple[int, int]
    ray_xy: Floats
    ray_slope: Floats
    scale: Floats

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns of the window in the image."""
        (u, v), (rows, columns) = self.origin_px, self.shape
        return slice(v, v + rows), slice(u, u + columns)

    def seen_by(self, camera: Camera) -> PixelWindow | None:
        """Return the same pixels with the lines of sight of another camera."""
        (u, v), (rows, columns) = self.origin_px, self.shape
        corners = np.array([[u, v], [u + columns - 1, v + rows - 1]], dtype=np.float64)
        return window_at(camera, corners, 0.0)

    def cut(self, inside: Flags) -> PixelWindow:
        """Return the rectangle of the flags (rows, columns) that are set."""
        rows, columns = np.nonzero(inside)
        return replace(
            self,
            origin_px=(self.origin_px[0] + int(columns[0]), self.origin_px[1] + int(rows[0])),
            shape=(int(np.ptp(rows)) + 1, int(np.ptp(columns)) + 1),
            ray_xy=self.ray_xy[inside.ravel()],
            ray_slope=self.ray_slope[inside.ravel()],
        )


def window_at(camera: Camera, outline_px: Floats, margin_px: float) -> PixelWindow | None:
    """Return the window around an outline, cut to the image; None if it is outside the image."""
    if len(outline_px) == 0:
        return None
    low, high = outline_px.min(axis=0).tolist(), outline_px.max(axis=0).tolist()
    u0, v0 = (max(math.floor(edge - margin_px), 0) for edge in low)
    u1, v1 = (
        min(math.ceil(edge + margin_px), size - 1)
        for edge, size in zip(high, camera.size, strict=True)
    )
    if u1 - u0 < 3 or v1 - v0 < 3:
        return None
    rows, columns = v1 - v0 + 1, u1 - u0 + 1
    v, u = np.mgrid[v0 : v1 + 1, u0 : u1 + 1].reshape(2, -1)
    rays = camera.rays(np.column_stack([u, v]))
    ray_slope = np.ascontiguousarray(rays[:, :2] / rays[:, 2:])
    ray_xy = camera.position[:2] - camera.position[2] * ray_slope
    scale = np.empty((2, 2, 2))
    middle = (rows // 2) * columns + columns // 2
    for level, values in enumerate((ray_xy, ray_slope)):
        scale[level, :, 0] = (values[middle + 1] - values[middle - 1]) / 2
        scale[level, :, 1] = (values[middle + columns] - values[middle - columns]) / 2
    return PixelWindow(
        origin_px=(u0, v0), shape=(rows, columns), ray_xy=ray_xy, ray_slope=ray_slope, scale=scale
    )
