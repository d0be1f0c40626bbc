"""Drawing of the empty sheet as a camera sees it: paint, ice, hall and light.

The colour of a pixel is the mean over samples within its square. The rays through the corners of
all pixels come from the exact inverse of the lens; those in between are interpolated linearly, with
errors below a thousandth of a pixel. A sample on an edge is covered in part, according to
its own footprint on the ice, so that lines much thinner than a pixel get the right mean colour.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import (
    BACK_LINE_Y,
    HACK_Y,
    HOG_LINE_WIDTH,
    HOG_LINE_Y,
    LINE_WIDTH,
    RING_RADII,
    TEE_Y,
    Sheet,
)
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.synthetic.tuning import (
    BUMPER_WIDTH,
    LAMP_HEIGHT,
    LAMP_POSITIONS,
    PEBBLE_CELL,
    PIXELS_AT_ONCE,
    SHEET_SAMPLES,
)


@dataclass(frozen=True, kw_only=True)
class Palette:
    """Colours of the still picture, blue-green-red, 0 to 255."""

    ice: tuple[float, float, float] = (226, 221, 214)
    outer_ring: tuple[float, float, float] = (176, 96, 34)
    inner_ring: tuple[float, float, float] = (52, 44, 196)
    hog_line: tuple[float, float, float] = (44, 36, 182)
    line: tuple[float, float, float] = (96, 74, 66)
    hack: tuple[float, float, float] = (38, 36, 36)
    bumper: tuple[float, float, float] = (74, 52, 38)
    floor: tuple[float, float, float] = (66, 62, 60)


PALETTE = Palette()


@dataclass(frozen=True, kw_only=True)
class Light:
    """Lighting of the hall and response of the sensor.

    Parameters
    ----------
    vignette : share of the light that is lost in the image's corners
    gradient : relative difference in brightness between the image's left and right edges
    gloss : strength of mirror images in the ice, 0 to 1
    pebble : relative standard deviation of the pebbled ice's brightness
    shadow : darkness of the shadow at a stone's foot, 0 to 1
    flicker : relative standard deviation of a frame's brightness
    """

    vignette: float = 0.18
    gradient: float = 0.06
    gloss: float = 0.6
    pebble: float = 0.012
    shadow: float = 0.4
    flicker: float = 0.002


@dataclass(frozen=True, kw_only=True, eq=False)
class PixelRays:
    """Lines of sight of a camera's pixels.

    Parameters
    ----------
    camera : the camera
    corners : (height + 1, width + 1, 3) directions of the rays through the pixels' corners, sheet
        frame; pixel (row, column) is between the corners (row, column) and (row + 1, column + 1)
    """

    camera: Camera
    corners: Floats = field(repr=False)

    @classmethod
    def of(cls, camera: Camera) -> PixelRays:
        """Make the rays of all pixels of a camera; pixel centres have integer coordinates."""
        width, height = camera.size
        u, v = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
        rays = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1))
        return cls(camera=camera, corners=rays.reshape(height + 1, width + 1, 3))

    @cached_property
    def ice(self) -> Floats:
        """Return the points where the corners' rays meet the ice, (height + 1, width + 1, 2) [m];
        NaN if nowhere.
        """
        position = self.camera.position
        down = np.where(self.corners[..., 2] < -1e-6, self.corners[..., 2], np.nan)
        return position[:2] - self.corners[..., :2] * (position[2] / down)[..., None]

    def within(self, rows: NDArray[np.intp], columns: NDArray[np.intp], n: int) -> Floats:
        """Return rays of n × n samples in each of m pixels, row by row, (n², m, 3)."""
        weights = sample_weights(n)
        corners = self.corners
        return (
            weights[:, 0, None, None] * corners[rows, columns]
            + weights[:, 1, None, None] * corners[rows, columns + 1]
            + weights[:, 2, None, None] * corners[rows + 1, columns]
            + weights[:, 3, None, None] * corners[rows + 1, columns + 1]
        )


def sample_weights(n: int) -> Floats:
    """Return weights of a pixel's four corners, row by row, in each of its n × n samples, (n²,
    4).
    """
    at = (np.arange(n) + 0.5) / n
    v, u = (grid.ravel() for grid in np.meshgrid(at, at, indexing="ij"))
    return np.stack([(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v], axis=1)


def paint_sheet(
    rays: PixelRays,
    sheet: Sheet,
    *,
    light: Light,
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Return the empty sheet, (height, width, 3) BGR, 0 to 255 and not rounded.

    Parameters
    ----------
    rays : the lines of sight of the camera's pixels
    sheet : the ice
    light : lighting
    rng : generator for the ice's texture
    """
    width, height = rays.camera.size
    texture = pebble_texture(rng)
    ice = rays.ice
    reach = np.array([sheet.width / 2 + BUMPER_WIDTH, sheet.length / 2 + BUMPER_WIDTH]) + 0.05
    near = np.asarray((np.abs(ice) < reach).all(axis=2), dtype=np.uint8)
    # A pixel is painted in detail if a corner of it or of a neighbour is on or next to the ice.
    painted = cv2.dilate(near, np.ones((4, 4), np.uint8))[:height, :width] > 0
    picture = np.empty((height, width, 3), dtype=np.float32)
    picture[:] = _hall(ice[:height, :width], sheet, texture)
    rows, columns = np.nonzero(painted)
    for start in range(0, len(rows), PIXELS_AT_ONCE):
        part = slice(start, start + PIXELS_AT_ONCE)
        picture[rows[part], columns[part]] = _painted(
            rays, rows[part], columns[part], sheet, texture, light
        )
    picture *= _lens_light(rays.camera, light)[..., None]
    return picture


def pebble_texture(rng: np.random.Generator) -> NDArray[np.float32]:
    """Return a periodic texture of unit variance, (1024, 1024) cells of side `PEBBLE_CELL`."""
    texture, after = _texture_after(json.dumps(rng.bit_generator.state))
    rng.bit_generator.state = after
    return texture


@lru_cache(maxsize=4)
def _texture_after(state: str) -> tuple[NDArray[np.float32], Mapping[str, Any]]:
    """Return a texture and the generator's state after it; films of one seed share both."""
    rng, size = np.random.default_rng(), 1024
    rng.bit_generator.state = json.loads(state)
    total = np.zeros((size, size), dtype=np.float32)
    for blur, share in ((0.9, 0.75), (5.0, 0.5), (40.0, 0.45)):
        margin = int(4 * blur) + 1
        grain = rng.standard_normal((size, size), dtype=np.float32)
        padded = np.pad(grain, margin, mode="wrap")
        smooth = cv2.GaussianBlur(padded, (0, 0), blur)[margin:-margin, margin:-margin]
        total += share * smooth / smooth.std()
    texture = total / total.std()
    texture.flags.writeable = False
    return texture, rng.bit_generator.state


def _lookup(texture: NDArray[np.float32], x: Floats, y: Floats) -> NDArray[np.float32]:
    size = len(texture)
    row = np.floor(y / PEBBLE_CELL).astype(np.int64) % size
    column = np.floor(x / PEBBLE_CELL).astype(np.int64) % size
    return texture[row, column]


def _hall(ice: Floats, sheet: Sheet, texture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the floor around the sheet, with one sample per pixel; it is dark above the
    horizon.
    """
    x, y = np.nan_to_num(ice[..., 0], nan=1e3), np.nan_to_num(ice[..., 1], nan=1e3)
    beyond = np.hypot(
        np.maximum(np.abs(x) - sheet.width / 2, 0.0), np.maximum(np.abs(y) - sheet.length / 2, 0.0)
    )
    fade = 0.45 + 0.55 * np.exp(-((beyond / 5.0) ** 2))
    grain = 1.0 + 0.025 * _lookup(texture, np.clip(x, -99, 99), np.clip(y, -99, 99))
    shade = (fade * grain).astype(np.float32)
    return np.asarray(PALETTE.floor, dtype=np.float32) * shade[..., None]


class _Brush:
    """Painter of areas over the samples of m pixels, in proportion to the cover of each sample."""

    def __init__(self, colour: NDArray[np.float32], shape: tuple[int, ...]) -> None:
        self.picture = np.empty((*shape, 3), dtype=np.float32)
        self.picture[:] = colour

    def lay(self, colour: tuple[float, float, float], cover: Floats) -> None:
        touched = cover > 0
        if touched.any():
            share = cover[touched].astype(np.float32)[:, None]
            self.picture[touched] += share * (
                np.asarray(colour, dtype=np.float32) - self.picture[touched]
            )


def _inside(distance: Floats, footprint: Floats) -> Floats:
    """Return the share of a sample on the positive side of an edge."""
    return np.clip(0.5 + distance / footprint, 0.0, 1.0)


def _painted(
    rays: PixelRays,
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    sheet: Sheet,
    texture: NDArray[np.float32],
    light: Light,
) -> NDArray[np.float32]:
    """Return mean colours of m pixels on the ice and next to it, (m, 3)."""
    position = rays.camera.position
    d = rays.within(rows, columns, SHEET_SAMPLES)
    along = -position[2] / np.minimum(d[..., 2], -1e-9)
    x, y = position[0] + along * d[..., 0], position[1] + along * d[..., 1]
    ice = rays.ice
    du = (ice[rows, columns + 1] - ice[rows, columns]) / SHEET_SAMPLES
    dv = (ice[rows + 1, columns] - ice[rows, columns]) / SHEET_SAMPLES
    # Footprint of one sample across and along the sheet [m].
    wx = np.nan_to_num(np.abs(du[:, 0]) + np.abs(dv[:, 0]), nan=1.0) + 1e-9
    wy = np.nan_to_num(np.abs(du[:, 1]) + np.abs(dv[:, 1]), nan=1.0) + 1e-9

    brush = _Brush(np.asarray(PALETTE.ice, dtype=np.float32), x.shape)
    end = np.where(y < 0, -1.0, 1.0)
    from_tee = y - end * TEE_Y
    r = np.hypot(x, from_tee)
    if (r < RING_RADII[0] + 1.0).any():
        cx, cy = x / np.maximum(r, 1e-9), from_tee / np.maximum(r, 1e-9)
        wr = np.abs(cx * du[:, 0] + cy * du[:, 1]) + np.abs(cx * dv[:, 0] + cy * dv[:, 1]) + 1e-9
        colours = (PALETTE.outer_ring, PALETTE.ice, PALETTE.inner_ring, PALETTE.ice)
        for radius, colour in zip(RING_RADII, colours, strict=True):
            brush.lay(colour, _inside(radius - r, wr))
    half = LINE_WIDTH / 2
    depth = np.abs(y)
    brush.lay(PALETTE.line, _band(x, -half, half, wx) * _inside(HACK_Y - depth, wy))
    brush.lay(PALETTE.line, _band(depth, TEE_Y - half, TEE_Y + half, wy))
    brush.lay(PALETTE.line, _band(depth, BACK_LINE_Y, BACK_LINE_Y + LINE_WIDTH, wy))
    brush.lay(PALETTE.hog_line, _band(depth, HOG_LINE_Y, HOG_LINE_Y + HOG_LINE_WIDTH, wy))
    # Rule book R1: a hack is at most 0.2032 m long and its inner edge 0.0762 m from the centre.
    hack = _band(np.abs(x), 0.0762, 0.0762 + 0.09, wx)
    brush.lay(PALETTE.hack, hack * _band(depth, HACK_Y, HACK_Y + 0.2032, wy))

    grain = 1.0 + light.pebble * _lookup(texture, x, y)
    brush.picture *= grain[..., None]
    gloss = light.gloss * _mirrored_lamps(x.mean(axis=0), y.mean(axis=0), position)
    brush.picture += (gloss * 30.0).astype(np.float32)[:, None]
    on_ice = _inside(sheet.width / 2 - np.abs(x), wx) * _inside(sheet.length / 2 - depth, wy)
    brush.lay(PALETTE.bumper, 1.0 - on_ice)
    outer = _inside(np.abs(x) - sheet.width / 2 - BUMPER_WIDTH, wx)
    outer = np.maximum(outer, _inside(depth - sheet.length / 2 - BUMPER_WIDTH, wy))
    brush.lay(PALETTE.floor, outer)
    return brush.picture.mean(axis=0)


def _band(position: Floats, start: float, stop: float, footprint: Floats) -> Floats:
    """Return the share of a sample between two parallel edges."""
    return _inside(position - start, footprint) - _inside(position - stop, footprint)


def _mirrored_lamps(x: Floats, y: Floats, position: Floats) -> Floats:
    """Return the brightness of the lamps' reflections in the pebbled ice, 0 to about 1, (m,)."""
    dx, dy = x - position[0], y - position[1]
    scale = LAMP_HEIGHT / position[2]
    sin_elevation = position[2] / np.sqrt(dx * dx + dy * dy + position[2] ** 2)
    # Schlick's approximation of Fresnel's law; ice reflects 2 % of vertical light.
    fresnel = 0.02 + 0.98 * (1.0 - sin_elevation) ** 5
    glow = np.zeros_like(x)
    for lamp_x, lamp_y in LAMP_POSITIONS:
        across, along = x + scale * dx - lamp_x, y + scale * dy - lamp_y
        glow += np.exp(-0.5 * ((across / 2.2) ** 2 + (along / 1.6) ** 2))
    return glow * (0.15 + fresnel)


def _lens_light(camera: Camera, light: Light) -> NDArray[np.float32]:
    """Return the relative light that reaches each pixel through the lens, (height, width)."""
    width, height = camera.size
    u = (np.arange(width) - width / 2) / (width / 2)
    v = ((np.arange(height) - height / 2) / (height / 2))[:, None]
    share = (1.0 - light.vignette * (u * u + v * v) / 2) * (1.0 - 0.5 * light.gradient * u)
    return share.astype(np.float32)
