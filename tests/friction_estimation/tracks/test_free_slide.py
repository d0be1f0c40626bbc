"""The part of a track on which friction alone acts."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import TrackTooShortError
from curling_env.trajectory import Trajectory
from friction_estimation.tracks import free_slides

A = 0.09
HOG = 10.9725


def free_slide(track):
    (slide,), _ = free_slides([track])
    return slide


def test_lead_in_and_rest_are_excluded(filmed, rng):
    """Held still, then slid at constant speed by a player who releases after the hog line."""
    track, released = filmed(rng, held=1.5, pushed=3.0, y0=-HOG + 2.0)
    part = free_slide(track)
    assert part.released_at == pytest.approx(released, abs=0.5)
    assert part.rests
    assert part.t[-1] == pytest.approx(released + 2.0 / A, abs=1.0)


def test_short_lead_in_ends_at_the_hog_line(filmed, rng):
    track, released = filmed(rng, pushed=0.5)
    assert free_slide(track).released_at == pytest.approx(released, abs=0.1)


def test_long_free_slide_before_the_hog_line_is_kept(filmed, rng):
    track, _ = filmed(rng, speed=2.4, y0=-HOG - 5.0)
    assert free_slide(track).released_at < 0.1


def test_play_towards_home_is_the_same_by_half_turn(filmed, rng):
    track, released = filmed(rng, pushed=0.5)
    part = free_slide(Trajectory(t=track.t, xy=-track.xy))
    assert part.released_at == pytest.approx(released, abs=0.1)


def test_stone_stopped_by_another_ends_the_slide(filmed, rng):
    track, _ = filmed(rng, rest=0.0)
    hit = track.t >= 10.0
    xy = track.xy.copy()
    xy[hit] = xy[np.argmax(hit)] + rng.normal(0, 0.003, (int(hit.sum()), 2))
    part = free_slide(Trajectory(t=track.t, xy=xy))
    assert not part.rests
    assert 8.0 < part.t[-1] < 10.1


def test_lost_frames_do_no_harm(filmed, rng):
    track, _ = filmed(rng)
    keep = rng.random(len(track)) > 0.3
    keep[200:290] = False
    part = free_slide(Trajectory(t=track.t[keep], xy=track.xy[keep]))
    assert part.rests
    assert part.duration > 21.0


def test_resting_stones_are_skipped_and_named(filmed, rng):
    still = Trajectory(t=np.arange(100) / 30, xy=rng.normal([0.5, 17.0], 0.002, (100, 2)), throw=7)
    moving, _ = filmed(rng)
    slides, reasons = free_slides([moving, still])
    assert len(slides) == 1
    assert len(reasons) == 1
    assert "throw 7" in reasons[0]
    with pytest.raises(TrackTooShortError, match="no throw slides freely"):
        free_slides([still])


@pytest.mark.parametrize(("speed", "rests"), [(0.0, True), (0.15, False), (0.5, False)])
def test_stone_that_leaves_the_picture_moving_did_not_rest(filmed, rng, speed, rests):
    track, _ = filmed(rng, rest=0.0, noise=0.003)
    rows = track.t <= (2.0 - speed) / A
    assert free_slide(Trajectory(t=track.t[rows], xy=track.xy[rows])).rests == rests
