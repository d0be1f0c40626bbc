"""Decisions of discovery on each side of its thresholds, and grids without gaps."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm, ttest_1samp

from curling_env.physics import catalogue
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from friction_estimation.discovery import (
    Combination,
    Dependence,
    SessionNoise,
    Term,
    crossed_by,
    estimate_noise,
    field_along,
    fields_to_try,
    first_friction,
    neutral_values,
    open_session,
    p_of_mean,
    read_reference,
    ripple_over,
    without_outliers,
)
from friction_estimation.discovery.data.outliers import slow_basis
from friction_estimation.discovery.data.references import Calibration
from friction_estimation.discovery.evidence.intervals import integrated_spreads
from friction_estimation.discovery.evidence.unknown.pushes import pushes_over_time
from friction_estimation.discovery.model.candidates import Belief
from friction_estimation.discovery.model.gaussian_field import systematic_error_of
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.noise import (
    _series_of,
    fast_cosines,
    fast_part,
    outlying_rows,
)
from friction_estimation.discovery.model.quadratic import prior_gram
from friction_estimation.discovery.naming import _with_structure
from friction_estimation.discovery.search.residuals import Misfit, throw_tolerance_of
from friction_estimation.discovery.tuning import MAP_AMPLITUDES, SIDE_SHIFTS

from .conftest import plain_session

T = np.arange(0.0, 30.0, 0.1)


def left_of(wave: np.ndarray, basis: np.ndarray) -> float:
    """Share of a wave's size that a basis does not reproduce."""
    rest = wave - basis @ np.linalg.lstsq(basis, wave)[0]
    return float(np.linalg.norm(rest) / np.linalg.norm(wave))


def wave_of(period: float) -> np.ndarray:
    return np.sin(2 * np.pi * T / period + 0.4)


# --- what is motion, and what is noise -----------------------------------------------------------


def test_a_wave_of_three_seconds_is_motion_and_one_of_one_and_a_half_is_noise():
    assert left_of(wave_of(2.6), slow_basis(T)) < 0.1
    assert left_of(wave_of(1.4), slow_basis(T)) > 0.9


def test_a_smoother_flattens_waves_of_two_seconds_and_not_of_three():
    assert left_of(wave_of(2.2), fast_cosines(T)) < 0.2
    assert left_of(wave_of(3.0), fast_cosines(T)) > 0.9


def test_only_series_of_twenty_rows_are_filtered():
    for rows, filtered in ((19, False), (20, True)):
        session = plain_session(throws=1, rows=rows)
        residuals = np.random.default_rng(1).normal(size=(rows, 3))
        assert np.isfinite(fast_part(session, residuals)).all() == filtered


def test_a_row_is_an_outlier_beyond_four_and_a_half_deviations():
    """Robust ones, of normal quantiles in random order."""
    rows = 600
    session = plain_session(throws=1, rows=rows, spacing=0.05)
    values = np.random.default_rng(5).permutation(norm.ppf((np.arange(rows) + 0.5) / rows))
    values[[0, 200, 400]] = 30.0, 3.95, 5.05
    residuals = 0.01 * np.column_stack([values, 0 * values, 0 * values])
    assert np.flatnonzero(outlying_rows(session, residuals)).tolist() == [400]


@pytest.mark.parametrize("channel", [0, 2])
def test_deviations_below_the_rounding_of_tracks_are_no_outliers(channel):
    session = plain_session(throws=1, rows=100)
    for size, outlying in ((5e-4, False), (2e-3, True)):
        residuals = np.zeros((100, 3))
        residuals[50, channel] = size
        assert outlying_rows(session, residuals)[50] == outlying


def test_a_clean_track_loses_no_row_and_a_jump_of_its_place_or_heading_is_dropped():
    t = np.arange(0.0, 15.0, 0.05)
    y = -10.0 + 2.0 * t - 0.045 * t**2
    theta = 1.2 * t - 0.02 * t**2
    clean = Trajectory(t=t, xy=np.column_stack([0 * t, y]), theta=theta)
    kept = without_outliers(clean)
    assert len(kept) == len(clean)
    assert np.isfinite(kept.theta).all()
    xy, turned = clean.xy.copy(), clean.theta.copy()
    xy[60, 0] += 0.05
    turned[120] += 0.5
    kept = without_outliers(replace(clean, xy=xy, theta=turned))
    assert np.isin(t, kept.t).tolist() == [k != 60 for k in range(len(t))]
    assert np.isnan(kept.theta[kept.t == t[120]]).all()
    assert np.isnan(kept.theta).sum() == 1


def with_memory(session: Any, memory: float) -> np.ndarray:
    """Residuals of 5 mm that fade within a time."""
    rng, out = np.random.default_rng(3), np.empty((len(session.times), 3))
    for i in range(len(session)):
        rows = session.rows(i)
        keep = np.exp(-np.diff(session.times[rows]) / memory)
        values = rng.normal(size=(rows.stop - rows.start, 3))
        for k, share in enumerate(keep, 1):
            values[k] = share * values[k - 1] + np.sqrt(1 - share**2) * values[k]
        out[rows] = 5e-3 * values
    return out


def test_noise_of_raw_tracks_lasts_for_less_than_a_second_and_that_of_films_for_two():
    session = plain_session(throws=8, rows=300, spacing=0.1)
    for true in (0.3, 20.0):
        raw = estimate_noise(session, with_memory(session, true))
        assert raw.memory[0] == pytest.approx(min(true, 0.7), rel=0.3)
        assert not raw.lasts
        lasting = estimate_noise(session, with_memory(session, true), lasting=True)
        assert lasting.memory[0] == pytest.approx(min(true, 2.0), rel=0.35)
        assert lasting.lasts == (true > 1.0)
    few = plain_session(throws=2, rows=5, claimed=0.03, claimed_turn=0.1)
    noise = estimate_noise(few, np.zeros((10, 3)))
    assert noise.memory == (2.0, 2.0, 2.0)
    assert noise.fading == (0.03, 0.03, 0.1)


def test_a_part_of_the_error_of_a_films_heading_lasts():
    session = plain_session(throws=4, rows=100, spacing=1 / 3, claimed=0.03, claimed_turn=0.2)
    residuals = np.random.default_rng(1).normal(0.0, 1e-3, (400, 3))
    noise = estimate_noise(session, residuals)
    assert noise.fading[2] == pytest.approx(0.02)
    assert noise.memory[2] == 2.0
    assert noise.fading[0] < 0.002


def test_a_wave_of_six_seconds_is_motion_in_a_film_and_one_of_five_may_be_noise():
    session = plain_session(throws=1, rows=len(T), spacing=0.1)
    zeros = np.zeros((len(T), 3))
    (series,) = _series_of(session, zeros, np.array([0]), (0,), slow=True)
    basis = series.columns[:, :-1]
    assert left_of(wave_of(6.2), basis) < 0.2
    assert left_of(wave_of(5.0), basis) > 0.7


def test_films_keep_three_rows_per_second():
    t = np.arange(0.0, 15.0, 0.05)
    y = -10.0 + 2.0 * t - 0.045 * t**2
    track = Trajectory(t=t, xy=np.column_stack([0 * t, y]), sigma_xy=np.full(len(t), 0.004))
    session = open_session([track])
    assert session.smoothed
    assert np.diff(session.times) == pytest.approx(np.full(len(session.times) - 1, 0.35))


@pytest.mark.parametrize(("claimed", "smoothed"), [(0.004, False), (0.04, True)])
def test_a_track_is_smoothed_if_its_jitter_is_far_below_its_stated_error(claimed, smoothed):
    t = np.arange(0.0, 15.0, 0.05)
    y = -10.0 + 2.0 * t - 0.045 * t**2
    xy = np.column_stack([0 * t, y]) + np.random.default_rng(1).normal(0, 0.004, (len(t), 2))
    track = Trajectory(t=t, xy=xy, sigma_xy=np.full(len(t), claimed))
    assert open_session([track]).smoothed == smoothed


@pytest.mark.parametrize(("headings", "turns"), [(10, False), (11, True)])
def test_a_spin_is_measured_by_more_than_ten_headings(headings, turns):
    theta = np.full(30, np.nan)
    theta[:headings] = 0.7 * 0.1 * np.arange(headings)
    session = plain_session(throws=1, rows=30, spacing=0.1, theta=theta)
    assert session.turns.tolist() == [turns]
    assert session.first_states[0, 5] == pytest.approx(0.7 if turns else 1.5)


# --- what counts as shown ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("chi2", "dof", "white"),
    [
        (290.0, 200.0, True),  # 4.5 standard deviations of χ²
        (310.0, 200.0, False),
        (6000.0, 5000.0, True),  # a fifth too much may be the spectrum of the noise
        (6600.0, 5000.0, False),
    ],
)
def test_residuals_are_white_up_to_five_deviations_and_up_to_a_quarter(chi2, dof, white):
    assert Misfit(chi2=np.array([chi2]), dof=np.array([dof])).white == white


def test_one_throw_of_a_film_may_fit_half_as_well_as_the_others():
    raw, film = plain_session(), plain_session(claimed=0.01)
    for chi2, surprising in ((380.0, False), (700.0, True)):
        misfit = Misfit(
            chi2=np.array([chi2]), dof=np.array([200.0]), throw_tolerance=throw_tolerance_of(film)
        )
        assert (misfit.surprise[0] > 5.0) == surprising
    assert throw_tolerance_of(raw) == 1.0


def test_lengths_are_off_beyond_three_standard_errors():
    for factor, off in ((1.025, False), (1.035, True), (0.975, False), (0.965, True)):
        assert Calibration(name="scale_error", factor=factor, stderr=0.01).clearly_off == off


@pytest.mark.parametrize(
    ("text", "name", "most"),
    [("22,21.945", "scale_error", 0.1), ("21,20", "frame_rate_error", 0.5)],
)
def test_a_reference_without_an_error_has_that_of_a_tape_or_a_stopwatch(text, name, most):
    assert 0.0 < read_reference(text, name).error < most


def test_a_parameter_is_measured_if_the_throws_shrink_its_prior_by_a_third():
    card = catalogue()["curl"]
    term = Term(
        card=card,
        values=neutral_values(card),
        free=("strength", "speed_exponent"),
        beliefs={"speed_exponent": Belief(mean=0.2, sd=0.1)},
    )
    for error, believed in ((0.06, ()), (0.08, ("speed_exponent",))):
        assert term.effect({"speed_exponent": error}).believed == believed


def test_improvements_count_up_to_nine():
    large = np.array([1e6, 9.5, 8.5, 3.0, 1.0, 2.0])
    capped = np.array([9.0, 9.0, 8.5, 3.0, 1.0, 2.0])
    expected = ttest_1samp(capped, 0.0, alternative="greater").pvalue
    assert p_of_mean(large) == pytest.approx(expected)


def test_frictions_follow_a_circumstance_if_chance_hardly_does():
    within = [Dependence(variable=v, share=0.3, p=1e-5, push="left") for v in ("spin", "t", "x")]

    def variables(known, name, p):
        return [each.variable for each in _with_structure(within[:known], (name, p))]

    assert variables(1, "order", 0.003) == ["spin", "order"]
    assert variables(1, "order", 0.005) == ["spin"]
    assert variables(1, "spin side", 0.003) == ["spin"]  # it is followed already
    assert variables(1, "direction", 0.003) == ["spin", "y"]
    assert variables(1, "stone 4", 0.003) == ["spin", "stone"]
    assert variables(3, "order", 0.003) == ["spin", "t", "x"]  # more would describe nothing
    (_, added) = _with_structure(within[:1], ("order", 0.003))
    assert (added.share, added.p, added.push) == (0.0, 0.003, "along")


# --- what is usual -------------------------------------------------------------------------------


def test_throws_without_rows_enough_begin_with_the_friction_of_a_draw():
    """A stone of 2 m/s that runs 28 m: v² / (2 g s)."""
    assert first_friction(plain_session(rows=4)) == pytest.approx(
        2.2**2 / (2 * 9.81 * 28.0), rel=0.15
    )
    assert first_friction(plain_session(rows=5)) == pytest.approx(0.09 / 9.80665)


def test_the_torque_of_the_band_is_known_to_the_inertia_and_the_radius():
    """Inertia to ten per cent, and the radius, which counts twice, to five."""
    usual = float(np.hypot(0.10, 2 * 0.05))
    model = Model(ice=SimpleNamespace(), ln_coupling=2.0 * usual)
    gram = prior_gram(model, 3)
    assert gram[2, 2] == pytest.approx(4.0, rel=0.15)
    assert gram[1, 2] == pytest.approx(-gram[1, 1] * 2.0 * usual)


def test_few_throws_have_a_spread_of_some_per_mille():
    def spreads(throws):
        fitted: Any = SimpleNamespace(only_spread=None, session=range(throws))
        return integrated_spreads(fitted)

    (only,) = spreads(3)
    assert 0.001 < only < 0.01
    assert Combination().spread == only
    many = spreads(4)
    assert many[0] < 0.001
    assert 0.2 < many[-1] < 0.4
    assert np.diff(np.log(many)) == pytest.approx(np.log(many[1] / many[0]) * np.ones(79))
    one: Any = SimpleNamespace(only_spread=0.02, session=range(30))
    assert integrated_spreads(one).tolist() == [0.02]


def test_an_unknown_makes_no_ice_more_than_seven_times_heavier():
    path = np.zeros((6, 6))
    path[:3, 3], path[3:, 3] = 2.0, -2.0
    instants = SimpleNamespace(times=np.tile([0.0, 0.1, 0.2], 2), starts=np.array([0, 3, 6]))

    class Instants(SimpleNamespace):
        def __iter__(self):
            return iter((self.times, self.starts))

    paths: Any = SimpleNamespace(path=path, instants=Instants(**vars(instants)))
    sizes = np.array([0.5, 9.0, -9.0] * 2)
    found = pushes_over_time(paths, {"along the sheet": sizes, "turn": 0.1 * sizes})
    assert found.sizes[[0, 3], 0].tolist() == [0.5, -0.5]  # less friction for throws that come back
    assert np.exp(found.sizes[:, 0].max()) == pytest.approx(7.0, rel=0.1)
    assert np.exp(-found.sizes[:, 0].min()) == pytest.approx(7.0, rel=0.1)
    assert found.sizes[:, 3] == pytest.approx(0.1 * sizes)
    assert found.spacing == pytest.approx([0.1, 0.1])
    assert found.starts.tolist() == [0, 3, 6]


# --- grids ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def lanes() -> list[np.ndarray]:
    y = np.linspace(-8.0, 8.0, 60)
    return [np.column_stack([np.full(60, x), y]) for x in (-0.5, 0.5)]


def test_neighbouring_lengths_of_a_map_differ_by_one_factor(lanes):
    """A map between two of them is then described by both."""
    fields = fields_to_try(PAPER_SHEET, lanes)
    assert {field.smoothness for field in fields} == {2.5, np.inf}
    for smoothness, factor in ((2.5, 1.6), (np.inf, 1.43)):
        lengths = np.array([f.length for f in fields if f.smoothness == smoothness])
        assert lengths[1:] / lengths[:-1] == pytest.approx(
            np.full(len(lengths) - 1, factor), rel=0.06
        )
        assert 0.9 < lengths[0] < 1.3
        assert 5.0 < lengths[-1] < 9.0


def test_patterns_of_a_map_are_fewer_than_its_places_and_lack_nothing(lanes):
    crossed = crossed_by(PAPER_SHEET, lanes)
    field = field_along(PAPER_SHEET, crossed, 3.2, 2.5)
    assert 10 < len(field) < 0.8 * len(crossed.places)
    on_lanes = field.patterns_at(crossed.places)
    assert (on_lanes**2).sum(axis=1) == pytest.approx(np.ones(len(on_lanes)), abs=0.02)


def test_amplitudes_of_a_map_reach_from_none_to_far_more_than_published_ones():
    assert 0.001 < MAP_AMPLITUDES[0] < 0.02 / 4
    assert 0.05 * 2 < MAP_AMPLITUDES[-1] < 0.3
    assert (np.diff(np.log(MAP_AMPLITUDES)) < np.log(1.5)).all()


def test_a_map_of_an_unusual_size_is_improbable_by_its_logarithm(lanes):
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, lanes), 8.0, np.inf)
    usual = field.with_amplitude(0.04)
    assert usual.hyperprior == pytest.approx(0.0, abs=1e-12)
    for deviations in (-2.0, 1.0):
        other = field.with_amplitude(0.04 * float(np.exp(deviations)))
        assert other.hyperprior == pytest.approx(deviations**2)


def test_sides_of_a_patch_are_shifted_both_ways_without_gaps():
    shifts = np.sort(SIDE_SHIFTS)
    assert shifts == pytest.approx(-shifts[::-1])
    right = shifts[shifts > 0.0]
    ratios = right[1:] / right[:-1]
    assert ((ratios > 1.3) & (ratios < 2.1)).all()
    assert right[0] < 0.1
    assert PAPER_SHEET.width / 2 < right[-1] < 3.0


def test_nodes_of_a_cameras_errors_are_as_few_as_their_spacing_allows():
    y = np.linspace(-13.0, 14.0, 24)  # 27 m: six times 4.5 m
    session = plain_session(xy=np.column_stack([0 * y, y]), claimed=0.004)
    error = systematic_error_of(session)
    assert error is not None
    assert len(error) == 4 * 7 + 6
    assert error.nodes == pytest.approx(np.linspace(-13.0, 14.0, 7))
    assert systematic_error_of(plain_session()) is None
    short = systematic_error_of(replace(session, xy=0.1 * session.xy))
    assert short is not None
    assert len(short.nodes) == 3


def test_nodes_of_a_ripple_are_as_close_as_its_shortest_wave(lanes):
    ripple = ripple_over(lanes, 1.5)
    assert 0.7 < np.diff(ripple.nodes).max() < 0.8 + 1e-9
    assert ripple.nodes[[0, -1]] == pytest.approx([-8.0, 8.0])
    short = [np.array([[0.0, 1.0], [0.0, 2.0]])]
    assert len(ripple_over(short, 0.8)) == 6


def test_noise_of_gates_is_that_of_their_times():
    gates: Any = SimpleNamespace(noise=0.03)
    noise = estimate_noise(plain_session(gates=gates), np.zeros((24, 3)))
    assert noise.white[:2] == (0.03, 0.03)
    assert 0.0 < noise.white[2] < 1e-3
    assert noise.fading == (0.0, 0.0, 0.0)
    assert not noise.remembers


def test_noise_of_a_coordinate_is_the_mean_square_of_both():
    noise = SessionNoise(white=(3e-3, 1e-3, 1.0), fading=(0.0, 4e-3, 2.0), memory=(0.3, 0.9, 5.0))
    assert noise.total == pytest.approx([3e-3, np.hypot(1e-3, 4e-3), np.hypot(1.0, 2.0)])
    assert noise.position == pytest.approx(np.sqrt((9e-6 + 17e-6) / 2))
    assert noise.coordinate.white == pytest.approx(np.sqrt(5e-6))
    assert noise.coordinate.slow == pytest.approx(np.sqrt(8e-6))
    assert noise.coordinate.time == 0.9
    assert noise.coordinate.total == pytest.approx(np.sqrt(13e-6))
    assert noise.lasts
    assert noise.table() == pytest.approx(
        np.array([[3e-3, 0.0, 0.3], [1e-3, 4e-3, 0.9], [1.0, 2.0, 5.0]])
    )
    white = replace(noise, fading=(0.0, 0.0, 2.0))
    assert white.coordinate.time == 0.0
    assert not white.remembers
    assert not white.lasts
