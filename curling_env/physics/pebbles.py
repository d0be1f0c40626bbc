"""The paper's equations 5–8 as they are written: friction summed over a stone's pebbles.

The definition that `law.running_band` computes quickly. Corrected against the printed paper: f is
the load of one contact, mg/J; both components carry the minus sign; γ takes the quadrant of the
slip; and the torque sums r × F over the contacts.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curling_env.physics.effects.motion import GRAVITY
from curling_env.sheet import Stone
from curling_env.typing import Floats


def friction_of_pebbles(
    stone: Stone,
    velocity: tuple[float, float],
    spin: float,
    friction: Callable[[Floats], Floats],
    pebbles: int,
) -> tuple[Floats, float]:
    """Force and torque of friction on a stone that stands on J pebbles, evenly round its band.

    Parameters
    ----------
    stone : its mass and the radius of its running band count
    velocity : of the centre, sheet frame [m/s]
    spin : counter-clockwise positive [rad/s]
    friction : coefficient of friction at each slip, (J,) [m/s] -> (J,)
    pebbles : J

    Returns
    -------
    force : (2,) sheet frame [N]
    torque : counter-clockwise about the centre [N m]

    Source
    ------
    The paper's equations 5 (slip of a contact), 6 (torque), 7 and 8 (force).
    """
    phi = 2 * np.pi * (np.arange(pebbles) + 0.5) / pebbles
    x, y = stone.band_radius * np.cos(phi), stone.band_radius * np.sin(phi)
    slip_x, slip_y = velocity[0] - spin * y, velocity[1] + spin * x
    gamma = np.arctan2(slip_x, slip_y)
    load = stone.mass * GRAVITY / pebbles
    grip = friction(np.hypot(slip_x, slip_y)) * load
    force_x, force_y = -grip * np.sin(gamma), -grip * np.cos(gamma)
    return np.array([force_x.sum(), force_y.sum()]), float((x * force_y - y * force_x).sum())
