"""Drawing of stones into a picture: their bodies, their shadows and their mirror images in the
ice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats, Singles
from friction_estimation.camera.camera import Camera
from friction_estimation.synthetic.ray_tracing import StoneOnIce, StoneShape, trace
from friction_estimation.synthetic.sheet_drawing import Light, PixelRays
from friction_estimation.synthetic.tuning import (
    LAMP_DIRECTIONS,
    LARGE_STONE_PIXELS,
    LARGE_STONE_SAMPLES,
    SHADOW_REACH,
    SMALL_STONE_SAMPLES,
)


@dataclass(frozen=True, kw_only=True)
class PixelBox:
    """Rectangle of pixels; `bottom` and `right` are excluded."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Return rows and columns of the box in an image."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    @property
    def empty(self) -> bool:
        """Return whether the box has no pixels."""
        return self.bottom <= self.top or self.right <= self.left

    def meets(self, other: PixelBox) -> bool:
        """Return whether the two boxes share a pixel."""
        return (
            self.top < other.bottom
            and other.top < self.bottom
            and self.left < other.right
            and other.left < self.right
        )

    def joined(self, other: PixelBox) -> PixelBox:
        """Return the smallest box around both boxes."""
        return PixelBox(
            top=min(self.top, other.top),
            bottom=max(self.bottom, other.bottom),
            left=min(self.left, other.left),
            right=max(self.right, other.right),
        )


def box_around(camera: Camera, points: Floats, margin_px: float = 2.0) -> PixelBox:
    """Return the box around points (n, 3) of the sheet frame, cut at the edges of the image."""
    px = camera.project(points)
    width, height = camera.size
    if not np.isfinite(px).all():
        return PixelBox(top=0, bottom=0, left=0, right=0)
    low, high = px.min(axis=0) - margin_px, px.max(axis=0) + margin_px
    left, top = np.clip(np.floor(low), 0, (width, height)).astype(int)
    right, bottom = np.clip(np.ceil(high) + 1, 0, (width, height)).astype(int)
    return PixelBox(top=int(top), bottom=int(bottom), left=int(left), right=int(right))


def stone_box(camera: Camera, shape: StoneShape, stone: StoneOnIce, reach: float = 0.0) -> PixelBox:
    """Return the box of pixels that a stone and the ice within `reach` of it [m] may touch."""
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    # The polygon is a little larger, so that its sides lie outside the circle.
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * 1.04
    centre = np.array([stone.x, stone.y])
    points = np.concatenate(
        [
            np.column_stack([centre + (shape.radius + reach) * ring, np.zeros(12)]),
            np.column_stack([centre + shape.radius * ring, np.full(12, shape.crown)]),
        ]
    )
    return box_around(camera, points)


def draw_stones(
    picture: NDArray[np.float32],
    rays: PixelRays,
    box: PixelBox,
    stones: Sequence[StoneOnIce],
    shape: StoneShape,
    *,
    light: Light,
    speckle: Singles,
    exposure: float = 0.0,
) -> Singles:
    """Draw stones into a box of pixels of a picture of the ice, in place.

    Parameters
    ----------
    picture : (box height, box width, 3) the box without the stones, 0 to 255; drawn into
    rays : the lines of sight of the camera's pixels
    box : place of `picture` in the image
    stones : the stones to draw
    shape : their solid shape
    light : lighting
    speckle : (65536,) unit-variance texture of the granite
    exposure : exposure time, centred on the moment of the frame; it blurs moving stones [s]

    Returns
    -------
    the share of each pixel that the stones cover, (box height, box width)
    """
    rows, columns = np.mgrid[box.slices[0], box.slices[1]].reshape(2, -1)
    single = rays.within(rows, columns, 1)
    # This is a copy if the box is part of a larger picture; it is written back below.
    flat = picture.reshape(-1, 3)
    _shade_ice(flat, rays.camera, single[0], stones, shape, light, speckle, picture.shape)

    # Only pixels near a body are traced with many samples.
    near = np.zeros(len(rows), dtype=bool)
    inner = [stone_box(rays.camera, shape, stone) for stone in stones]
    for b in inner:
        near |= (rows >= b.top) & (rows < b.bottom) & (columns >= b.left) & (columns < b.right)
    cover = np.zeros(len(rows), dtype=np.float32)
    if near.any():
        large = near.sum() > LARGE_STONE_PIXELS
        n = LARGE_STONE_SAMPLES if large else SMALL_STONE_SAMPLES
        fine = rays.within(rows[near], columns[near], n)
        moments = _schedule(n) * exposure
        colour = np.zeros((*fine.shape[:2], 3), dtype=np.float32)
        nearest = np.full(fine.shape[:2], np.inf, dtype=np.float32)
        hit = np.zeros(fine.shape[:2], dtype=bool)
        for stone in stones:
            trace(rays.camera.position, fine, stone, shape, moments, speckle, colour, nearest, hit)
        cover[near] = hit.mean(axis=0, dtype=np.float32)
        flat[near] = flat[near] * (1.0 - cover[near, None]) + colour.mean(axis=0)
    picture[...] = flat.reshape(picture.shape)
    return cover.reshape(picture.shape[:2])


def _schedule(n: int) -> Floats:
    """Return moments of n × n samples within the exposure, (n²,), from -½ to ½; n is divisible by
    four.

    They form a magic square: all rows and columns have the same mean, so that motion blurs a stone
    but does not shift it.
    """
    i, j = np.mgrid[:n, :n]
    order = np.arange(n * n).reshape(n, n)
    keep = ((i % 4 == j % 4) | ((i % 4) + (j % 4) == 3)).astype(bool)
    order = np.where(keep, n * n - 1 - order, order)
    return ((order + 0.5) / (n * n) - 0.5).ravel()


# --- the shadow and the mirror image in the ice ------------------------------------------------


def _shade_ice(
    flat: Singles,
    camera: Camera,
    rays: Floats,
    stones: Sequence[StoneOnIce],
    shape: StoneShape,
    light: Light,
    speckle: Singles,
    size: tuple[int, ...],
) -> None:
    """Draw the shadows and mirror images of stones on the ice around them, in place."""
    position = camera.position
    along = -position[2] / np.minimum(rays[:, 2], -1e-9)
    ice = position[:2] + along[:, None] * rays[:, :2]
    for stone in stones:
        x, y = ice[:, 0] - stone.x, ice[:, 1] - stone.y
        gap = np.maximum(np.hypot(x, y) - 0.8 * shape.radius, 0.0)
        dark = light.shadow * np.exp(-((gap / 0.05) ** 2))
        for lx, ly, lz in LAMP_DIRECTIONS:
            # The shadow of the body's middle, with a wide penumbra because the lamps are long.
            reach = 0.5 * shape.height / lz
            away = np.hypot(x + reach * lx, y + reach * ly) / (shape.radius + 0.03)
            dark = dark + 0.25 * light.shadow * np.exp(-(away**4) / 1.5)
        edge = np.clip((shape.radius + SHADOW_REACH - np.hypot(x, y)) / 0.08, 0.0, 1.0)
        flat *= (1.0 - np.minimum(dark, 0.9) * edge).astype(np.float32)[:, None]
    if light.gloss == 0:
        return
    # The mirror image is what a camera mirrored below the ice would see.
    below = position * [1.0, 1.0, -1.0]
    upward = (rays * [1.0, 1.0, -1.0])[None]
    colour = np.zeros((1, len(flat), 3), dtype=np.float32)
    nearest = np.full((1, len(flat)), np.inf, dtype=np.float32)
    hit = np.zeros((1, len(flat)), dtype=bool)
    for stone in stones:
        trace(below, upward, stone, shape, np.zeros(1), speckle, colour, nearest, hit)
    if not hit.any():
        return
    sin_elevation = -rays[:, 2] / np.linalg.norm(rays, axis=1)
    fresnel = light.gloss * (0.02 + 0.98 * (1.0 - sin_elevation) ** 5)
    # Pebble blurs the image; a mean over three by three pixels imitates that.
    mirrored = np.concatenate([colour[0], hit[0].astype(np.float32)[:, None]], axis=1)
    mirrored = cv2.blur(mirrored.reshape(size[0], size[1], 4), (3, 3)).reshape(-1, 4)
    share = fresnel.astype(np.float32)[:, None]
    flat += share * (mirrored[:, :3] - mirrored[:, 3:] * flat)
