"""Sessions from tracks: rows kept, and their standard errors."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from friction_estimation.discovery import open_session
from friction_estimation.discovery.data.session import (
    UnknownPushes,
    _elsewhere,
    _from_hog_line,
    _jitter_over_claims,
    _laid_out,
    _relative,
    _thinned,
    _with_heading,
    no_pushes,
)

from ..conftest import plain_session


def track(*, fps: float = 20.0, sigma: object = None, throw: int = 0) -> Trajectory:
    t = np.arange(0.0, 15.0, 1.0 / fps)
    y = -10 + 2 * t - 0.045 * t**2
    claims = np.empty(0) if sigma is None else np.resize(np.asarray(sigma, dtype=float), len(t))
    noise = np.random.default_rng(throw).normal(0.0, 0.004, (len(t), 2))
    xy = np.column_stack([np.zeros(len(t)), y]) + noise
    return Trajectory(t=t, xy=xy, throw=throw, sigma_xy=claims)


@pytest.mark.parametrize(("fps", "kept"), [(20, 20), (40, 40), (120, 40), (240, 40)])
def test_of_a_fast_film_no_more_rows_are_kept_than_are_needed(fps: float, kept: float) -> None:
    session = open_session([track(fps=fps)])
    assert 1.0 / np.diff(session.times).mean() == pytest.approx(kept, rel=0.01)


def test_claims_count_by_their_ratio_and_a_missing_one_as_usual() -> None:
    tracks = [track(sigma=[0.002, 0.004, np.nan]), track(sigma=[0.002, 0.004, np.nan], throw=1)]
    claimed = open_session(tracks).sigma[:, 0]
    assert sorted(set(np.round(claimed, 6))) == pytest.approx([2 / 3, 1.0, 4 / 3])
    assert (open_session([track()]).sigma[:, 0] == 1.0).all()


def test_sweeping_begins_and_ends_midway_between_rows() -> None:
    whole = track()
    swept = ((whole.t > 3.01) & (whole.t < 5.01)) | (whole.t > 9.01)
    before, after = (
        replace(whole, swept=swept.astype(float)),
        replace(track(throw=1), swept=1.0 - swept),
    )
    session = open_session([before, after, track(throw=2)])
    switches, firsts, initially = session.sweeps
    assert np.diff(firsts).tolist() == [3, 3, 0]
    assert initially.tolist() == [0.0, 1.0, 0.0]
    begins = session.clocks.repeat(np.diff(firsts))
    assert begins + switches == pytest.approx([3.025, 5.025, 9.025] * 2)


@pytest.mark.parametrize("angle", [0.0, 0.02, np.pi, np.pi + 0.02])
def test_a_stone_turns_to_the_side_to_which_its_path_bends(angle: float) -> None:
    """Both ways along the sheet, and at any angle to it."""
    tracks: list[Trajectory] = []
    for throw, bend in enumerate((0.005, -0.005)):
        straight = track(throw=throw)
        curled = straight.xy + np.outer(bend * straight.t**2, [-1.0, 0.0])  # to the left
        turned = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        tracks.append(replace(straight, xy=curled @ np.array(turned)))
    spins = open_session(tracks).with_spins_from_curvature().usual_spins
    assert np.sign(spins).tolist() == [1.0, -1.0]  # to the left as seen from above: positive
    assert spins[0] == -spins[1]


# --- sessions laid out by hand -------------------------------------------------------------------


def test_the_first_states_are_those_of_a_stone_that_slows_down_evenly() -> None:
    session = plain_session(throws=2, rows=60, spacing=0.1)
    expected = [[0.0, -10.0, 0.0, 2.0, 0.0, 1.2], [0.0, 10.0, 0.0, -2.0, 0.0, 1.2]]
    assert session.first_states == pytest.approx(np.array(expected), abs=1e-6)
    few = plain_session(throws=2)
    assert few.first_states == pytest.approx(np.array(expected), abs=1e-6)
    theta = few.theta.copy()
    theta[few.rows(0)] = np.nan
    blind = replace(few, theta=theta)
    assert blind.turns.tolist() == [False, True]
    assert blind.first_states[:, 4:] == pytest.approx(np.array([[0.0, 1.5], [0.0, 1.2]]))
    assert not few.smoothed
    # Only what was seen at first counts: two seconds, or twenty rows of a slow film.
    late = session.xy + np.where(session.times > 2.05, 5.0, 0.0)[:, None]
    assert replace(session, xy=late).first_states == pytest.approx(session.first_states)
    slow = plain_session(throws=1, rows=30, spacing=0.4)
    late = slow.xy + np.where(slow.times > 8.05, 5.0, 0.0)[:, None]
    assert replace(slow, xy=late).first_states == pytest.approx(slow.first_states)
    late = slow.xy + np.where(slow.times > 7.95, 5.0, 0.0)[:, None]
    assert np.abs(replace(slow, xy=late).first_states - slow.first_states).max() > 0.01


def test_throws_are_forecast_from_their_first_seconds_or_from_all_gates_but_the_last() -> None:
    session = plain_session(throws=2, rows=10, spacing=0.8)
    assert session.early.tolist() == ([True] * 6 + [False] * 4) * 2
    gates: Any = SimpleNamespace()
    timed = replace(plain_session(throws=3), starts=np.array([0, 3, 7, 12]), gates=gates)
    timed = replace(timed, times=timed.times[:12])
    # Of four times all but one, and of five all but two: the last gate has two edges.
    expected = [True, True, False, *[True] * 3, False, *[True] * 3, False, False]
    assert timed.early.tolist() == expected


def test_gates_see_no_place_across_the_sheet() -> None:
    gates: Any = SimpleNamespace()
    seen, timed = plain_session(), plain_session(gates=gates)
    assert np.isnan(timed.observed[:, 0]).all()
    assert timed.observed[:, 1:] == pytest.approx(seen.observed[:, 1:])
    assert seen.observed == pytest.approx(np.column_stack([seen.xy, seen.theta]))


def test_some_throws_and_some_rows_of_a_session() -> None:
    whole = plain_session(throws=3, rows=4, stones=np.array([4, 5, 6]))
    some = whole.only([2, 0])
    assert some.throws.tolist() == [2, 0]
    assert some.stones.tolist() == [6, 4]
    assert some.clocks.tolist() == [120.0, 0.0]
    assert some.starts.tolist() == [0, 4, 8]
    assert some.xy.tolist() == [*whole.xy[8:].tolist(), *whole.xy[:4].tolist()]
    assert some.slides == [(2, 6, 120.0), (0, 4, 0.0)]
    dropped = np.zeros(12, dtype=bool)
    dropped[[1, 5, 6]] = True
    fewer = whole.without_rows(dropped)
    assert fewer.starts.tolist() == [0, 3, 5, 9]
    assert fewer.times.tolist() == whole.times[~dropped].tolist()
    assert fewer.owner.tolist() == [0, 0, 0, 1, 1, 2, 2, 2, 2]
    assert len(fewer) == 3


def test_pushes_are_linear_between_their_times_and_stay_with_their_throw() -> None:
    sizes = np.arange(20.0).reshape(5, 4)
    pushes = UnknownPushes(sizes, np.array([0, 2, 5]), np.array([0.5, 2.0]))
    assert pushes.at(0, np.array([0.0, 0.25, 9.0])) == pytest.approx(
        np.array([sizes[0], (sizes[0] + sizes[1]) / 2, sizes[1]])
    )
    assert pushes.at(1, np.array([1.0, 4.0])) == pytest.approx(
        np.array([(sizes[2] + sizes[3]) / 2, sizes[4]])
    )
    other = pushes.only(np.array([1]))
    assert other.sizes == pytest.approx(sizes[2:])
    assert other.starts.tolist() == [0, 3]
    assert other.spacing.tolist() == [2.0]
    assert pushes.only(np.array([1, 0])).starts.tolist() == [0, 3, 5]
    none = no_pushes(3)
    assert none.sizes.shape == (0, 4)
    assert none.starts.tolist() == [0, 0, 0, 0]
    assert none.spacing.tolist() == [1.0, 1.0, 1.0]
    pushed = plain_session(throws=2, rows=2, pushes=pushes).only([1])
    assert pushed.pushes is not None
    assert pushed.pushes.spacing.tolist() == [2.0]


def test_stated_errors_are_relative_to_their_mean() -> None:
    claims = [np.array([0.002, np.nan]), np.array([0.006, 0.0, -1.0])]
    assert _relative(claims) == pytest.approx([0.5, 1.0, 1.5, 1.0, 1.0])
    assert _relative([np.array([np.nan, 0.0])]) == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize(
    ("x", "y", "off"),
    [(2.5, 0.0, False), (-2.7, 0.0, True), (0.0, -23.0, False), (0.0, 25.0, True)],
)
def test_a_track_lies_off_the_sheet_by_its_middle(x: float, y: float, off: bool) -> None:
    xy = np.full((5, 2), [x, y])
    xy[0] = 90.0, -90.0
    reason = _elsewhere(Trajectory(t=np.arange(5.0), xy=xy, throw=7))
    assert bool(reason) == off
    if off:
        assert f"throw 7 lies off the sheet, around x = {x:.1f}, y = {y:.1f} m" in reason
    assert not _elsewhere(Trajectory(t=np.empty(0), xy=np.empty((0, 2))))


def test_throws_without_a_heading_leave_if_eight_others_have_one() -> None:
    def pair(throw: int, known: int) -> Any:
        theta = np.where(np.arange(20) < known, 0.1, np.nan)
        whole = Trajectory(t=np.arange(20.0), xy=np.zeros((20, 2)), theta=theta, throw=throw)
        return SimpleNamespace(track=whole), np.arange(20)

    seen = [pair(k, 11) for k in range(8)]
    kept, reasons = _with_heading([*seen, pair(8, 10)])
    assert [slide.track.throw for slide, _ in kept] == list(range(8))
    assert reasons == ["throw 8: neither heading nor rotation was measured"]
    kept, reasons = _with_heading([*seen[:7], pair(8, 10)])
    assert len(kept) == 8
    assert reasons == []


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_rows_back_to_the_delivery_hog_line_belong_to_a_slide(direction: float) -> None:
    y = direction * (-HOG_LINE_Y - 0.34 + 0.1 * np.arange(30))
    whole = Trajectory(t=0.1 * np.arange(30), xy=np.column_stack([0 * y, y]))
    slide: Any = SimpleNamespace(track=whole, rows=np.arange(10, 30), stretch=(0, 30))
    # The third row lies 14 cm before the line, the fourth 4 cm: as near as noise.
    assert _from_hog_line(slide).tolist() == list(range(3, 30))
    later = SimpleNamespace(track=whole, rows=np.arange(10, 30), stretch=(6, 30))
    assert _from_hog_line(later).tolist() == list(range(6, 30))


def test_jitter_is_measured_over_what_a_track_states(rng: np.random.Generator) -> None:
    def slide(noise: float, claims: object) -> Any:
        whole = track(fps=20.0, sigma=claims)
        xy = np.column_stack([0 * whole.t, whole.t]) + rng.normal(0, noise, (len(whole), 2))
        return SimpleNamespace(track=replace(whole, xy=xy), rows=np.arange(len(whole)))

    assert _jitter_over_claims([slide(0.002, 0.01)]) == pytest.approx(0.2, rel=0.15)
    assert _jitter_over_claims([slide(0.002, 0.01), slide(0.5, None)]) == pytest.approx(
        0.2, rel=0.15
    )
    assert _jitter_over_claims([slide(0.5, None)]) == 0.0


def test_a_throw_begins_with_its_first_row() -> None:
    """Its clock is that of the row, and its times count from there."""
    pairs: list[Any] = []
    for throw, clock in ((7, 100.0), (9, 200.0)):
        whole = replace(track(throw=throw), clock=clock, stone=throw + 1)
        pairs.append((SimpleNamespace(track=whole), np.array([40, 44, 50])))
    session = _laid_out(pairs, {7: 3, 9: 5})
    assert session.throws.tolist() == [7, 9]
    assert session.orders.tolist() == [3, 5]
    assert session.stones.tolist() == [8, 10]
    assert session.clocks == pytest.approx([102.0, 202.0])
    assert session.times == pytest.approx([0.0, 0.2, 0.5] * 2)
    assert session.starts.tolist() == [0, 3, 6]
    assert session.xy[3:] == pytest.approx(pairs[1][0].track.xy[[40, 44, 50]])
    assert session.usual_spins.tolist() == [1.5, 1.5]


@pytest.mark.parametrize(
    ("fps", "spacing", "every"),
    [(30, 0.0, 1), (50, 0.0, 1), (100, 0.0, 2), (240, 0.0, 6), (30, 1 / 3, 10), (4, 1 / 3, 1),
     (2, 1 / 3, 1), (240, 1 / 3, 80)],
)  # fmt: skip
def test_rows_are_thinned_to_their_spacing_whenever_the_film_began(fps, spacing, every) -> None:
    t = 50.0 + np.arange(0.0, 12.0, 1.0 / fps)
    y = -5.0 + 1.2 * (t - 50.0)
    whole = Trajectory(t=t, xy=np.column_stack([0 * y, y]))
    slide: Any = SimpleNamespace(track=whole, rows=np.arange(len(t)), stretch=(0, len(t)))
    assert _thinned(slide, spacing).tolist() == list(range(0, len(t), every))
