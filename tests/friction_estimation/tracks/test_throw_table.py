"""A coach's table of throws, compared with the exact paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.sheet import Direction
from curling_env.trajectory import Trajectory
from friction_estimation.tracks import measure_throw
from friction_estimation.tracks.throw_table import throw_table

BACK, HOG, TEE = 19.2025, 10.9725, 17.3735
TIMES = ("back_to_hog", "tee_to_hog", "hog_to_hog", "hog_to_tee")


def slid_in(track, speed):
    """The track with the stone sliding in at its speed from two metres before the back line."""
    way = np.sign(track.xy[-1, 1] - track.xy[0, 1])
    step = track.t[1] - track.t[0]
    t = -np.arange(1, int((BACK + 2 - HOG) / speed / step))[::-1] * step
    before = track.xy[0] + np.outer(t, (track.xy[1] - track.xy[0]) / step)
    assert way * before[0, 1] < -BACK
    return replace(
        track,
        t=np.concatenate([t, track.t]) - t[0],
        xy=np.concatenate([before, track.xy]),
        theta=np.concatenate([np.full(len(t), track.theta[0]), track.theta]),
        swept=np.zeros(len(t) + len(track)),
    )


def when(track, line):
    """Return the time at which an exact path, seen along play, crosses a line; NaN if it does
    not.
    """
    ahead = np.sign(track.xy[-1, 1] - track.xy[0, 1]) * track.xy[:, 1]
    return np.interp(line, ahead, track.t) if ahead[0] <= line <= ahead[-1] else np.nan


@pytest.fixture(scope="module")
def draws(sliding):
    """Exact paths of 16 draws from both ends, with their lead-in, and their releases."""
    rng = np.random.default_rng(4)
    count = 16
    away = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    speed, x = rng.uniform(2.15, 2.3, count), rng.uniform(-0.3, 0.3, count)
    tilt = rng.uniform(-0.03, 0.03, count)
    spin = rng.choice([-1.0, 1.0], count) * rng.uniform(0.8, 2.0, count)
    starts = np.column_stack(
        [x, -away * HOG, speed * np.sin(tilt), away * speed * np.cos(tilt), spin]
    )
    field = sliding.random_field(rng, mu=0.0085, spread=0.03, length=3.0)
    exact = sliding.measured_throws(field, starts, rng, noise=0.0, curl=0.005, rest=1.5)
    whole = [slid_in(track, v) for track, v in zip(exact, speed, strict=True)]
    return whole, starts


def seen(tracks, rng, noise=0.005):
    return [
        replace(
            track,
            xy=track.xy + rng.normal(0, noise, track.xy.shape),
            theta=track.theta + rng.normal(0, 0.01, len(track)),
            sigma_xy=np.full(len(track), 0.002),
        )
        for track in tracks
    ]


def deviations(found, name, true):
    """Return errors of a number in its standard errors, if both are known."""
    pairs = [(getattr(one, name), value) for one, value in zip(found, true, strict=True)]
    assert [got is None for got, _ in pairs] == [bool(np.isnan(v)) for _, v in pairs], name
    return np.array([(got.value - v) / got.sigma for got, v in pairs if got is not None])


def test_times_between_lines_are_right_within_their_errors(draws, rng):
    exact, _ = draws
    found = throw_table(seen(exact, rng))
    lines = {
        "back_to_hog": (-BACK, -HOG),
        "tee_to_hog": (-TEE, -HOG),
        "hog_to_hog": (-HOG, HOG),
        "hog_to_tee": (-HOG, TEE),
    }
    for name, (start, stop) in lines.items():
        true = [when(track, stop) - when(track, start) for track in exact]
        off = deviations(found, name, true)
        assert len(off) > 6, name
        assert np.sqrt(np.mean(off**2)) < 1.3, name
        assert np.abs(off).max() < 4, name


def test_line_curl_and_rest_are_right_within_their_errors(draws, rng):
    exact, starts = draws
    found = throw_table(seen(exact, rng))
    way = np.sign(starts[:, 3])
    ahead = starts[:, 2:4] / np.hypot(*starts[:, 2:4].T)[:, None]
    rest = np.array([track.xy[-1] for track in exact])
    away = rest - starts[:, :2]
    curl = ahead[:, 0] * away[:, 1] - ahead[:, 1] * away[:, 0]
    at_tee = way * (starts[:, 0] + (TEE + HOG) * ahead[:, 0] / np.abs(ahead[:, 1]))
    truth = {
        "speed": np.hypot(*starts[:, 2:4].T),
        "line": at_tee,
        "curl": curl,
        "right": way * rest[:, 0],
        "past": way * rest[:, 1] - TEE,
        "from_tee": np.hypot(rest[:, 0], way * rest[:, 1] - TEE),
    }
    for name, true in truth.items():
        off = deviations(found, name, true)
        assert np.sqrt(np.mean(off**2)) < 1.5, name
    assert np.abs(curl).mean() > 0.5
    turned = [abs(track.theta[-1] - track.theta[0]) / (2 * np.pi) for track in exact]
    assert [one.turns.value for one in found] == pytest.approx(turned, abs=0.03)
    assert [one.spin.value for one in found] == pytest.approx(starts[:, 4], rel=0.05)


def test_a_stone_that_is_pushed_aside_afterwards_came_to_rest_before(draws, rng):
    for track in seen(draws[0][:4], rng):
        found = measure_throw(track)
        t = np.arange(1, 25) / 30
        aside = track.xy[-1] + np.column_stack([0.6 * t, 0.2 * t])
        columns = {
            "t": np.append(track.t, track.t[-1] + t),
            "xy": np.concatenate([track.xy, aside]),
            "theta": np.append(track.theta, np.full(len(t), track.theta[-1])),
            "swept": np.zeros(len(track) + len(t)),
            "sigma_xy": np.full(len(track) + len(t), 0.002),
        }
        pushed = measure_throw(replace(track, **columns))
        assert pushed.rests
        for name in ("right", "past", "curl", "turns"):
            true = getattr(found, name).value
            assert getattr(pushed, name).value == pytest.approx(true, abs=0.01), name


def test_persistent_errors_are_within_the_stated_ones(draws, as_filmed):
    exact, starts = draws
    found = throw_table(as_filmed(exact, 3))
    true = [when(track, HOG) - when(track, -HOG) for track in exact]
    assert np.sqrt(np.mean(deviations(found, "hog_to_hog", true) ** 2)) < 1.6
    speed = np.hypot(*starts[:, 2:4].T)
    assert np.sqrt(np.mean(deviations(found, "speed", speed) ** 2)) < 1.5


def test_both_ends_are_measured_alike(draws, rng):
    """A sheet turned by half a turn shows the thrower the same throw."""
    track = next(track for track in seen(draws[0], rng) if abs(track.xy[-1, 1]) > TEE + 0.5)
    there, back = measure_throw(track), measure_throw(replace(track, xy=-track.xy))
    assert (there.direction, back.direction) == (Direction.AWAY, Direction.HOME)
    for name in (*TIMES, "line", "curl", "right", "past", "speed"):
        assert getattr(back, name).value == pytest.approx(getattr(there, name).value, abs=1e-9)


def test_unseen_values_are_missing(draws, rng):
    (track, *_) = seen(draws[0], rng)
    hidden = (np.abs(track.xy[:, 1] + HOG) > 3) & (track.xy[:, 1] < 14)
    rows = np.flatnonzero(hidden)
    columns = ("t", "xy", "theta", "swept", "sigma_xy")
    part = replace(track, **{name: getattr(track, name)[rows] for name in columns})
    found = measure_throw(part)
    assert found.hog_to_hog is None
    assert found.back_to_hog is None
    assert found.curl is None
    assert not found.rests


def test_a_throw_that_hits_is_measured_up_to_the_contact(draws, rng):
    """The times end with the contact; the place of rest of the thrown stone is still reported."""
    exact = draws[0][0]
    at = when(exact, 15.0)
    hit = int(np.searchsorted(exact.t, at))
    stops = exact.xy.copy()
    stops[hit:] = exact.xy[hit]
    thrown = seen([replace(exact, xy=stops)], rng)[0]
    n = len(exact) - hit
    struck = Trajectory(
        t=exact.t[hit:],
        xy=exact.xy[hit] + np.array([0.0, 0.29]) + np.outer(np.linspace(0, 1.5, n), [0.1, 1.0]),
        theta=np.zeros(n),
        stone=1,
        throw=exact.throw,
    )
    (found,) = throw_table([thrown, struck])
    assert found.stone == 0
    assert found.touched
    assert found.hog_to_hog is not None
    assert found.hog_to_tee is None
    assert found.curl is None
    assert found.past.value == pytest.approx(15.0 - TEE, abs=0.1)


def test_throws_that_never_slide_have_no_row():
    still = Trajectory(t=np.array([0.0, 9.0]), xy=np.zeros((2, 2)))
    assert throw_table([still]) == []


def test_numbers_go_out_by_name_with_their_errors(draws, rng):
    (track, *_) = seen(draws[0], rng)
    shown = measure_throw(track).as_dict()
    assert shown["direction"] == "away"
    assert shown["hog_to_hog"] > 10
    assert 0 < shown["hog_to_hog_sigma"] < 0.1
    assert "origin" not in shown
