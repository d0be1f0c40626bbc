"""A throw as it is fitted: first values, noise of its rows, sweeping, and its residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.sheet import PAPER_SHEET
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.throw.fitted import (
    crossed_cells,
    initial_level,
    initialise_throw,
    move_release,
    relative_noise,
    swept_intervals,
    update_residual,
)
from friction_estimation.inversion.throw.forward import LawOnMap
from friction_estimation.inversion.throw.linearised import linearise
from friction_estimation.inversion.tuning import USUAL_SPIN
from friction_estimation.tracks.free_slide import free_slide


@pytest.fixture
def track(sliding, rng):
    return sliding.measured_throws(
        sliding.uniform(0.009), sliding.varied_starts(rng, 2), rng, noise=0.001
    )[0]


def test_sweeping_is_told_by_its_beginnings_and_ends():
    t = np.arange(6.0)
    assert swept_intervals(t, np.array([0, 1, 1, 0, 0, 1.0])).tolist() == [[1, 3], [5, 6]]
    assert swept_intervals(t, np.array([1, 0, 0, 0, 0, 0.4])).tolist() == [[0, 1]]
    assert swept_intervals(t, np.zeros(6)).shape == (0, 2)


def test_a_row_twice_as_uncertain_counts_half(track):
    sigma = np.full(len(track), 0.002)
    sigma[10], sigma[11], sigma[12], sigma[13] = 0.004, 0.2, 1e-5, np.nan
    scale = relative_noise(free_slide(replace(track, sigma_xy=sigma)))
    rows = free_slide(track).rows
    at = {int(row): k for k, row in enumerate(rows)}
    assert scale[at[20]] == 1.0
    assert scale[at[10]] == pytest.approx(2**0.5)
    assert scale[at[11]] == pytest.approx(10**0.5)
    assert scale[at[12]] == pytest.approx(0.1**0.5)
    assert scale[at[13]] == 1.0
    assert relative_noise(free_slide(track)).tolist() == [1.0] * len(rows)


def test_first_values_are_near_and_the_residuals_under_the_true_law_are_noise(track):
    throw = initialise_throw(free_slide(track), 3)
    assert throw.inputs.order == 3
    assert throw.heading_seen
    assert throw.t[0] == 0.0
    assert throw.start == pytest.approx(0.0, abs=0.01)
    first = np.hypot(*(throw.slide.xy[15] - throw.slide.xy[0])) / (throw.t[15] - throw.t[0])
    assert throw.speed == pytest.approx(first, rel=0.05)
    ice = Ice.uniform(0.009)
    assert initial_level(throw, ice) == pytest.approx(np.log(0.009), abs=0.05)
    law = LawOnMap.of(ice)
    for _ in range(3):
        throw, motion = update_residual(throw, law, Noise(white=0.001))
        step = linearise(throw, motion, law, Noise(white=0.001))
        throw = move_release(throw, step.release_step(np.zeros(len(step.crossed))), 0.0)
    throw, _ = update_residual(throw, law, Noise(white=0.001))
    assert throw.keep.mean() > 0.98
    assert throw.residual[throw.keep].std() == pytest.approx(0.001, rel=0.2)
    assert abs(throw.residual[throw.keep].mean()) < 1e-4


def test_without_a_heading_a_stone_is_taken_to_turn_as_usual(track):
    blind = initialise_throw(free_slide(replace(track, theta=np.full(len(track), np.nan))), 0)
    assert not blind.heading_seen
    assert blind.inputs.spin == USUAL_SPIN


def test_a_fit_that_is_far_off_calls_no_row_wild(track):
    throw = initialise_throw(free_slide(track), 0)
    away, _ = update_residual(replace(throw, speed=1.3 * throw.speed), LawOnMap.of(
        Ice.uniform(0.009)), Noise(white=0.001))  # fmt: skip
    assert away.keep.all()
    assert np.abs(away.residual).max() > 1.0


def test_a_release_moves_by_a_step_that_cannot_turn_it_back(track):
    throw = initialise_throw(free_slide(track), 0)
    moved = move_release(throw, np.array([0.02, -0.01]), 0.3)
    assert moved.start == pytest.approx(throw.start + 0.02)
    assert moved.speed == pytest.approx(throw.speed - 0.01)
    assert moved.offset == 0.3
    held = move_release(throw, np.array([0.1, -10.0]), 0.0)
    assert held.speed == pytest.approx(0.7 * throw.speed)
    assert held.start == pytest.approx(throw.start + 0.1 * 0.03 * throw.speed)


def test_crossed_cells_are_those_under_the_path(track):
    throw = initialise_throw(free_slide(track), 0)
    crossed = crossed_cells([throw], Ice.uniform(0.009))
    rows, columns = PAPER_SHEET.cell_of(throw.slide.xy)
    under = np.zeros(PAPER_SHEET.shape, dtype=bool)
    under[rows, columns] = True
    assert (crossed & under).sum() >= 0.97 * under.sum()
    assert (crossed & ~under).sum() <= 4


def test_start_and_speed_are_projected_out(track, rng):
    """What is left of residual and columns is what no start and speed can imitate."""
    ice = Ice.uniform(0.009)
    law, noise = LawOnMap.of(ice), Noise(white=0.002, slow=0.001, time=0.3)
    throw = initialise_throw(free_slide(track), 0)
    throw, motion = update_residual(throw, law, noise)
    one = linearise(throw, motion, law, noise)
    moved = linearise(
        replace(throw, residual=throw.residual + 0.3 + 0.0 * throw.t), motion, law, noise
    )
    assert moved.residual == pytest.approx(one.residual, abs=1e-6)
    assert moved.release_step(np.zeros(len(one.crossed)))[0] == pytest.approx(
        one.release_step(np.zeros(len(one.crossed)))[0] + 0.3, abs=1e-6
    )
    # The step is the least-squares fit of start and speed to what the change leaves.
    change = rng.normal(0, 0.01, len(one.crossed))
    step = one.release_step(change)
    left = one.release_residual - one.release_friction @ change
    assert one.release_root @ step == pytest.approx(left)
    assert one.effects.shape == (len(one.residual), 0)
    assert one.friction.shape == (len(one.residual), len(one.crossed))
