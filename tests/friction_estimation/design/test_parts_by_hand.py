"""Parts of a plan against closed forms and brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import HOG_LINE_Y, PAPER_SHEET, TEE_Y, Direction, Sheet
from curling_env.throw import MAX_SPEED, Release
from curling_env.units import Units
from friction_estimation.design import (
    Design,
    ThrowKind,
    cramer_rao,
    design,
    design_throws,
    draw_speeds,
    uniform_bound,
)
from friction_estimation.design.cramer_rao import (
    ThrowResponse,
    check_positive,
    field_covariance,
    throw_response,
)

MU, G = 0.009, 9.80665
COARSE = Sheet(width=4.0, length=40.0, cell_size=0.5)


# --- bounds ---------------------------------------------------------------------------------------


def least_squares_error(t: np.ndarray, noise: float) -> float:
    """Standard error of μ in s = s₀ + v₀t − ½gμt², by the normal equations."""
    basis = np.column_stack([np.ones_like(t), t, -0.5 * G * t**2])
    return float(noise * np.sqrt(np.linalg.inv(basis.T @ basis)[2, 2]))


@pytest.mark.parametrize(("distance", "seconds"), [(np.inf, 2.0 / (G * MU)), (3.0, None)])
def test_a_bound_is_the_error_of_least_squares(distance, seconds):
    if seconds is None:
        seconds = np.roots([0.5 * G * MU, -2.0, distance]).min()
    expected = least_squares_error(np.arange(0.0, seconds, 0.1), 0.02)
    found = uniform_bound(2.0, mu=MU, noise=0.02, fps=10.0, distance=distance)
    assert found == pytest.approx(expected, rel=1e-6)
    # A throw that rests before is seen until it rests.
    near = uniform_bound(2.0, mu=MU, noise=0.02, fps=10.0, distance=2.0**2 / (2 * G * MU) + 1e-6)
    assert near == pytest.approx(uniform_bound(2.0, mu=MU, noise=0.02, fps=10.0))


def test_a_throw_counts_from_its_fourth_frame():
    a = G * MU
    at = {frames: 2.0 * s - 0.5 * a * s**2 for frames, s in ((3, 0.25), (4, 0.35), (5, 0.45))}
    four = uniform_bound(2.0, mu=MU, noise=0.02, fps=10.0, distance=at[4])
    assert four == pytest.approx(least_squares_error(np.arange(4) / 10, 0.02), rel=1e-6)
    with pytest.raises(InputError, match="at least 4 frames each"):
        uniform_bound(2.0, mu=MU, noise=0.02, fps=10.0, distance=at[3])
    both = uniform_bound([2.0, 0.2], mu=MU, noise=0.02, fps=10.0, distance=at[4])
    slow = least_squares_error(np.arange(0.0, 0.2 / a, 0.1), 0.02)
    assert both == pytest.approx((four**-2 + slow**-2) ** -0.5, rel=1e-5)


def test_positive_is_above_zero_and_finite():
    check_positive(speed=1e-9, mu=1e9)
    for value in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(InputError, match=f"fps must be positive and finite, got {value}"):
            check_positive(mu=1.0, fps=value)


def test_weights_of_cells_are_bilinear():
    """Halfway between four centres each has a quarter; beyond the outermost they are constant."""
    x, y = COARSE.x_centres, COARSE.y_centres
    columns = COARSE.shape[1]
    places = np.array(
        [
            [(x[1] + x[2]) / 2, (y[4] + y[5]) / 2],
            [0.75 * x[0] + 0.25 * x[1], y[3]],
            [x[-1] + 0.2, y[-1] + 0.2],
        ]
    )
    weights = cramer_rao._bilinear_weights(places, COARSE)
    for found, expected in zip(
        weights,
        (
            {4 * columns + 1: 0.25, 4 * columns + 2: 0.25}
            | {5 * columns + 1: 0.25, 5 * columns + 2: 0.25},
            {3 * columns: 0.75, 3 * columns + 1: 0.25},
            {len(y) * columns - 1: 1.0},
        ),
        strict=True,
    ):
        whole = np.zeros(len(y) * columns)
        whole[list(expected)] = list(expected.values())
        assert found == pytest.approx(whole)


def test_a_straight_path_ends_at_rest_or_on_leaving_the_sheet():
    release = Release(x=0.1, y=-19.9, vx=0.03, vy=0.4)
    v = np.hypot(0.03, 0.4)
    t, xy = cramer_rao._straight_path(release, MU, COARSE)
    assert np.diff(t) == pytest.approx(0.01)
    assert t[-1] == pytest.approx(v / (G * MU), abs=0.01)
    run = v * t - 0.5 * G * MU * t**2
    assert xy[:, 0] == pytest.approx(0.1 + run * 0.03 / v)
    assert xy[:, 1] == pytest.approx(-19.9 + run * 0.4 / v)
    t, xy = cramer_rao._straight_path(replace(release, x=1.5, vx=0.4, vy=0.03), MU, COARSE)
    assert COARSE.contains(xy).all()
    assert 2.0 - xy[-1, 0] < 0.01 * 0.4
    outside = replace(release, y=-30.0)
    assert len(cramer_rao._straight_path(outside, MU, COARSE)[0]) == 2


def test_a_response_is_the_change_of_the_path_by_a_cell():
    """Brute force: one cell's friction is raised, and the path integrated step by step."""
    release = Release(x=0.3, y=-19.9, vx=0.0, vy=0.45)
    found = throw_response(release, mu=MU, fps=5.0, sheet=COARSE)
    cell = 1 * COARSE.shape[1] + 4
    dt, excess = 0.001, 1e-3
    times = np.arange(0.0, 0.45 / (G * MU), dt)
    fast, ahead, change = 0.0, 0.0, []
    y = -19.9 + 0.45 * times - 0.5 * G * MU * times**2
    across = 1.0 - abs(0.3 - COARSE.x_centres[4]) / 0.5
    weight = across * np.maximum(0.0, 1.0 - np.abs(y - COARSE.y_centres[1]) / 0.5)
    for share in weight:
        change.append(ahead)
        fast -= G * MU * excess * share * dt
        ahead += fast * dt
    seen = np.arange(0.0, times[-1], 0.2)
    expected = np.interp(seen, times, change) / excess
    basis = np.column_stack([np.ones_like(seen), seen])
    expected -= basis @ np.linalg.lstsq(basis, expected)[0]
    column = found.touched.tolist().index(cell)
    assert len(found.response) == len(seen)
    assert found.response[:, column] == pytest.approx(expected, abs=0.02 * np.abs(expected).max())
    assert found.touched.tolist() == sorted(set(found.touched.tolist()))
    row, place = np.divmod(found.crossed, COARSE.shape[1])
    assert set(place.tolist()) == {4}
    assert row.tolist() == list(range(int((0.1 + 0.45**2 / (2 * G * MU)) / 0.5) + 1))


def test_a_prior_is_a_field_upon_a_level():
    prior = field_covariance(COARSE, spread=0.1, length=2.0)
    assert prior.shape == (640, 640)
    assert np.diag(prior) == pytest.approx(np.full(640, 1.01))
    r = np.sqrt(5.0) * np.hypot(0.5, 1.0) / 2.0
    expected = 1.0 + 0.01 * (1 + r + r**2 / 3) * np.exp(-r)
    assert prior[0, 2 * COARSE.shape[1] + 1] == pytest.approx(expected)
    assert prior[0, 1] == pytest.approx(prior[0, COARSE.shape[1]])
    rough = field_covariance(COARSE, spread=0.1, length=2.0, smoothness=1.5)
    r *= np.sqrt(3.0 / 5.0)
    assert rough[0, 17] == pytest.approx(1.0 + 0.01 * (1 + r) * np.exp(-r))


# --- plans ----------------------------------------------------------------------------------------


def test_draws_run_from_the_hog_line_to_the_far_tee():
    run = HOG_LINE_Y + TEE_Y
    slow, draw, fast = draw_speeds(0.008)
    assert draw**2 / (2 * G * 0.008) == pytest.approx(run, abs=0.3)
    assert slow == pytest.approx(0.8 * draw, abs=0.011)
    assert fast == pytest.approx(1.25 * draw, abs=0.011)
    assert draw_speeds(0.2)[1:] == (MAX_SPEED, MAX_SPEED)


@pytest.mark.parametrize(
    ("resolution", "lines"),
    [
        (0.5, np.arange(-1.5, 1.6, 0.5)),
        (1.0, np.arange(-1.5, 1.6, 0.75)),
        (3.0, np.arange(-1.5, 1.6, 0.75)),
        (0.74, np.arange(-1.5, 1.6, 0.5)),
    ],
)
def test_lines_are_symmetric_and_no_further_apart_than_the_detail(resolution, lines):
    assert design._lines(resolution) == pytest.approx(lines)


def test_the_ice_in_play_is_between_the_tees():
    played = design._played(PAPER_SHEET).reshape(PAPER_SHEET.shape)
    x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
    assert (played == ((abs(x) <= 1.5) & (abs(y) <= TEE_Y))).all()
    assert played.any()
    assert not played.all()


@pytest.mark.parametrize(
    ("cell", "resolution", "side"), [(0.05, 0.6, 0.3), (0.05, 9.0, None), (1.0, 1.0, 1.0)]
)
def test_cells_are_half_the_detail_or_those_of_the_paper(cell, resolution, side):
    sheet = design._coarse_enough(replace(PAPER_SHEET, cell_size=cell), resolution)
    assert sheet.cell_size == (side or PAPER_SHEET.cell_size)


def test_as_many_cells_as_can_be_weighed_are_allowed(monkeypatch):
    count = PAPER_SHEET.shape[0] * PAPER_SHEET.shape[1]
    monkeypatch.setattr(design, "_MAX_CELLS", count)
    design._coarse_enough(PAPER_SHEET, 2.0)
    monkeypatch.setattr(design, "_MAX_CELLS", count - 1)
    with pytest.raises(InputError, match=f"needs {count} cells on this sheet; expected at most"):
        design._coarse_enough(PAPER_SHEET, 2.0)


def test_directions_that_hardly_inform_are_dropped(rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    sizes = np.array([2.0, 0.31, 0.29])
    response = 0.004 * np.diag(sizes) @ turn
    thrown = ThrowResponse(touched=np.array([4, 7, 9]), response=response, crossed=np.array([4]))
    found = design._informative_rows(thrown, 0.004)
    assert found.touched.tolist() == [4, 7, 9]
    expected = turn.T[:, :2] * sizes[:2] ** 2 @ turn[:2]
    assert found.rows.shape == (2, 3)
    assert found.rows.T @ found.rows == pytest.approx(expected)


def test_the_greedy_plan_takes_the_best_throw_each_time():
    """Brute force: every kind is tried by adding information, and the errors are its own."""
    sheet = replace(PAPER_SHEET, cell_size=1.5)
    reported = []
    plan = design_throws(
        resolution=3.0,
        precision=0.03,
        speeds=[1.9],
        fps=1.5,
        sheet=sheet,
        noise=0.01,
        progress=lambda words, share: reported.append((words, share)),
    )
    kinds = [
        ThrowKind(speed=speed, line=line, direction=direction)
        for speed in (1.9,)
        for line in np.arange(-1.5, 1.6, 0.75)
        for direction in (Direction.AWAY, Direction.HOME)
    ]
    rough = design._coarse_enough(sheet, 3.0)
    covariance = field_covariance(rough, spread=0.05, length=3.0)
    x, y = np.meshgrid(rough.x_centres, rough.y_centres)
    played = ((abs(x) <= 1.5) & (abs(y) <= TEE_Y)).ravel()
    responses = {kind: throw_response(kind.release, mu=MU, fps=1.5, sheet=rough) for kind in kinds}
    for kind, error in zip(plan.kinds, plan.error, strict=True):
        after = {}
        for other, one in responses.items():
            rows = np.zeros((len(one.response), len(covariance)))
            rows[:, one.touched] = one.response / 0.01
            inner = np.eye(len(rows)) + rows @ covariance @ rows.T
            gain = np.linalg.solve(inner, rows @ covariance)
            after[other] = covariance - (rows @ covariance).T @ gain
        sizes = {other: np.sqrt(np.diag(c)[played].mean()) for other, c in after.items()}
        assert sizes[kind] == pytest.approx(min(sizes.values()), rel=1e-3)
        assert error == pytest.approx(sizes[kind], rel=2e-3)
        covariance = after[kind]
    assert plan.error[-1] <= 0.03 < plan.error[-2]
    assert reported[-1] == ("choose throws", 1.0)
    assert reported[0] == ("choose throws", pytest.approx(0.03 / plan.error[0]))
    even = uniform_bound(
        [kind.speed for kind in plan.kinds],
        mu=MU,
        noise=0.01,
        fps=1.5,
        distance=HOG_LINE_Y + TEE_Y,
    )
    assert plan.even_error == pytest.approx(even / MU)


def test_a_plan_ends_after_the_most_throws(monkeypatch):
    monkeypatch.setattr(design, "_MAX_THROWS", 3)
    plan = design_throws(resolution=3.0, precision=1e-6, speeds=[2.0], fps=1.5, sheet=COARSE)
    assert len(plan.kinds) == len(plan.error) == 3


def test_a_plan_out_of_reach_says_what_it_reaches():
    kind = ThrowKind(speed=2.0, line=-0.75, direction=Direction.HOME)
    plan = Design(resolution=1.5, precision=0.005, kinds=(kind,), error=(0.0123,), even_error=0.001)
    assert plan.in_words().startswith(
        "0.5 % at a resolution of 1.5 m is out of reach: 1 throws give 1.2 %; choose "
    )
    reached = replace(plan, precision=0.02)
    assert reached.in_words().startswith(
        "2 % at a resolution of 1.5 m takes 1 throw: 1 at 2.00 m/s; 0 of them from the home end "
        "and 1 from the away end; on lines −0.75 m beside the centre line."
    )
    assert "on lines −2.5 ft beside" in reached.in_words(Units.FEET)
