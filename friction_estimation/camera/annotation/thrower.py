"""Drawing of the thrower, seen from above, at the home end of the sheet."""

from __future__ import annotations

import numpy as np

from curling_env.sheet import TEE_Y
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera

SIZE = 1.5
"""Scale: larger than life, to be visible in small pictures."""


def _round(x: float, y: float, across: float, along: float, turn: float = 0.0) -> Floats:
    phi = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    points = np.column_stack([across * np.cos(phi), along * np.sin(phi)])
    c, s = np.cos(turn), np.sin(turn)
    return points @ np.array([[c, s], [-s, c]]) + (x, y)


def _limb(start: tuple[float, float], stop: tuple[float, float], width: float) -> Floats:
    a, b = np.array(start), np.array(stop)
    ahead = (b - a) / np.hypot(*(b - a))
    aside = width / 2 * np.array([-ahead[1], ahead[0]])
    return np.array([a - aside, b - aside, b + aside, a + aside])


# Metres to the right of and ahead of the body's middle: a person who slides ahead with a stone.
_FIGURE = (
    _limb((0.1, -0.25), (0.2, -1.15), 0.16),  # the leg that trails
    _limb((-0.12, -0.25), (-0.2, 0.2), 0.18),  # the sliding foot
    _limb((-0.2, 0.2), (-0.75, 0.45), 0.07),  # the arm with the broom
    _limb((-0.75, -0.1), (-0.75, 1.0), 0.05),  # the broom
    _limb((0.15, 0.2), (0.08, 0.85), 0.1),  # the arm with the stone
    _round(0.0, -0.02, 0.25, 0.38),  # the body
    _round(0.0, 0.45, 0.13, 0.15),  # the head
    _round(0.08, 0.95, 0.17, 0.17),  # the stone
)


def thrower() -> list[Floats]:
    """Return the shapes of a thrower at the home end, each (n, 2), sheet frame [m]."""
    middle = np.array([0.0, -TEE_Y + 0.6])
    return [SIZE * shape + middle for shape in _FIGURE]


def thrower_px(camera: Camera) -> list[Floats]:
    """Return the same projected by a camera, raw pixels; empty if it is out of view."""
    shapes: list[Floats] = []
    for shape in thrower():
        points = np.column_stack([shape, np.zeros(len(shape))])
        if not camera.sees(points).all():
            return []
        shapes.append(camera.project(points))
    return shapes
