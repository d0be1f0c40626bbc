"""The cameras of `other_films.py`; their lenses share no code with the project."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

PLACES: dict[str, tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], float, float]] = {
    "end": ((0.4, -36.5, 8.8), (0.0, -12.5, 0.0), (0.0, 0.0, 1.0), 1.16, -0.12),
    "gantry": ((0.2, 0.1, 15.5), (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), 0.335, -0.05),
    "side": ((-13.8, 0.2, 10.6), (0.3, 0.0, 0.0), (0.0, 0.0, 1.0), 0.36, -0.08),
    "ceiling": ((0.1, 15.2, 6.1), (0.0, 15.0, 0.0), (-1.0, 0.0, 0.0), 0.54, -0.2),
}
"""Place, target, what is up, focal length and displacement of the picture's end, in widths."""


@dataclass(frozen=True, kw_only=True)
class View:
    """A camera: rotation (3, 3), place (3,), focal length, axis, distortion and size [px]."""

    turn: Array
    place: Array
    focal: float
    axis: tuple[float, float]
    k1: float
    k2: float
    size: tuple[int, int]

    def pixels(self, points: Array) -> Array:
        """Where points (n, 3) [m] are seen, (n, 2) [px]."""
        local = (points - self.place) @ self.turn.T
        a, b = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
        r = a * a + b * b
        bend = 1 + r * (self.k1 + r * self.k2)
        return np.stack([self.focal * a * bend, self.focal * b * bend], 1) + np.array(self.axis)

    def rays(self, u: Array, v: Array) -> Array:
        """Directions (..., 3) through pixels; the bend is undone by repetition."""
        p, q = (u - self.axis[0]) / self.focal, (v - self.axis[1]) / self.focal
        a, b = p.copy(), q.copy()
        for _ in range(24):
            r = a * a + b * b
            bend = 1 + r * (self.k1 + r * self.k2)
            a, b = p / bend, q / bend
        return np.stack([a, b, np.ones_like(a)], -1) @ self.turn


def view_of(name: str, height: int, rng: np.random.Generator) -> View:
    """A camera of a kind, hung a little elsewhere."""
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
