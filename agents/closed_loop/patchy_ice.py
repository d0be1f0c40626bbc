"""Ice with heavy and keen areas that the rest of the demo is not told about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from curling_env.ice import FrictionMap, Ice, load_ice
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Release, Throw

STRENGTH = (0.07, 0.11)
"""Difference in the middle of an area. The standard ice's neighbours: wear and frost make 8 % in a
game (physics of the sport allows that much), so 7 to 11 % is ice that players complain about."""
LENGTH = (2.0, 3.2)
"""Gaussian half-length of an area along the sheet [m]."""
BREADTH = (0.7, 1.1)
"""Gaussian half-breadth across it [m]."""


def hidden_ice(rng: np.random.Generator, *, base: str = "standard") -> Ice:
    """Ice of known law with four hidden areas, by turns heavy and keen, where throws pass."""
    ice = load_ice(base)
    x, y = np.meshgrid(ice.sheet.x_centres, ice.sheet.y_centres)
    difference = np.zeros(ice.sheet.shape)
    sign = rng.choice([-1.0, 1.0])
    side = rng.choice([-1.0, 1.0])
    for middle in (-6.5, -0.5, 5.5, 12.0):
        centre_x = side * rng.uniform(0.2, 0.9)
        centre_y = middle + rng.uniform(-1.0, 1.0)
        shape = ((x - centre_x) / rng.uniform(*BREADTH)) ** 2
        shape = shape + ((y - centre_y) / rng.uniform(*LENGTH)) ** 2
        difference += sign * rng.uniform(*STRENGTH) * np.exp(-0.5 * shape)
        sign, side = -sign, -side
    friction = FrictionMap(
        mu=ice.friction.mu * (1.0 + difference),
        sigma=np.zeros(ice.sheet.shape),
        observed=np.ones(ice.sheet.shape, dtype=bool),
    )
    return replace(ice, friction=friction)


def practice_throws(n: int, rng: np.random.Generator) -> list[Release]:
    """Releases of n practice draws that between them cross the ice: both handles, several lines.

    They are what a club player would throw without knowing the ice: draw weight of the standard
    ice, a little more or less, at targets from one side of the house to the other.
    """
    releases: list[Release] = []
    for k in range(n):
        aim = (1.3 - 2.6 * k / max(n - 1, 1)) * (-1.0) ** (k // 2)
        spin = (-1.0) ** k * rng.uniform(0.8, 1.3)
        speed = 2.09 + rng.uniform(-0.06, 0.05)
        # A counter-clockwise stone curls left by about 1.4 m: it is aimed so much to the right.
        bend = 1.4 * np.sign(spin)
        angle = -np.arctan2(aim + bend, TEE_Y + 10.97)
        throw = Throw(speed=speed, angle=float(angle), spin=float(spin))
        releases.append(throw.release(Direction.AWAY, clock=60.0 * k, order=k))
    return releases
