"""The part of a track that counts, and its derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import TrackTooShortError
from curling_env.trajectory import Trajectory
from friction_estimation.tracks.free_slide import free_slide, free_slides
from friction_estimation.tracks.outliers import wild_rows
from friction_estimation.tracks.smoothing import local_fit, smooth_motion

A = 0.09
HOG = 10.9725


def filmed(
    rng, *, speed=2.0, held=0.0, pushed=0.0, push=0.0, rest=2.0, y0=-HOG, noise=0.003, fps=30
):
    """A stone held, pushed with an acceleration, released at (0.2, y0), sliding to rest."""
    slide_time = speed / A
    t = np.arange(0.0, held + pushed + slide_time + rest, 1 / fps)
    since = t - held - pushed
    back = np.clip(since, -pushed, 0.0)
    y = np.where(
        since < 0,
        y0 + speed * back + 0.5 * push * back**2,
        y0 + speed * np.minimum(since, slide_time) - 0.5 * A * np.minimum(since, slide_time) ** 2,
    )
    xy = np.column_stack([np.full_like(t, 0.2), y]) + rng.normal(0, noise, (len(t), 2))
    return Trajectory(t=t, xy=xy), held + pushed


def test_quadratic_is_read_exactly_at_uneven_times(rng):
    t = np.sort(rng.uniform(0, 10, 200))
    (value, first, second), _ = local_fit(t, 1 + 2 * t - 0.3 * t**2, 1.5)
    assert np.allclose(value, 1 + 2 * t - 0.3 * t**2, atol=1e-6)
    assert np.allclose(first, 2 - 0.6 * t, atol=1e-4)
    assert np.allclose(second, -0.6, atol=1e-2)


def test_error_of_acceleration_is_the_textbook_one(rng):
    """σ_a = σ √(720/(fT))/T² for a quadratic over T at f frames a second."""
    t = np.arange(0, 20, 1 / 30)
    xy = np.column_stack([np.zeros_like(t), 2 * t])
    motion = smooth_motion(t, xy, window=2.0, noise=0.005)
    expected = 0.005 * np.sqrt(720 / (30 * 2.0)) / 2.0**2
    assert motion.acceleration_sigma[len(t) // 2] == pytest.approx(expected, rel=0.1)


def test_speed_is_along_the_path_not_along_the_sheet(rng):
    angle = np.arange(0, 3, 0.02)
    circle = 5 * np.column_stack([np.cos(angle), np.sin(angle)])
    motion = smooth_motion(angle, circle, window=0.2)
    assert np.allclose(motion.speed[10:-10], 5.0, atol=0.01)
    assert np.allclose(motion.acceleration[10:-10], 0.0, atol=0.05)


@given(seed=st.integers(0, 2**16))
def test_good_rows_are_never_called_wild(seed):
    track, _ = filmed(np.random.default_rng(seed), noise=0.004)
    wild, noise = wild_rows(track.t, track.xy)
    assert not wild.any()
    assert noise == pytest.approx(0.004, rel=0.25)


def test_wild_rows_and_bursts_are_left_out(rng):
    track, _ = filmed(rng)
    xy = track.xy.copy()
    singles = rng.choice(len(xy), 25, replace=False)
    xy[singles] += rng.choice([-1.0, 1.0], (25, 2)) * rng.uniform(0.1, 5.0, (25, 2))
    xy[300:306] += [0.4, -1.0]
    part = free_slide(Trajectory(t=track.t, xy=xy))
    spoilt = set(singles) | set(range(300, 306))
    assert not spoilt & set(part.rows.tolist())
    assert len(part.rows) > 0.85 * (2.0 / A) * 30


def test_lead_in_and_rest_are_left_out(rng):
    """Held still, then slid at constant speed by a player who lets go after the hog line."""
    track, released = filmed(rng, held=1.5, pushed=3.0, y0=-HOG + 2.0)
    part = free_slide(track)
    assert part.released_at == pytest.approx(released, abs=0.5)
    assert part.rests
    assert part.t[-1] == pytest.approx(released + 2.0 / A, abs=1.0)


def test_short_lead_in_ends_at_the_hog_line(rng):
    track, released = filmed(rng, pushed=0.5)
    assert free_slide(track).released_at == pytest.approx(released, abs=0.1)


def test_long_free_slide_before_the_hog_line_is_kept(rng):
    track, _ = filmed(rng, speed=2.4, y0=-HOG - 5.0)
    assert free_slide(track).released_at < 0.1


def test_play_towards_home_is_the_same_by_half_turn(rng):
    track, released = filmed(rng, pushed=0.5)
    part = free_slide(Trajectory(t=track.t, xy=-track.xy))
    assert part.released_at == pytest.approx(released, abs=0.1)


def test_stone_stopped_by_another_ends_the_slide(rng):
    track, _ = filmed(rng, rest=0.0)
    hit = track.t >= 10.0
    xy = track.xy.copy()
    xy[hit] = xy[np.argmax(hit)] + rng.normal(0, 0.003, (int(hit.sum()), 2))
    part = free_slide(Trajectory(t=track.t, xy=xy))
    assert not part.rests
    assert 8.0 < part.t[-1] < 10.1


def test_lost_frames_do_no_harm(rng):
    track, _ = filmed(rng)
    keep = rng.random(len(track)) > 0.3
    keep[200:290] = False
    part = free_slide(Trajectory(t=track.t[keep], xy=track.xy[keep]))
    assert part.rests
    assert part.duration > 21.0


def test_resting_stones_are_skipped_and_named(rng):
    still = Trajectory(t=np.arange(100) / 30, xy=rng.normal([0.5, 17.0], 0.002, (100, 2)), throw=7)
    moving, _ = filmed(rng)
    slides, reasons = free_slides([moving, still])
    assert len(slides) == 1
    assert len(reasons) == 1
    assert "throw 7" in reasons[0]
    with pytest.raises(TrackTooShortError, match="no throw slides freely"):
        free_slides([still])


@pytest.mark.parametrize(("speed", "rests"), [(0.0, True), (0.15, False), (0.5, False)])
def test_stone_that_leaves_the_picture_moving_did_not_rest(rng, speed, rests):
    track, _ = filmed(rng, rest=0.0, noise=0.003)
    rows = track.t <= (2.0 - speed) / A
    assert free_slide(Trajectory(t=track.t[rows], xy=track.xy[rows])).rests == rests


@pytest.mark.parametrize("fps", [4, 5, 8, 12])
@pytest.mark.parametrize("noise", [0.001, 0.005])
def test_a_slow_camera_that_loses_frames_sees_no_wild_rows_where_none_are(sliding, fps, noise):
    """Over the seconds between a row and its tenth neighbour friction bends a path by many cm."""
    rng = np.random.default_rng([fps, int(1e4 * noise)])
    every = int(np.ceil(30 / fps))
    tracks = sliding.measured_throws(
        sliding.uniform(0.009), sliding.varied_starts(rng, 4), rng, noise=noise, fps=every * fps
    )
    taken = rows = 0
    for track in tracks:
        t, xy = track.t[::every], track.xy[::every]
        lost = rng.uniform(0.3, 0.7) * t[-1]
        kept = (rng.random(len(t)) > 0.1) & ~((t > lost) & (t < lost + 1.5))
        for seen in (np.ones(len(t), dtype=bool), kept):
            wild, found = wild_rows(t[seen], xy[seen])
            taken, rows = taken + wild.sum(), rows + len(wild)
            assert found == pytest.approx(noise, rel=0.5)
        off = np.zeros(len(t), dtype=bool)
        off[[len(t) // 4, len(t) // 4 + 1, len(t) // 2]] = True
        moved = xy + 0.4 * off[:, None]
        assert wild_rows(t, moved)[0][off].all()
    assert taken < 0.01 * rows
