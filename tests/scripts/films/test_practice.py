"""A practice film is joined in order, and its tracks are compared with the true throws."""

from __future__ import annotations

import numpy as np
import pytest
from films.practice import Clip, order_of, score
from films.render import FPS

from curling_env.trajectory import Trajectory

TRUE = np.column_stack([np.arange(0.0, 26.0, 0.1), np.zeros(260), np.linspace(-11.0, 16.0, 260)])
"""The clip of one throw: released after a second, at rest after 25."""
THROWN = [
    {"clip": "draw", "begins": at, "released": at + 1.0, "rests": at + 25.0} for at in (10.0, 70.0)
]


def track_from(begin, end, *, throw=0, right=0.0, stone=0):
    """Return the track of the throws from one time to another [s], with an offset to the right
    [m].
    """
    t = np.arange(begin, end, 0.1)
    at = 10.0 if t[0] < 40 else 70.0
    y = np.interp(t - at, TRUE[:, 0], TRUE[:, 2])
    xy = np.column_stack([np.full(len(t), right), y])
    return Trajectory(throw=throw, stone=stone, clock=begin, t=t - begin, xy=xy)


def scored(*tracks):
    return score(tracks, THROWN, {"draw": TRUE})


def test_throws_that_are_tracked_to_their_rest_are_found():
    seen = scored(track_from(12, 36, right=0.003), track_from(71, 85, throw=1, right=0.005))
    assert (len(seen.tracks), seen.to_rest) == (2, 1)
    assert (seen.split, seen.joined, seen.invented) == (0, 0, 0)
    assert [track.error for track in seen.tracks] == pytest.approx([0.003, 0.005])


def test_a_throw_in_two_tracks_is_cut_in_two_and_one_track_of_two_throws_joins_them():
    seen = scored(track_from(11, 20), track_from(20, 36, throw=1))
    assert (len(seen.tracks), seen.split, seen.joined) == (2, 1, 0)
    seen = scored(track_from(12, 90))
    assert (len(seen.tracks), seen.split, seen.joined) == (2, 0, 1)


def test_a_track_of_no_throw_is_invented_and_other_stones_of_a_throw_are_not():
    seen = scored(
        track_from(12, 36), track_from(12, 36, stone=1, right=1.0), track_from(40, 60, throw=1)
    )
    assert (seen.invented, len(seen.tracks)) == (1, 1)
    assert seen.tracks[0].error < 1e-9
    assert not scored().tracks


def test_a_film_has_a_throw_a_minute():
    throws = [Clip(name=f"throw{k}", frames=30 * FPS, shown=None, released=1.0) for k in range(4)]
    other = [Clip(name=name, frames=8 * FPS, shown=None) for name in ("pair", "empty")]
    order = order_of(throws, other, 8, np.random.default_rng(1))
    thrown = [clip.name for clip in order if clip.released is not None]
    assert len(thrown) == 8
    assert all(thrown.count(clip.name) == 2 for clip in throws)
    assert len(order) > len(thrown)
    assert sum(clip.frames for clip in order) == pytest.approx(8 * 60 * FPS, abs=10 * FPS)
