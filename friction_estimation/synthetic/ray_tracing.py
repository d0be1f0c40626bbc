"""Solid shape of a stone, and ray tracing of its surface.

A stone is a solid of revolution with a handle. Its rings are cut cones and its handle consists of
rods with round ends, which rays meet exactly. A film therefore shows the true perspective of a
solid body, and not that of a flat mark on the ice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import RULE_BOOK_STONE, Stone
from curling_env.typing import Floats, Singles
from friction_estimation.synthetic.tuning import (
    BODY_PROFILE,
    GRANITE_COLOUR,
    LAMP_DIRECTIONS,
    RED,
    SPECKLE_CELL,
)


@dataclass(frozen=True, kw_only=True)
class StoneShape:
    """Solid shape of a stone.

    Parameters
    ----------
    radius, height : size of the body [m]
    profile : outline from the ice to the top, as shares of radius and height; heights increase
    """

    radius: float = RULE_BOOK_STONE.radius
    height: float = RULE_BOOK_STONE.height
    profile: tuple[tuple[float, float], ...] = BODY_PROFILE

    @classmethod
    def of(cls, stone: Stone) -> StoneShape:
        """Return the shape of a kind of stone, with the usual outline."""
        return cls(radius=stone.radius, height=stone.height)

    @property
    def outline(self) -> Floats:
        """Return (n, 2) radius and height of the body's outline [m]."""
        return np.array(self.profile) * [self.radius, self.height]

    @property
    def top_radius(self) -> float:
        """Radius of the flat top [m]."""
        return self.radius * self.profile[-1][0]

    @property
    def crown(self) -> float:
        """Height of the handle's highest point [m]."""
        return self.height + 0.068


@dataclass(frozen=True, kw_only=True)
class StoneOnIce:
    """Stone at one moment.

    Parameters
    ----------
    x, y : place of its centre, sheet frame [m]
    theta : direction of the handle, counter-clockwise from +x [rad]
    vx, vy : velocity, which blurs it during the exposure [m/s]
    colour : colour of the handle, blue-green-red
    """

    x: float
    y: float
    theta: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    colour: tuple[int, int, int] = RED


def trace(
    position: Floats,
    rays: Floats,
    stone: StoneOnIce,
    shape: StoneShape,
    moments: Floats,
    speckle: Singles,
    colour: Singles,
    nearest: Singles,
    hit: NDArray[np.bool_],
) -> None:
    """Paint the samples whose rays meet a stone before anything else, in place.

    Parameters
    ----------
    position : (3,) start of all rays, sheet frame [m]
    rays : (k, m, 3) directions of k samples in m pixels
    stone : place, motion and colour of the stone
    shape : its solid shape
    moments : (k,) time of each sample from the middle of the exposure [s]
    speckle : (65536,) unit-variance texture of the granite
    colour : (k, m, 3) colours of the samples, blue-green-red; updated
    nearest : (k, m) distance to what each sample shows [m]; updated
    hit : (k, m) true for samples that show a stone; updated
    """
    # Rays restart at the stone's middle height, where single precision resolves a micrometre.
    middle = 0.5 * shape.height
    start = (middle - position[2]) / rays[..., 2]
    centre_x = stone.x + stone.vx * moments[:, None]
    centre_y = stone.y + stone.vy * moments[:, None]
    ox = position[0] + start * rays[..., 0] - centre_x
    oy = position[1] + start * rays[..., 1] - centre_y
    length = np.linalg.norm(rays, axis=2)
    d64 = rays / length[..., None]
    sine, cosine = np.sin(stone.theta), np.cos(stone.theta)
    # Most rays pass the stone's centre at a distance at which they cannot meet it.
    projection = ox * d64[..., 0] + oy * d64[..., 1]
    reach = np.hypot(shape.radius, shape.crown - middle)
    candidate = ox * ox + oy * oy - projection * projection < reach * reach
    if not candidate.any():
        return
    o = np.stack(
        [
            (cosine * ox + sine * oy)[candidate],
            (cosine * oy - sine * ox)[candidate],
            np.full(int(candidate.sum()), middle),
        ]
    ).astype(np.float32)
    dx, dy, dz = (d64[..., k][candidate] for k in range(3))
    d = np.stack([cosine * dx + sine * dy, cosine * dy - sine * dx, dz]).astype(np.float32)

    hits = _Hits(len(dx))
    _meet_body(hits, o, d, shape)
    _meet_handle(hits, o, d, shape)
    depth = (start * length)[candidate].astype(np.float32) + hits.t
    seen = np.isfinite(hits.t) & (depth < nearest[candidate])
    where = np.flatnonzero(candidate.ravel())[seen]
    shaded = _shade(hits, o, d, seen, stone, shape, speckle, (sine, cosine))
    colour.reshape(-1, 3)[where] = shaded
    nearest.reshape(-1)[where] = depth[seen]
    hit.reshape(-1)[where] = True


GRANITE_BODY, STRIKING_BAND, HANDLE = 0, 1, 2


class _Hits:
    """Nearest intersections found up to now of n rays with surfaces."""

    def __init__(self, n: int) -> None:
        self.t = np.full(n, np.inf, dtype=np.float32)
        self.normal = np.zeros((3, n), dtype=np.float32)
        self.material = np.zeros(n, dtype=np.int8)

    def record(self, where: NDArray[np.intp], t: Singles, normal: Singles, material: int) -> None:
        closer = t < self.t[where]
        where = where[closer]
        self.t[where] = t[closer]
        self.normal[:, where] = normal[:, closer]
        self.material[where] = material


def _meet_body(hits: _Hits, o: Singles, d: Singles, shape: StoneShape) -> None:
    outline = shape.outline
    collar = 0.34 * shape.radius
    # The handle is mounted on a low collar, which has the handle's colour.
    mount = np.array([[collar, shape.height], [0.85 * collar, shape.height + 0.009]])
    normals = _outline_normals(outline)
    for k in range(len(outline) - 1):
        at = 0.5 * (outline[k, 1] + outline[k + 1, 1]) / shape.height
        material = STRIKING_BAND if 0.36 < at < 0.64 else GRANITE_BODY
        _meet_ring(hits, o, d, outline[k : k + 2], normals[k : k + 2], material)
    _meet_ring(hits, o, d, mount, np.tile(_outline_normals(mount)[:1], (2, 1)), HANDLE)
    _meet_disc(hits, o, d, shape.top_radius, shape.height, GRANITE_BODY)
    _meet_disc(hits, o, d, 0.85 * collar, shape.height + 0.009, HANDLE)


def _outline_normals(outline: Floats) -> Floats:
    """Return smoothed outward unit normals (radial, upward) at the outline's points, (n, 2)."""
    steps = np.diff(outline, axis=0)
    faces = np.stack([steps[:, 1], -steps[:, 0]], axis=1)
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    normals = np.concatenate([faces[:1], faces[:-1] + faces[1:], faces[-1:]])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _meet_ring(
    hits: _Hits, o: Singles, d: Singles, ends: Floats, normals: Floats, material: int
) -> None:
    """Intersect rays with a cut cone; `ends` are (radius, height), `normals` are those there."""
    (r0, z0), (r1, z1) = ends.astype(np.float32)
    slope = (r1 - r0) / (z1 - z0)
    # The face's normal is z1 - z0 outwards and r0 - r1 upwards. A face that every ray sees from the
    # edge or from behind is skipped.
    if ((z1 - z0) * np.sqrt(1.0 - d[2] * d[2]) <= (r0 - r1) * d[2]).all():
        return
    q = r0 + slope * (o[2] - z0)
    a = d[0] * d[0] + d[1] * d[1] - (slope * d[2]) ** 2
    b = o[0] * d[0] + o[1] * d[1] - q * slope * d[2]
    c = o[0] * o[0] + o[1] * o[1] - q * q
    root = b * b - a * c
    real = np.flatnonzero(root > 0)
    a, b, c, root = a[real], b[real], c[real], np.sqrt(root[real])
    # Of the two roots, this is where the ray enters the solid. The form avoids cancellation.
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(b < 0, c / (root - b), -(b + root) / a)
    z = o[2, real] + t * d[2, real]
    inside = (z >= z0) & (z <= z1)
    ray, t, z = real[inside], t[inside], z[inside]
    if ray.size == 0:
        return
    x, y = o[0, ray] + t * d[0, ray], o[1, ray] + t * d[1, ray]
    share = (z - z0) / (z1 - z0)
    radial = normals[0, 0] + share * (normals[1, 0] - normals[0, 0])
    upward = normals[0, 1] + share * (normals[1, 1] - normals[0, 1])
    r = np.maximum(np.hypot(x, y), 1e-6)
    normal = np.stack([radial * x / r, radial * y / r, upward]).astype(np.float32)
    hits.record(ray, t, normal, material)


def _meet_disc(
    hits: _Hits, o: Singles, d: Singles, radius: float, height: float, material: int
) -> None:
    """Intersect rays from above with a level disc."""
    t = (np.float32(height) - o[2]) / d[2]
    x, y = o[0] + t * d[0], o[1] + t * d[1]
    ray = np.flatnonzero((x * x + y * y <= radius * radius) & (d[2] < 0))
    normal = np.zeros((3, ray.size), dtype=np.float32)
    normal[2] = 1.0
    hits.record(ray, t[ray], normal, material)


def _meet_handle(hits: _Hits, o: Singles, d: Singles, shape: StoneShape) -> None:
    """Intersect rays with the handle: a neck behind the centre, and a grip forward over the top."""
    r, h = shape.radius, shape.height
    _meet_capsule(hits, o, d, (-0.20 * r, 0.0, h), (-0.24 * r, 0.0, h + 0.045), 0.014)
    _meet_capsule(hits, o, d, (-0.24 * r, 0.0, h + 0.047), (0.72 * r, 0.0, h + 0.053), 0.0145)


def _meet_capsule(
    hits: _Hits,
    o: Singles,
    d: Singles,
    start: tuple[float, float, float],
    stop: tuple[float, float, float],
    radius: float,
) -> None:
    """Intersect rays with a rod that has round ends."""
    p, axis = np.array(start, np.float32), np.subtract(stop, start).astype(np.float32)
    long2 = float(axis @ axis)
    from_start = o - p[:, None]
    ad, ao = axis @ d, axis @ from_start
    od = (from_start * d).sum(axis=0)
    oo = (from_start * from_start).sum(axis=0)
    a = long2 - ad * ad
    b = long2 * od - ao * ad
    c = long2 * oo - ao * ao - np.float32(radius * radius * long2)
    root = b * b - a * c
    real = np.flatnonzero(root > 0)
    if real.size == 0:
        return
    t = (-b[real] - np.sqrt(root[real])) / np.maximum(a[real], 1e-12)
    at = (ao[real] + t * ad[real]) / long2
    # Beyond its ends the rod is a ball.
    over = (at < 0) | (at > 1)
    ball = p[:, None] + axis[:, None] * (at[over] > 1)
    to = o[:, real[over]] - ball
    half = (to * d[:, real[over]]).sum(axis=0)
    left = half * half - ((to * to).sum(axis=0) - np.float32(radius * radius))
    t[over] = np.where(left > 0, -half - np.sqrt(np.maximum(left, 0)), np.inf)
    met = np.isfinite(t)
    ray, t = real[met], t[met]
    point = o[:, ray] + t * d[:, ray]
    foot = np.clip((ao[ray] + t * ad[ray]) / long2, 0.0, 1.0)
    normal = (point - p[:, None] - axis[:, None] * foot) / np.float32(radius)
    hits.record(ray, t, normal, HANDLE)


def _shade(
    hits: _Hits,
    o: Singles,
    d: Singles,
    seen: NDArray[np.bool_],
    stone: StoneOnIce,
    shape: StoneShape,
    speckle: Singles,
    turn: tuple[float, float],
) -> Singles:
    """Return colours of the s samples in `seen`, (s, 3)."""
    t, normal, material = hits.t[seen], hits.normal[:, seen], hits.material[seen]
    point = o[:, seen] + t * d[:, seen]
    palette = np.array(
        [GRANITE_COLOUR, tuple(1.12 * g for g in GRANITE_COLOUR), stone.colour], dtype=np.float32
    )
    base = palette[material]
    cell = np.floor(point / np.float32(SPECKLE_CELL)).astype(np.int64)
    grain = speckle[(cell[0] * 73 + cell[1] * 179 + cell[2] * 283) & 0xFFFF]
    base = base * np.where(material == HANDLE, 1.0, 1.0 + 0.13 * grain)[:, None]
    sine, cosine = turn
    bright = np.full(t.size, 0.42, dtype=np.float32)
    sheen = np.zeros(t.size, dtype=np.float32)
    polish = np.array([40.0, 6.0, 70.0], dtype=np.float32)[material]
    for lx, ly, lz in LAMP_DIRECTIONS:
        lamp = np.array([cosine * lx + sine * ly, cosine * ly - sine * lx, lz], dtype=np.float32)
        lamp /= np.linalg.norm(lamp)
        bright += 0.36 * np.maximum(lamp @ normal, 0.0)
        between = lamp[:, None] - d[:, seen]
        between /= np.linalg.norm(between, axis=0)
        sheen += polish * np.maximum((between * normal).sum(axis=0), 0.0) ** 60
    # The ice lights the lower half from below; the foot is in the stone's own shade.
    bright += 0.16 * np.maximum(-normal[2], 0.0)
    bright *= 0.55 + 0.45 * np.clip(point[2] / (0.35 * shape.height), 0.0, 1.0)
    return base * bright[:, None] + sheen[:, None]
