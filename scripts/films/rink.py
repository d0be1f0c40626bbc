"""Rink rendered without code of the project's renderer: camera, ice, paint, stone.

A stone is cast ray by ray.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

LENGTH, WIDTH = 44.5, 4.5
TEE, HOG = 17.3735, 10.9725
RINGS = ((1.829, (150, 70, 40)), (1.219, (235, 235, 235)), (0.610, (50, 50, 190)),
         (0.152, (235, 235, 235)))  # fmt: skip
ICE, FLOOR, DARK = (232, 228, 224), (70, 64, 60), (60, 60, 60)
STONE_HEIGHT = 0.1143
BAND = 0.0625
"""Radius of a stone's running band [m]."""
PROFILE = (6.0, 12.0)
"""Range of the exponents of a stone's profile. With granite of 2.65 g/cm³ and a handle of 0.5 kg,
such stones weigh 17.2 to 19.6 kg; the rules ask for 17.24 to 19.96."""
LAYERS = 44
"""Number of levels at which a ray is tested against the stone."""
FINE = 4
"""Number of rays along each side of a pixel."""


# --- the camera ---------------------------------------------------------------------------------

PLACES: dict[str, tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], float, float]] = {
    "end": ((0.4, -36.5, 8.8), (0.0, -12.5, 0.0), (0.0, 0.0, 1.0), 1.16, -0.12),
    "gantry": ((0.2, 0.1, 15.5), (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), 0.335, -0.05),
    "side": ((-13.8, 0.2, 10.6), (0.3, 0.0, 0.0), (0.0, 0.0, 1.0), 0.36, -0.08),
    "ceiling": ((0.1, 15.2, 6.1), (0.0, 15.0, 0.0), (-1.0, 0.0, 0.0), 0.54, -0.2),
}
"""Place, target, up direction, focal length and displacement of the picture's end, in widths."""


@dataclass(frozen=True, kw_only=True)
class View:
    """Camera: rotation (3, 3), place (3,), focal length, axis, distortion and size [px]."""

    turn: Array
    place: Array
    focal: float
    axis: tuple[float, float]
    k1: float
    k2: float
    size: tuple[int, int]

    def pixels(self, points: Array) -> Array:
        """Return pixels (n, 2) of points (n, 3) [m] [px]."""
        local = (points - self.place) @ self.turn.T
        a, b = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
        r = a * a + b * b
        bend = 1 + r * (self.k1 + r * self.k2)
        return np.stack([self.focal * a * bend, self.focal * b * bend], 1) + np.array(self.axis)

    def rays(self, u: Array, v: Array) -> Array:
        """Return directions (..., 3) through pixels; the distortion is removed by iteration."""
        p, q = (u - self.axis[0]) / self.focal, (v - self.axis[1]) / self.focal
        a, b = p.copy(), q.copy()
        for _ in range(24):
            r = a * a + b * b
            bend = 1 + r * (self.k1 + r * self.k2)
            a, b = p / bend, q / bend
        return np.stack([a, b, np.ones_like(a)], -1) @ self.turn


def view_of(name: str, height: int, rng: np.random.Generator) -> View:
    """Return a camera of a kind, placed slightly differently."""
    place, target, up, focal, bend = PLACES[name]
    size = (height * 4 // 3, height) if name == "ceiling" else (round(height * 16 / 9), height)
    size = (size[0] - size[0] % 2, size[1])
    at = np.array(place) * [1, 1, rng.uniform(0.92, 1.08)] + rng.normal(0, 0.15, 3)
    to = np.array(target) + np.append(rng.normal(0, 0.1, 2), 0.0)
    ahead = (to - at) / np.linalg.norm(to - at)
    right = np.cross(ahead, np.array(up))
    right /= np.linalg.norm(right)
    f = focal * rng.uniform(0.96, 1.0) * (1 if name == "end" else at[2] / place[2]) * size[0]
    half = (size[0] / 2 / f) ** 2
    k1 = bend * rng.uniform(0.5, 1.0) / half
    off = rng.normal(0, 0.004, 2) * size[0]
    return View(turn=np.stack([right, np.cross(ahead, right), ahead]), place=at, focal=float(f),
                axis=(size[0] / 2 + off[0], size[1] / 2 + off[1]), k1=float(k1),
                k2=float(-0.12 * k1 / half), size=size)  # fmt: skip


# --- the ice ------------------------------------------------------------------------------------


def colour_of_ice(x: Array, y: Array) -> Array:
    """Return the paint at places on the ice, (..., 3) BGR."""
    colour = np.empty((*x.shape, 3), np.float32)
    colour[:] = ICE
    for end in (-1, 1):
        away = np.hypot(x, y - end * TEE)
        for radius, paint in RINGS:
            colour[away <= radius] = paint
    depth = np.abs(y)
    colour[(np.abs(x) < 0.00635) & (depth < TEE + 3.66)] = DARK
    for line in (TEE, TEE + 1.829 - 0.00635):
        colour[np.abs(depth - line) < 0.00635] = DARK
    colour[(depth >= HOG) & (depth <= HOG + 0.1016)] = (40, 40, 170)
    colour[(np.abs(x) > WIDTH / 2) | (depth > LENGTH / 2)] = FLOOR
    return colour


def picture_of_ice(view: View, rng: np.random.Generator) -> Array:
    """Return the empty sheet, (rows, columns, 3), unevenly lit."""
    width, height = view.size
    picture = np.empty((height, width, 3), np.float32)
    part = (np.arange(5) + 0.5) / 5 - 0.5
    for row in range(height):
        u, v = np.meshgrid((np.arange(width)[:, None] + part).ravel(), row + part)
        rays = view.rays(u, v)
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.where(rays[..., 2] < -1e-3, -view.place[2] / rays[..., 2], np.nan)
        x, y = (np.nan_to_num(view.place[k] + far * rays[..., k], nan=99.0) for k in (0, 1))
        picture[row] = colour_of_ice(x, y).reshape(5, width, 5, 3).mean(axis=(0, 2))
    glow = rng.uniform(-0.08, 0.08, 2)
    down, across = np.linspace(-1, 1, height), np.linspace(-1, 1, width)
    lit = 1 + np.add.outer(glow[0] * down, glow[1] * across)
    grain = cv2.GaussianBlur(rng.normal(0, 1, (height, width)), (0, 0), 1.2)
    return picture * (lit + 0.02 * grain)[..., None].astype(np.float32)


# --- the stone ----------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Granite:
    """Stone: radius [m], the exponents of its profile below and above, colours, and the light.

    Its shade is the share of the light that the ice under its edge loses.
    """

    radius: float
    below: float
    above: float
    body: Array
    handle: Array
    sun: Array
    shade: float

    def radii(self, z: Array) -> Array:
        """Return the radius at heights (n,): widest at 48 % of the height, with a flat striking
        band.
        """
        middle, band = 0.48 * STONE_HEIGHT, 0.011
        up = np.clip((z - middle - band) / (STONE_HEIGHT - middle - band), 0, 1)
        down = np.clip((middle - band - z) / (middle - band), 0, 1)
        top = self.radius * (1 - 0.52 * up**self.above)
        return np.where(z > middle, top, self.radius - (self.radius - BAND) * down**self.below)


def draw_stone(
    picture: Array, view: View, stone: Granite, x: float, y: float, turn: float
) -> tuple[slice, slice] | None:
    """Draw a stone with its handle, its shade and its mirror image into a picture, in place.

    Returns the rows and columns that have changed; None if the stone is not in view.
    """
    reach = stone.radius + 0.12
    box = np.array([(x + a, y + b, c) for a in (-reach, reach) for b in (-reach, reach)
                    for c in (-0.1, 0.19)])  # fmt: skip
    px = view.pixels(box)
    low = np.maximum(np.floor(px.min(axis=0)).astype(int) - 2, 0)
    high = np.minimum(np.ceil(px.max(axis=0)).astype(int) + 3, view.size)
    if (high - low < 3).any():
        return None
    part = (np.arange(FINE) + 0.5) / FINE - 0.5
    u, v = np.meshgrid((np.arange(low[0], high[0])[:, None] + part).ravel(),
                       (np.arange(low[1], high[1])[:, None] + part).ravel())  # fmt: skip
    rays = view.rays(u, v)
    slope = rays[..., :2] / rays[..., 2:]
    foot = view.place[:2] - view.place[2] * slope - np.array([x, y])
    rows, columns = slice(low[1], high[1]), slice(low[0], high[0])
    levels = np.linspace(0, STONE_HEIGHT, LAYERS)
    radii = stone.radii(levels)
    seen = np.empty((high[1] - low[1], high[0] - low[0], 3))
    cast(np.asarray(picture[rows, columns], np.float64), foot, slope, FINE, levels, radii,
         np.gradient(radii, levels), np.array([np.cos(turn), np.sin(turn)]), stone.sun,
         stone.radius, stone.shade, stone.body, stone.handle, seen)  # fmt: skip
    picture[rows, columns] = seen
    return rows, columns


@numba.njit(cache=True)
def cast(ice, foot, slope, fine, levels, radii, tilt, heading, sun, radius, shade, body, handle,
         seen):  # fmt: skip
    """Return the colour of every pixel, the mean over its rays, each at its first hit.

    `foot` (rows·fine, columns·fine, 2) has the points where rays meet the ice, from the stone's
    centre; `slope` their sideways shift per metre of height.
    """
    last = len(levels) - 1
    for row in range(seen.shape[0]):
        for column in range(seen.shape[1]):
            total = np.zeros(3)
            for i in range(row * fine, (row + 1) * fine):
                for j in range(column * fine, (column + 1) * fine):
                    fx, fy = foot[i, j]
                    sx, sy = slope[i, j]
                    hit = False
                    for k in range(10):
                        z = levels[last] + 0.045 - 0.005 * k
                        x, y = fx + z * sx, fy + z * sy
                        along, across = (
                            x * heading[0] + y * heading[1],
                            y * heading[0] - x * heading[1],
                        )
                        high = k < 5
                        if -0.035 < along < (0.105 if high else -0.005) and abs(across) < (
                            0.015 if high else 0.012):  # fmt: skip
                            total += handle
                            hit = True
                            break
                    if hit:
                        continue
                    for k in range(last, -1, -1):
                        x, y = fx + levels[k] * sx, fy + levels[k] * sy
                        away = np.hypot(x, y)
                        if away > radii[k]:
                            continue
                        if k == last:
                            light = max(sun[2], 0.0)
                        else:
                            length = np.hypot(1.0, tilt[k])
                            out = max(away, 1e-9)
                            nz = -tilt[k] / length
                            light = (x * sun[0] + y * sun[1]) / (out * length) + nz * sun[2]
                            light = min(max(light, 0.0), 1.0) + 0.25 * min(max(-nz, 0.0), 1.0)
                        total += body * (0.62 + 0.38 * light)
                        hit = True
                        break
                    if hit:
                        continue
                    away = np.hypot(fx - 0.03 * sun[0], fy - 0.03 * sun[1])
                    lost = shade * min(max((radius - away) / 0.04, 0.0), 1.0)
                    mirrored = False
                    for k in range(last + 1):
                        if np.hypot(fx - levels[k] * sx, fy - levels[k] * sy) <= radii[k]:
                            mirrored = True
                            break
                    for c in range(3):
                        light = ice[row, column, c] * (1 - lost)
                        total[c] += 0.92 * light + 0.08 * body[c] if mirrored else light
            for c in range(3):
                seen[row, column, c] = total[c] / fine**2


# --- the rink -----------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Rink:
    """Camera over a sheet, with its ice, its light and its stone.

    Parameters
    ----------
    key : seeds of all its random numbers
    mu : friction of its ice
    scene : a user's knowledge of it, as a scene file
    """

    key: tuple[int, int]
    view: View
    ice: Array
    stone: Granite
    mu: float
    scene: dict[str, Any]


def rink_of(camera: str, height: int, seed: int) -> Rink:
    """Return the rink of a seed, seen by a camera; the same for any number of lines of its
    picture.
    """
    key = seed, list(PLACES).index(camera)
    rng = np.random.default_rng([*key, 1])
    view = view_of(camera, height, rng)
    sun = np.array([rng.normal(0, 0.5), rng.normal(0, 0.5), 1.0])
    grey = rng.uniform(70, 120)
    below, above = rng.uniform(*PROFILE, 2).tolist()
    stone = Granite(radius=float(rng.uniform(0.140, 0.146)), below=below, above=above,
                    body=np.array([grey, grey, 0.97 * grey]),
                    handle=np.array([(40, 40, 200), (40, 190, 220)][seed % 2], float),
                    sun=sun / np.linalg.norm(sun), shade=rng.uniform(0.1, 0.3))  # fmt: skip
    marked, corners = places_marked(view)
    px = view.pixels(np.array([(*place, 0.0) for place in marked])).tolist()
    scene: dict[str, Any] = {
        "camera_matrix": [[view.focal, 0, view.axis[0]], [0, view.focal, view.axis[1]], [0, 0, 1]],
        "distortion": [view.k1, view.k2, 0, 0, 0],
        "stone": {"radius": stone.radius, "height": STONE_HEIGHT},
    }
    if corners:
        names = ("home_left", "home_right", "away_left", "away_right")
        scene["corners_px"] = dict(zip(names, px, strict=True))
    else:
        scene["points"] = [{"sheet": a, "px": b} for a, b in zip(marked, px, strict=True)]
    ice = picture_of_ice(view, np.random.default_rng([*key, 2]))
    mu = float(np.random.default_rng([*key]).uniform(0.0078, 0.0105))
    return Rink(key=key, view=view, ice=ice, stone=stone, mu=mu, scene=scene)


def places_marked(view: View) -> tuple[list[tuple[float, float]], bool]:
    """Return a user's marks, and whether those are the corners, or else paint at the ends."""

    def seen(points: list[tuple[float, float]]) -> NDArray[np.bool_]:
        px = view.pixels(np.array([(*p, 0.0) for p in points]))
        low, high = px.min(axis=1) > 2, (px - view.size).max(axis=1) < -3
        return low & high

    corners = [(s * WIDTH / 2, e * LENGTH / 2) for e in (-1, 1) for s in (-1, 1)]
    if seen(corners).all():
        return corners, True
    points: list[tuple[float, float]] = []
    for e in (-1, 1):
        points += [(s * 1.829, e * TEE) for s in (-1, 0, 1)]
        points += [(0, e * (TEE + 1.829)), (0, e * (TEE - 1.829))]
        points += [(s * WIDTH / 2, e * (HOG + 0.0508)) for s in (-1, 1)]
    return [points[k] for k in np.flatnonzero(seen(points))], False
