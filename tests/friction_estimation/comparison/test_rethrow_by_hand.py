"""Parts of the comparison on hand-made throws, against closed forms of even friction."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.slides import SlideEnd
from curling_env.throw import MAX_SPEED, MAX_SPIN, Release
from curling_env.trajectory import Trajectory
from curling_env.units import Units
from friction_estimation.comparison import Comparison, Rethrow, compare_tracks, position_noise
from friction_estimation.comparison import rethrow as module
from friction_estimation.comparison.rethrow import rethrow, write_comparison
from friction_estimation.discovery.model.noise import CoordinateNoise
from friction_estimation.tracks.free_slide import FreeSlide, free_slides

MU = 0.009
DRAG = MU * 9.80665
ICE = Ice.uniform(MU)
NO_SWEEPS = np.empty((0, 2))


def made_up(t: np.ndarray, *, window: float = 2.5, residual=0.0, **other) -> Rethrow:
    """A straight throw at 2 m/s, measured with given residuals."""
    release = Release(x=0.0, y=-11.0, vx=0.0, vy=2.0)
    path = np.column_stack([0 * t, -11.0 + 2.0 * t - 0.5 * DRAG * t**2])
    given = {"predicted_time": float(t[-1]), "rest": None, "rest_time": None} | other
    return Rethrow(
        **{
            "throw": 1,
            "stone": 0,
            "release": release,
            "t": t,
            "measured": path + residual,
            "predicted": path,
            "tested": t > window,
            "predicted_rest": path[-1],
        }
        | given
    )


def rested(rest=(0.0, 17.0), predicted=(0.0, 17.0), path_error: float = 0.0) -> Rethrow:
    return made_up(
        np.arange(10.0),
        residual=np.array([path_error, 0.0]),
        rest=None if rest is None else np.array(rest),
        predicted_rest=np.array(predicted),
    )


# --- sentences and tables -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("throws", "words"),
    [
        (
            [rested(predicted=(0.0, 17.4))],
            "one throw: stones came to rest 0.40 m from where this ice says, 0.40 m short of it "
            "on average",
        ),
        (
            [rested(predicted=(0.0, 16.7)), rested(predicted=(0.0, 16.5))],
            "2 throws: stones came to rest 0.41 m from where this ice says, 0.40 m past it "
            "on average",
        ),
        # A mean below half the error says nothing: 0.20 of 0.41 m, but 0.21 of 0.41 m does.
        (
            [rested(predicted=(0.36, 17.2))],
            "one throw: stones came to rest 0.41 m from where this ice says",
        ),
        (
            [rested(predicted=(0.36, 17.21))],
            "one throw: stones came to rest 0.42 m from where this ice says, 0.21 m short of it "
            "on average",
        ),
        (
            [rested(predicted=(5.1, 17.0))],
            "one throw: stones came to rest 5.10 m from where this ice says: this is not the ice "
            "that these stones ran on",
        ),
        (
            [rested(predicted=(4.9, 17.0))],
            "one throw: stones came to rest 4.90 m from where this ice says",
        ),
        (
            [rested(None, path_error=0.03)] * 2,
            "2 throws: the predicted paths are 0.03 m off (root mean square)",
        ),
    ],
)
def test_a_sentence_reports_errors_of_rest_and_their_mean(throws, words):
    assert Comparison(rethrows=tuple(throws), skipped=(), window=2.5).in_words() == words


def test_throws_seen_within_the_release_alone_compare_nothing():
    short = made_up(np.arange(10.0) / 5)
    comparison = Comparison(rethrows=(short,), skipped=(), window=2.5)
    assert comparison.in_words() == "one throw: too little is seen beyond the release to compare"
    far = Comparison(rethrows=(rested(predicted=(0.0, 17.0 + 4 * 0.3048)),), skipped=(), window=2)
    assert "4 ft 0 in short of it" in far.in_words(Units.FEET)


def test_both_paths_are_written_with_further_columns(tmp_path: Path):
    throws = (rested(path_error=0.0312345), replace(rested(), throw=7))
    comparison = Comparison(rethrows=throws, skipped=(), window=2.5)
    write_comparison(comparison, tmp_path, {7: {"athlete": "Ann"}})
    with (tmp_path / "throws.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["throw"], row["athlete"]) for row in rows] == [("1", ""), ("7", "Ann")]
    with (tmp_path / "paths.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["throw"] for row in rows] == ["1"] * 10 + ["7"] * 10
    third = {name: float(value) for name, value in rows[2].items()}
    y = -11.0 + 4.0 - 2 * DRAG
    assert third == pytest.approx(
        {"throw": 1, "t": 2, "x": 0.03123, "y": y, "predicted_x": 0, "predicted_y": y}, abs=5e-6
    )


# --- releases -------------------------------------------------------------------------------------


def slid(
    *, seconds: float = 15.0, clock: float = 100.0, rests: bool = False, fps: float = 20.0
) -> FreeSlide:
    """An exact slide from 3 s into its track, after which the stone may rest."""
    t = np.arange(0.0, seconds, 1.0 / fps)
    at = np.minimum(t, 1.8 / DRAG)
    run = 1.8 * at - 0.5 * DRAG * at**2
    xy = np.column_stack([0.1 + 0.01 * run, 8.0 - run])
    track = Trajectory(t=3.0 + t, xy=xy, clock=clock, stone=5, throw=9)
    rows = np.arange(len(t))
    return FreeSlide(track=track, rows=rows, stretch=(0, len(t)), rests=rests, wild=0, noise=0.001)


def test_a_release_is_that_of_the_first_seconds():
    found = rethrow(slid(), ICE, 4)
    assert (found.throw, found.stone) == (9, 5)
    assert (found.release.stone, found.release.order) == (5, 4)
    assert found.release.clock == pytest.approx(103.0)
    assert (found.release.x, found.release.y) == pytest.approx((0.1, 8.0), abs=1e-3)
    assert (found.release.vx, found.release.vy) == pytest.approx((0.018, -1.8), abs=2e-3)
    assert found.t[0] == 0.0
    assert (found.tested == (found.t > 2.5)).all()
    assert found.rest is found.rest_time is None
    assert found.predicted_rest[1] == pytest.approx(8.0 - 1.8**2 / 2 / DRAG, abs=0.05)
    # The last 5 cm take √(2·0.05/μg).
    assert found.predicted_time == pytest.approx(1.8 / DRAG - np.sqrt(0.1 / DRAG), abs=0.05)
    assert np.abs(found.predicted - found.measured).max() < 0.05


def test_a_release_has_twelve_rows_at_least():
    found = rethrow(slid(fps=2.0), ICE, 0)
    assert (~found.tested).sum() == 12
    assert (~rethrow(slid(), ICE, 0, window=4.0).tested).sum() == 81


def test_outliers_hardly_move_a_release():
    part = slid()
    xy = part.track.xy + np.random.default_rng(1).normal(0, 0.001, part.track.xy.shape)
    xy[[5, 20, 45]] += 0.5
    found = rethrow(replace(part, track=replace(part.track, xy=xy)), ICE, 0).release
    assert found.speed == pytest.approx(1.8, abs=0.01)
    assert found.x == pytest.approx(0.1, abs=0.005)


def test_the_measured_rest_is_the_median_of_the_last_tenth_of_a_second():
    part = slid(seconds=26.0, rests=True)
    rest = 8.0 - 1.8**2 / 2 / DRAG
    xy = part.track.xy.copy()
    xy[-2:] += [[0.03, -0.001], [0.04, 0.002]]  # two rows lie within the tenth of a second
    found = rethrow(replace(part, track=replace(part.track, xy=xy)), ICE, 0)
    across = 0.1 + 0.01 * 1.8**2 / 2 / DRAG
    assert found.rest == pytest.approx([across + 0.035, rest + 0.0005], abs=1e-6)
    # Rows after the stretch are not of this slide.
    longer = replace(part, stretch=(0, len(part.rows) - 2))
    kept = replace(longer, track=replace(part.track, xy=xy), rows=part.rows[:-2])
    assert rethrow(kept, ICE, 0).rest == pytest.approx([across, rest], abs=1e-6)
    assert rethrow(kept, ICE, 0).rest_time == pytest.approx(
        1.8 / DRAG - np.sqrt(0.1 / DRAG), abs=0.08
    )


def test_arrival_is_the_first_time_within_five_centimetres():
    xy = np.array([[0.0, 0.0], [0.0, 0.94], [0.028, 0.96], [0.0, 0.951], [0.0, 0.9], [0.0, 1.0]])
    t = np.array([0.0, 1.0, 2.0, 4.0, 8.0, 16.0])
    assert module._arrival(t, xy, np.array([0.0, 1.0])) == 2.0
    assert module._arrival(t, xy, np.array([0.04, 1.0])) == 2.0
    assert module._arrival(t, xy, np.array([0.0, 3.0])) == 16.0


def test_swept_intervals_begin_with_the_first_flag_and_end_with_the_first_without():
    t = np.array([0.0, 0.5, 1.0, 1.5, 2.5, 3.0])
    swept = np.array([0.0, 1.0, 0.6, 0.5, 0.0, 1.0])
    assert module._swept_intervals(t, swept).tolist() == [[0.5, 1.5], [3.0, 4.0]]
    assert module._swept_intervals(t, np.eye(6)[0]).tolist() == [[0.0, 0.5]]
    assert module._swept_intervals(t, 0 * t).shape == (0, 2)


def test_a_release_is_within_its_bounds_and_sweeping_lasts_from_first_to_last():
    part = slid()
    state = np.array([[0.1, -11.0], [3.0, 4.0]])
    sweeps = np.array([[1.0, 2.0], [5.0, 7.5]])
    usual = module._release(state, 0.7, -1.5, part, 3, sweeps)
    assert (usual.x, usual.y, usual.vx, usual.vy) == (0.1, -11.0, 3.0, 4.0)
    assert (usual.theta, usual.omega) == (0.7, -1.5)
    assert (usual.sweep_start, usual.sweep_end) == (1.0, 7.5)
    wild = module._release(state * 2, 0.0, 99.0, part, 3, NO_SWEEPS)
    assert wild.speed == pytest.approx(0.999 * MAX_SPEED)
    assert wild.vx / wild.vy == pytest.approx(0.75)
    assert wild.omega == MAX_SPIN
    assert module._release(state, 0.0, -99.0, part, 3, NO_SWEEPS).omega == -MAX_SPIN
    assert (wild.sweep_start, wild.sweep_end) == (0.0, 0.0)


# --- noise of the positions -----------------------------------------------------------------------


@pytest.fixture
def series(monkeypatch):
    """Series that the search for the noise is given, instead of the search."""
    given = SimpleNamespace(series=[], size=0.0, answer=(0.003, 0.002, 0.5))

    def search(series, size, *, memory):
        given.series, given.size = series, size
        return given.answer

    monkeypatch.setattr(module, "most_likely_noise", search)
    return given


@pytest.mark.parametrize(
    ("seconds", "curves"), [(9.9, 3), (10.1, 4), (19.9, 4), (20.1, 5), (29.9, 5), (30.1, 6)]
)
def test_a_curve_may_bend_once_more_for_every_eight_seconds(series, seconds, curves):
    """The last fifth of a throw does not count, so that ten seconds leave eight."""
    t = np.linspace(0.0, seconds, 2001)
    noise = position_noise([made_up(t)])
    assert noise == CoordinateNoise(white=0.003, slow=0.002, time=0.5)
    assert [one.columns.shape for one in series.series] == [(1601, curves + 1)] * 2
    assert (series.series[0].sigma == 1.0).all()
    assert series.series[0].t[-1] == pytest.approx(0.8 * seconds)
    # The curves are all polynomials of their degree over the time.
    powers = np.polynomial.polynomial.polyvander(t[:1601], curves - 1)
    left = np.linalg.lstsq(series.series[0].columns[:, :-1], powers)[1]
    assert np.abs(left).max() < 1e-6
    assert np.abs(series.series[0].columns[:, :-1]).max() == pytest.approx(1.0)


def test_the_rows_end_before_the_earlier_stop(series):
    t = np.linspace(0.0, 10.0, 101)
    position_noise([made_up(t, predicted_time=5.0)])
    assert series.series[0].t[-1] == pytest.approx(4.0)
    position_noise([made_up(t, predicted_time=50.0)])
    assert series.series[0].t[-1] == pytest.approx(8.0)


def test_residuals_and_their_rough_size_are_given_to_the_search(series, rng):
    t = np.linspace(0.0, 10.0, 2001)
    bend = np.column_stack([0.01 * t**2, -0.3 + 0.1 * t])
    jitter = rng.normal(0, 0.004, (len(t), 2))
    position_noise([made_up(t, residual=bend + jitter)])
    for axis, one in enumerate(series.series):
        assert one.columns[:, -1] == pytest.approx((bend + jitter)[: len(one.t), axis])
    assert series.size == pytest.approx(0.004, rel=0.06)
    position_noise([made_up(t)])
    assert series.size == 1e-5


def test_a_noise_without_memory_has_no_time(series):
    series.answer = (0.003, 0.0, 0.5)
    noise = position_noise([made_up(np.linspace(0.0, 10.0, 101))])
    assert noise == CoordinateNoise(white=0.003, slow=0.0, time=0.0)


def test_few_rows_have_no_noise(series):
    """A parabola needs twelve rows before four fifths of the time; the first row is at zero."""
    assert position_noise([made_up(np.linspace(0.0, 5.0, 14))]) is None
    assert position_noise([made_up(np.linspace(0.0, 5.0, 15))]) is not None
    assert position_noise([]) is None
    few, enough = (made_up(np.linspace(0.0, 5.0, n)) for n in (14, 15))
    assert position_noise([few, enough]) is not None
    assert len(series.series) == 2
    position_noise([few] * 5 + [enough] * 20)
    assert len(series.series) == 2 * 7  # of the first twelve throws


# --- spread of a predicted rest -------------------------------------------------------------------


def test_a_line_through_two_rows_errs_as_their_noise():
    t, noise = np.array([0.0, 3.0]), CoordinateNoise(white=0.3, slow=0.4, time=2.0)
    alike = 0.4**2 * np.exp(-1.5)
    expected = [
        [0.25, (alike - 0.25) / 3],
        [(alike - 0.25) / 3, 2 * (0.25 - alike) / 9],
    ]
    assert module._line_covariance(t, noise) == pytest.approx(np.array(expected))
    white = module._line_covariance(np.arange(9.0), CoordinateNoise(white=0.3))
    basis = np.column_stack([np.ones(9), np.arange(9.0)])
    assert white == pytest.approx(0.09 * np.linalg.inv(basis.T @ basis))


def test_paired_numbers_have_no_mean():
    found = module._pairs(np.random.default_rng(1), 2)
    assert found.shape == (2, 128)
    assert np.abs(found.sum(axis=1)).max() < 1e-12
    assert found[:, 64:] == pytest.approx(-found[:, :64])
    assert (found**2).mean() == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize(("white", "slow"), [(0.02, 0.0), (0.0, 0.02), (0.016, 0.012)])
def test_a_measured_rest_errs_by_the_median_of_three_rows(white, slow):
    """Of a release known from many rows hardly anything is left but the noise of the rest."""
    throw = made_up(np.linspace(0.0, 300.0, 601), window=np.inf)
    noise = CoordinateNoise(white=white, slow=slow, time=0.05)
    spread = module.rest_spread(throw, ICE, noise, heading_seen=True)
    assert spread == pytest.approx([np.sqrt(white**2 / 2 + slow**2)] * 2, rel=0.02)


def test_noise_of_the_release_spreads_a_rest_as_propagation_of_errors_has_it():
    throw = made_up(np.linspace(0.0, 2.5, 51))
    noise = CoordinateNoise(white=0.003)
    across, along = module.rest_spread(throw, ICE, noise, heading_seen=True)
    covariance = module._line_covariance(throw.t, noise)
    lasts = np.array([1.0, 2.0 / DRAG])
    assert along == pytest.approx(np.sqrt(lasts @ covariance @ lasts + 0.003**2 / 2), rel=0.25)
    # To the side it drifts with its speed, which fades as the other does: half as far.
    drift = np.array([1.0, 1.0 / DRAG])
    assert across == pytest.approx(np.sqrt(drift @ covariance @ drift + 0.003**2 / 2), rel=0.25)


@pytest.mark.parametrize("seconds", [4.0, 10.0])
def test_an_error_of_the_ice_is_compensated_by_the_release(monkeypatch, seconds):
    """With friction off by δ, the release of the first T seconds is off by ½δT and −δT²/12."""
    part = 0.01
    ices = [Ice.uniform(MU * (1 + sign * part)) for sign in (1, -1)] * 64
    monkeypatch.setattr(module, "plausible_ices", lambda *_: ices)
    throw = made_up(np.linspace(0.0, seconds, 101), window=np.inf)
    across, along = module.rest_spread(throw, ICE, None, heading_seen=True)
    run, v = 2.0**2 / (2 * DRAG), 2.0
    # Legendre: the line nearest to −½t² over (0, T) is T²/12 − ½Tt.
    start = quad(lambda t: -0.5 * t**2 * (4 - 6 * t / seconds) / seconds, 0, seconds)[0]
    assert start == pytest.approx(seconds**2 / 12)
    off = part * DRAG * (run / DRAG - v / DRAG * seconds / 2 + seconds**2 / 12)
    assert along == pytest.approx(abs(off), rel=0.02)
    assert across < 1e-6


def test_a_rest_spreads_over_the_stones_that_rested(monkeypatch):
    thrown = SimpleNamespace(count=12, other=99.0)

    def throws(ices, table, **_):
        ends = np.full(len(table), SlideEnd.REST)
        x, y = np.resize([0.1, -0.1], len(table)), np.resize([0.3, 0.3, -0.3, -0.3], len(table))
        gone = np.arange(len(table)) >= len(table) - thrown.count
        ends[gone] = next(end for end in SlideEnd if end != SlideEnd.REST)
        return SimpleNamespace(
            end=ends, x=np.where(gone, thrown.other, x), y=np.where(gone, thrown.other, y)
        )

    monkeypatch.setattr(module, "throw_batch", throws)
    throw = made_up(np.linspace(0.0, 2.5, 51))
    assert module.rest_spread(throw, ICE, None, heading_seen=True) == pytest.approx((0.1, 0.3))
    thrown.count = 13  # more than a tenth of 128
    assert module.rest_spread(throw, ICE, None, heading_seen=True) is None


def test_thrown_again_are_only_releases_within_their_bounds(monkeypatch):
    """Without a heading, the spin may be any usual one."""
    tables = []

    def throws(ices, table, **_):
        tables.append(table.copy())
        rest = np.full(len(table), SlideEnd.REST)
        return SimpleNamespace(end=rest, x=np.zeros(len(table)), y=np.zeros(len(table)))

    monkeypatch.setattr(module, "throw_batch", throws)
    fast = replace(made_up(np.linspace(0.0, 2.5, 51)), release=Release(
        x=0.0, y=-11.0, vx=0.0, vy=0.9985 * MAX_SPEED, omega=MAX_SPIN - 1.0, order=5,
    ))  # fmt: skip
    module.rest_spread(fast, ICE, CoordinateNoise(white=0.05), heading_seen=False)
    speeds, spins = np.hypot(tables[0]["vx"], tables[0]["vy"]), tables[0]["omega"]
    assert speeds.max() == pytest.approx(0.999 * MAX_SPEED)
    assert speeds.min() < 0.998 * MAX_SPEED
    assert np.median(spins) == pytest.approx(MAX_SPIN - 1.0, abs=0.1)
    assert spins.max() == MAX_SPIN
    assert (spins[spins < MAX_SPIN - 1.0] - MAX_SPIN + 1.0).std() > 0.3
    module.rest_spread(fast, ICE, None, heading_seen=True)
    assert (tables[1]["omega"] == MAX_SPIN - 1.0).all()
    assert (tables[1]["vy"] == 0.9985 * MAX_SPEED).all()


# --- sessions -------------------------------------------------------------------------------------


def test_a_window_leaves_something_to_predict():
    tracks = [slid(seconds=12.0).track]
    with pytest.raises(InputError, match=r"must be positive, got -1.0 s"):
        compare_tracks(tracks, ICE, window=-1.0)
    longest = max(part.duration for part in free_slides(tracks)[0])
    for window in (longest, longest + 1.0):
        with pytest.raises(InputError, match=f"window of {window:g} s .* freely for {longest:.1f}"):
            compare_tracks(tracks, ICE, window=window)
    (compared,) = compare_tracks(tracks, ICE, window=longest - 0.12).rethrows
    assert compared.tested.sum() == 3  # at 20 frames a second


def test_each_throw_is_made_on_the_ice_that_those_before_wore(monkeypatch):
    wear = ActiveEffect(name="pebble_wear", parameters={"rate": 0.0, "along_path": -0.05})
    ices, spreads = [], []
    whole = module.rethrow
    monkeypatch.setattr(
        module, "rethrow", lambda part, *rest: ices.append(rest) or whole(part, *rest)
    )
    monkeypatch.setattr(
        module, "rest_spread", lambda throw, ice, *_, **__: spreads.append(ice) or (0.1, 0.2)
    )
    tracks = [
        replace(slid(seconds=seconds).track, throw=k) for k, seconds in enumerate((12.0, 9.0))
    ]
    found = compare_tracks(tracks, Ice.uniform(MU, effects=(wear,)), window=3.0)
    assert [(order, window) for _, order, window in ices] == [(0, 3.0), (1, 3.0)]
    assert [ice for ice, *_ in ices] == spreads
    assert spreads[0] is not spreads[1]
    assert [throw.rest_sigma for throw in found.rethrows] == [(0.1, 0.2)] * 2
    assert found.window == 3.0
