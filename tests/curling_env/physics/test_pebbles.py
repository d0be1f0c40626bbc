"""The paper's sum over pebbles, and the compiled law as its limit."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.effects.speed_dependent_friction import SLOWEST_SLIP
from curling_env.physics.law import acceleration
from curling_env.physics.pebbles import friction_of_pebbles
from curling_env.sheet import RULE_BOOK_STONE as STONE

MU = 0.0085
WEIGHT = STONE.mass * 9.80665
STATES = [((0.3, 2.0), 1.5), ((-0.02, 0.05), -1.5), ((0.0, 0.03), 3.0), ((0.5, -0.1), 0.0)]
STATE = pytest.mark.parametrize(("velocity", "spin"), STATES)


def error(
    exponent: float, velocity: tuple[float, float], spin: float, pebbles: int
) -> tuple[float, float]:
    """How far the sum over so many pebbles is from the compiled law, over μmg and μmgr."""
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
