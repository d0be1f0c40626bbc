"""A plan of throws against the estimator that would use them, and its command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import PAPER_SHEET, TEE_Y, Direction
from curling_env.units import Units
from friction_estimation import estimate_ice
from friction_estimation.design import Design, ThrowKind, design_throws, draw_speeds
from tests.friction_estimation.design.cell_bound import cell_bound

X, Y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
PLAYED = (np.abs(X) <= 1.5) & (np.abs(Y) <= TEE_Y)
"""The cells in which a plan counts errors: between the tees, away from the sides."""


def test_the_plans_error_is_the_bound_of_its_throws():
    plan = design_throws(resolution=2.0, precision=0.02)
    bound = cell_bound(
        [kind.release for kind in plan.kinds], mu=0.009, noise=0.005, fps=30, spread=0.05,
        length=2.0,
    )  # fmt: skip
    played = bound.sigma[PLAYED] / 0.009
    assert plan.error[-1] == pytest.approx(np.sqrt((played**2).mean()), rel=0.01)
    assert plan.error[-1] <= 0.02 < plan.error[-2]


def test_the_estimator_keeps_what_the_plan_promises(sliding):
    plan = design_throws(resolution=2.0, precision=0.015)
    starts = np.array([[k.x, k.y, k.vx, k.vy, 1.0] for k in (kind.release for kind in plan.kinds)])
    squares = []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        field = sliding.random_field(rng, mu=0.009, spread=0.05, length=2.0, rough=True)
        tracks = sliding.measured_throws(field, starts, rng)
        found = estimate_ice(tracks, effects="none").ice.friction
        squares.append(((found.mu / field(X, Y) - 1)[PLAYED] ** 2).mean())
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
    plan = design_throws(resolution=2.0, precision=0.02, speeds=[2.0])
    assert {kind.speed for kind in plan.kinds} == {2.0}
    assert len({kind.direction for kind in plan.kinds}) == 2
    assert sum(plan.counts.values()) == len(plan.kinds)
    slow, draw, fast = draw_speeds(0.009)
    assert slow < draw < fast
    assert draw == pytest.approx(2.24, abs=0.01)


def test_what_no_session_reaches_is_reported():
    plan = design_throws(resolution=1.0, precision=0.001, speeds=[3.0])
    assert not plan.reached
    assert "out of reach" in plan.in_words()
    assert "out of reach" not in replace(plan, precision=1.0).in_words()


@pytest.mark.parametrize(
    ("changes", "says"),
    [({"resolution": 0.2}, "finer than a cell"), ({"precision": 0.0}, "precision must be"),
     ({"noise": -1.0}, "noise must be")],
)  # fmt: skip
def test_numbers_that_make_no_sense_are_refused(changes, says):
    with pytest.raises(InputError, match=says):
        design_throws(**{"resolution": 2.0, "precision": 0.02} | changes)


def test_cells_finer_than_the_detail_cost_nothing():
    asked = {"resolution": 2.0, "precision": 0.06}
    fine = design_throws(**asked, sheet=replace(PAPER_SHEET, cell_size=0.02))
    usual = design_throws(**asked)
    assert (fine.kinds, fine.error) == (usual.kinds, usual.error)


def test_more_detail_than_can_be_weighed_is_refused():
    with pytest.raises(InputError, match="choose a coarser resolution"):
        design_throws(resolution=0.2, precision=0.05, sheet=replace(PAPER_SHEET, cell_size=0.05))


def test_a_design_in_numbers():
    kinds = [ThrowKind(speed=2.0, line=0.5, direction=Direction.AWAY)] * 2
    kinds += [ThrowKind(speed=1.6, line=0.0, direction=Direction.HOME)]
    plan = Design(
        resolution=2.0,
        precision=0.02,
        kinds=tuple(kinds),
        error=(0.04, 0.03, 0.02),
        even_error=0.001,
    )
    assert plan.reached
    assert not replace(plan, error=(0.04, 0.03, 0.02001)).reached
    found = plan.summary()
    assert found["kinds"] == [
        {"times": 2, "speed": 2.0, "from": "home", "line_x_m": 0.5},
        {"times": 1, "speed": 1.6, "from": "away", "line_x_m": 0.0},
    ]
    assert found["throws"] == 3
    assert found["error_percent"] == pytest.approx(2.0)
    assert found["error_of_one_number_percent"] == pytest.approx(0.1)
    assert found["error_percent_after_throws"] == pytest.approx([4.0, 3.0, 2.0])
    assert (found["resolution_m"], found["precision_percent"]) == (2.0, 2.0)
    assert plan.in_words().startswith(
        "2 % at a resolution of 2 m takes 3 throws: 1 at 1.60 m/s, 2 at 2.00 m/s; 2 of them from "
        "the home end and 1 from the away end; on lines 0, +0.5 m"
    )
    assert plan.in_words(Units.FEET).startswith(
        "2 % at a resolution of 6.6 ft takes 3 throws: 1 at 5.2 ft/s, 2 at 6.6 ft/s; 2 of them "
        "from the home end and 1 from the away end; on lines 0, +1.6 ft"
    )
    away, home = kinds[0].release, ThrowKind(speed=1.6, line=0.5, direction=Direction.HOME).release
    assert (away.x, home.x) == (0.5, 0.5)
    assert away.vy == pytest.approx(2.0)
    assert home.vy == pytest.approx(-1.6)
