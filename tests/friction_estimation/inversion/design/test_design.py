"""A plan of throws against the estimator that would use them, and its command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import PAPER_SHEET
from friction_estimation.inversion import cell_bound, estimate_ice
from friction_estimation.inversion.design.design import _played, design_throws, draw_speeds


def test_the_plans_error_is_the_bound_of_its_throws():
    plan = design_throws(resolution=2.0, precision=0.02)
    bound = cell_bound(
        [kind.release for kind in plan.kinds], mu=0.009, noise=0.005, fps=30, spread=0.05,
        length=2.0,
    )  # fmt: skip
    played = bound.sigma.ravel()[_played(PAPER_SHEET)] / 0.009
    assert plan.error[-1] == pytest.approx(np.sqrt((played**2).mean()), rel=0.01)
    assert plan.error[-1] <= 0.02 < plan.error[-2]


def test_the_estimator_keeps_what_the_plan_promises(sliding):
    plan = design_throws(resolution=2.0, precision=0.015)
    starts = np.array([[k.x, k.y, k.vx, k.vy, 1.0] for k in (kind.release for kind in plan.kinds)])
    x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
    played = _played(PAPER_SHEET).reshape(PAPER_SHEET.shape)
    squares = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        field = sliding.random_field(rng, mu=0.009, spread=0.05, length=2.0, rough=True)
        found = estimate_ice(sliding.measured_throws(field, starts, rng)).ice.friction
        squares.append(((found.mu / field(x, y) - 1)[played] ** 2).mean())
    # A Matérn 3/2 field is rougher than the plan's 5/2; a few throws leave hyperparameters open.
    assert np.sqrt(np.mean(squares)) < 1.6 * 0.015


def test_more_is_needed_for_more_detail_precision_and_noise():
    def throws(**changes):
        return len(design_throws(**{"resolution": 2.0, "precision": 0.015} | changes).kinds)

    usual = throws()
    assert throws(precision=0.01) > usual
    assert throws(resolution=1.0) > usual
    assert throws(noise=0.02) > usual
    assert throws(fps=60, noise=0.003) <= usual


def test_both_ends_and_given_speeds_are_used():
    plan = design_throws(resolution=2.0, precision=0.01, speeds=[2.0])
    assert {kind.speed for kind in plan.kinds} == {2.0}
    assert len({kind.direction for kind in plan.kinds}) == 2
    assert sum(plan.counts.values()) == len(plan.kinds)
    slow, draw, fast = draw_speeds(0.009)
    assert slow < draw < fast
    assert draw == pytest.approx(2.24, abs=0.01)


def test_what_no_session_reaches_is_said():
    plan = design_throws(resolution=1.0, precision=0.001, speeds=[3.0])
    assert not plan.reached
    assert "out of reach" in plan.words
    assert "out of reach" not in replace(plan, precision=1.0).words


@pytest.mark.parametrize(
    ("changes", "says"),
    [({"resolution": 0.2}, "finer than a cell"), ({"precision": 0.0}, "precision must be"),
     ({"noise": -1.0}, "noise must be")],
)  # fmt: skip
def test_numbers_that_make_no_sense_are_refused(changes, says):
    with pytest.raises(InputError, match=says):
        design_throws(**{"resolution": 2.0, "precision": 0.02} | changes)
