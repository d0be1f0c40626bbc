"""The paper's equations 5-8 as written, friction summed over pebbles, and the law as their limit.

Corrected against the printed paper: f is the load of one contact, mg/J; both components carry the
minus sign; γ takes the quadrant of the slip; and the torque sums r × F over the contacts.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import GRAVITY, acceleration
from curling_env.sheet import RULE_BOOK_STONE as STONE
from curling_env.sheet import Stone
from curling_env.typing import Floats

MU = 0.0085
SLOWEST_SLIP = 0.01
"""Slip below which friction no longer rises [m/s]."""
WEIGHT = STONE.mass * GRAVITY
STATES = [((0.3, 2.0), 1.5), ((-0.02, 0.05), -1.5), ((0.0, 0.03), 3.0), ((0.5, -0.1), 0.0)]
STATE = pytest.mark.parametrize(("velocity", "spin"), STATES)


def friction_of_pebbles(
    stone: Stone,
    velocity: tuple[float, float],
    spin: float,
    friction: Callable[[Floats], Floats],
    pebbles: int,
) -> tuple[Floats, float]:
    """Return force and torque of friction on a stone on J pebbles, evenly round its band.

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


def error(
    exponent: float, velocity: tuple[float, float], spin: float, pebbles: int
) -> tuple[float, float]:
    """Return the difference of the sum over a number of pebbles from the compiled law, over μmg and
    μmgr.
    """
    effect = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": exponent})
    ice = Ice.uniform(MU, stone=STONE, effects=(effect,))
    ax, ay, turn = acceleration(ice, np.array([[0, 0, *velocity, spin]]))[0]
    force, torque = friction_of_pebbles(
        STONE,
        velocity,
        spin,
        lambda slip: MU * np.maximum(slip, SLOWEST_SLIP) ** -exponent,
        pebbles,
    )
    off = np.hypot(*(force - STONE.mass * np.array([ax, ay]))) / (MU * WEIGHT)
    return float(off), abs(torque - STONE.inertia * turn) / (MU * WEIGHT * STONE.band_radius)


@STATE
@pytest.mark.parametrize("exponent", [0.0, 0.25, 0.5])
def test_the_law_is_the_sum_over_ever_more_pebbles(exponent, velocity, spin) -> None:
    force, torque = error(exponent, velocity, spin, 20_000)
    assert max(force, torque) < 2e-4
    few, many = error(exponent, velocity, spin, 5), error(exponent, velocity, spin, 500)
    assert max(many) <= max(max(few), 2e-4)


def test_few_pebbles_are_not_the_law() -> None:
    # The limit says something only if the sum is far from it where it should be.
    assert max(error(0.25, (0.0, 0.09), 1.5, 4)) > 1e-2


def test_without_spin_every_pebble_pulls_back_alike() -> None:
    force, torque = friction_of_pebbles(STONE, (0.3, 0.4), 0.0, lambda slip: 0.01 + 0 * slip, 7)
    assert force == pytest.approx(-0.01 * WEIGHT * np.array([0.6, 0.8]), rel=1e-12)
    assert torque == pytest.approx(0.0, abs=1e-12)


def test_turning_on_the_spot_is_slowed_by_the_whole_load() -> None:
    force, torque = friction_of_pebbles(STONE, (0.0, 0.0), -2.0, lambda slip: 0.01 + 0 * slip, 16)
    assert force == pytest.approx([0, 0], abs=1e-12)
    assert torque == pytest.approx(0.01 * WEIGHT * STONE.band_radius, rel=1e-12)
