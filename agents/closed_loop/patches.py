"""Ordinary ice with a few heavy and keen areas, for the demo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from curling_env.ice import FrictionMap, Ice, load_ice

PATCH_STRENGTH = (0.07, 0.11)
"""Range of the relative difference of friction in the middle of a patch.

Players complain about such ice: wear and frost in a game make about 8 %.
"""
PATCH_LENGTH, PATCH_BREADTH = (2.0, 3.2), (0.7, 1.1)
"""Ranges of a patch's Gaussian half-length along and half-breadth across the sheet [m]."""


def patchy_ice(rng: np.random.Generator, *, base: str = "standard") -> Ice:
    """Draw an ice with four areas, alternately heavy and keen, in places where throws pass.

    Parameters
    ----------
    base : ice file or preset with the law and the mean friction
    """
    ice = load_ice(base)
    x, y = np.meshgrid(ice.sheet.x_centres, ice.sheet.y_centres)
    difference = np.zeros(ice.sheet.shape)
    sign = rng.choice([-1.0, 1.0])
    side = rng.choice([-1.0, 1.0])
    for middle in (-6.5, -0.5, 5.5, 12.0):
        centre_x = side * rng.uniform(0.2, 0.9)
        centre_y = middle + rng.uniform(-1.0, 1.0)
        shape = ((x - centre_x) / rng.uniform(*PATCH_BREADTH)) ** 2
        shape = shape + ((y - centre_y) / rng.uniform(*PATCH_LENGTH)) ** 2
        difference += sign * rng.uniform(*PATCH_STRENGTH) * np.exp(-0.5 * shape)
        sign, side = -sign, -side
    mu = ice.friction.mu * (1.0 + difference)
    certain = FrictionMap(mu=mu, sigma=np.zeros(mu.shape), observed=np.ones(mu.shape, dtype=bool))
    return replace(ice, friction=certain)
