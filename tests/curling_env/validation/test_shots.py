"""Throws of the table against the textbook's formulas for constant friction."""

from __future__ import annotations

import math

import pytest

from curling_env.ice import Ice, load_ice
from curling_env.sheet import HOG_TO_FAR_TEE, Stone
from curling_env.validation import HOG_TO_HOG, Shots

G = 9.80665
MU = 0.01


@pytest.fixture(scope="module")
def shots() -> Shots:
    return Shots(Ice.uniform(MU, stone=Stone(band_radius=0.0)))


def test_distance_and_time_of_a_throw_agree_with_coulomb(shots: Shots) -> None:
    assert shots.carry(2.0) == pytest.approx(4.0 / (2 * MU * G), abs=1e-4)
    run = shots.run(2.0)
    assert run is not None
    assert run.time == pytest.approx(2.0 / (MU * G), abs=1e-3)
    assert shots.weight(HOG_TO_FAR_TEE) == pytest.approx(
        math.sqrt(2 * MU * G * HOG_TO_FAR_TEE), abs=1e-5
    )


def test_the_times_of_watches(shots: Shots) -> None:
    v = math.sqrt(2 * MU * G * HOG_TO_FAR_TEE)
    arrives = (v - math.sqrt(v**2 - 2 * MU * G * HOG_TO_HOG)) / (MU * G)
    assert shots.hog_to_hog(HOG_TO_FAR_TEE) == pytest.approx(arrives, abs=1e-4)
    assert shots.time_to(HOG_TO_HOG, 1.0) is None
    # The speed that takes ten seconds: d = v·t − μgt²/2.
    v = HOG_TO_HOG / 10 + MU * G * 10 / 2
    assert shots.weight_of_time(10.0) == pytest.approx(v, abs=1e-5)


def test_ice_is_scaled_until_a_throw_carries_as_wanted(shots: Shots) -> None:
    scaled = shots.scaled_until(lambda other: other.carry(2.0), 30.0)
    assert scaled is not None
    assert scaled.ice.friction.mu[0, 0] == pytest.approx(4.0 / (2 * 30.0 * G), rel=1e-6)
    assert shots.scaled_until(lambda other: other.carry(2.0), 1e6) is None


def test_ice_on_which_no_stone_stops_gives_nothing() -> None:
    steep = Shots(load_ice("paper")).with_effect("slope", x=0.0, y=0.004)
    assert steep.run(2.0) is None
    assert steep.carry(2.0) == math.inf
    assert steep.draw is None
    assert steep.draw_turning(2.0) is None


def test_friction_is_the_deceleration_over_g(shots: Shots) -> None:
    assert shots.friction_at(1.0) == pytest.approx(MU, rel=1e-9)
    scaled = shots.scaled(0.5)
    assert scaled.friction_at(1.0) == pytest.approx(MU / 2, rel=1e-9)
