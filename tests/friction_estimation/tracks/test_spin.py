"""The spin of a thrown stone, from its measured heading."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.tracks import FreeSlide, fit_spin, has_heading
from friction_estimation.tracks.tuning import MIN_HEADINGS

MU_G, V0 = 0.09, 2.2


def sliding_stone(theta_of) -> FreeSlide:
    t = np.arange(0.0, 18.0, 1 / 15)
    v = V0 - MU_G * t
    theta = theta_of(t, v / V0)
    track = Trajectory(t=t, xy=np.column_stack([0 * t, V0 * t - MU_G * t**2 / 2]), theta=theta)
    return FreeSlide(
        track=track,
        rows=np.arange(len(t)),
        stretch=(0, len(t)),
        rests=True,
        wild=0,
        noise=0.001,
    )


def turned(power: float, spin: float, heading: float):
    def theta(t, ratio):
        # ∫ ω₀ (v/v₀)^p dt with v falling evenly
        return heading + spin * V0 / MU_G * (1 - ratio ** (power + 1)) / (power + 1)

    return theta


@pytest.mark.parametrize("power", [0.0, 0.3, 0.8, 1.2])
@pytest.mark.parametrize("spin", [-1.4, 0.9])
def test_spin_power_and_heading_are_found(power, spin, rng):
    exact = turned(power, spin, 0.4)
    slide = sliding_stone(lambda t, ratio: exact(t, ratio) + rng.normal(0, 0.01, len(t)))
    found = fit_spin(slide)
    assert found[0] == pytest.approx(spin, rel=0.02)
    assert found[1] == pytest.approx(power, abs=0.11)
    assert found[2] == pytest.approx(V0, rel=0.02)
    assert found[3] == pytest.approx(0.4, abs=0.02)


def test_wild_headings_are_held_down(rng):
    exact = turned(0.3, 1.2, 0.0)

    def wild(t, ratio):
        theta = exact(t, ratio) + rng.normal(0, 0.01, len(t))
        theta[10:200:20] += 2.0
        return theta

    assert fit_spin(sliding_stone(wild))[0] == pytest.approx(1.2, rel=0.03)


@pytest.mark.parametrize(("count", "enough"), [(MIN_HEADINGS - 1, False), (MIN_HEADINGS, True)])
def test_too_few_headings_give_no_spin(count, enough):
    exact = turned(0.3, 1.2, 0.0)

    def rarely(t, ratio):
        theta = np.full(len(t), np.nan)
        rows = np.linspace(0, len(t) - 1, count).astype(int)
        theta[rows] = exact(t, ratio)[rows]
        return theta

    slide = sliding_stone(rarely)
    assert has_heading(slide) is enough
    spin, power, speed, heading = fit_spin(slide)
    assert speed == pytest.approx(V0, rel=0.02)
    if enough:
        assert spin == pytest.approx(1.2, rel=0.05)
    else:
        assert (spin, power, heading) == (0.0, 0.2, 0.0)
