"""Practice draws of the demo."""

from __future__ import annotations

import numpy as np

from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Release, Throw

SECONDS_BETWEEN_THROWS = 60.0


def draw_practice(n: int, rng: np.random.Generator) -> list[Release]:
    """Draw the releases of n practice draws towards the away end, with both handles and several
    lines.

    A club player throws them without knowing the ice: about draw weight on the standard ice, at
    targets from one side of the house to the other.
    """
    releases: list[Release] = []
    for k in range(n):
        aim = (1.3 - 2.6 * k / max(n - 1, 1)) * (-1.0) ** (k // 2)
        spin = (-1.0) ** k * rng.uniform(0.8, 1.3)
        speed = 2.09 + rng.uniform(-0.06, 0.05)
        # A counter-clockwise stone curls about 1.4 m to the left, so it is aimed to the right.
        bend = 1.4 * np.sign(spin)
        angle = -np.arctan2(aim + bend, TEE_Y + 10.97)
        throw = Throw(speed=speed, angle=float(angle), spin=float(spin))
        releases.append(throw.release(Direction.AWAY, clock=SECONDS_BETWEEN_THROWS * k, order=k))
    return releases
