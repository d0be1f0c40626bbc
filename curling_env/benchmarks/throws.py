"""Sample ice, throws and positions for measuring and comparing the physics."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import Ice, load_ice
from curling_env.physics.batch import RELEASE_DTYPE
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.typing import Floats


def mapped_ice(rng: np.random.Generator) -> Ice:
    """Return standard ice with a different friction in every cell, rougher than any real ice."""
    ice = load_ice("standard")
    mu = ice.friction.mu * np.exp(0.04 * rng.standard_normal(ice.friction.mu.shape))
    return replace(ice, friction=replace(ice.friction, mu=mu))


def draws_and_hits(rng: np.random.Generator, n: int, hits: float) -> NDArray[Any]:
    """Return releases towards the away house; a share `hits` of them at takeout weight."""
    table = np.zeros(n, dtype=RELEASE_DTYPE)
    spin = rng.choice([-1.5, 1.5], n)
    hit = rng.random(n) < hits
    speed = np.where(hit, rng.uniform(2.5, 3.2, n), rng.normal(2.09, 0.02, n))
    # The aim allows for the curl: 1.4 m for a draw, 0.7 m at takeout weight.
    aim = rng.normal(0.0, 0.5, n) + np.sign(spin) * np.where(hit, 0.7, 1.4)
    angle = -aim / (HOG_LINE_Y + TEE_Y)
    table["y"] = -HOG_LINE_Y
    table["vx"], table["vy"] = -speed * np.sin(angle), speed * np.cos(angle)
    table["omega"] = spin
    return table


def houses(rng: np.random.Generator, n: int, stones: int = 8) -> Floats:
    """Return positions of stones in the away house, (n, stones, 2) [m]."""
    found = np.empty((n, stones, 2))
    for position in found:
        k = 0
        while k < stones:
            radius, turn = 1.8 * math.sqrt(rng.random()), rng.uniform(0, 2 * np.pi)
            place = np.array([radius * math.sin(turn), TEE_Y + radius * math.cos(turn)])
            if k == 0 or np.hypot(*(position[:k] - place).T).min() > 0.3:
                position[k] = place
                k += 1
    return found
