"""Outliers of a track."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.trajectory import Trajectory
from friction_estimation.tracks import free_slides, wild_rows

A = 0.09


@given(seed=st.integers(0, 2**16))
def test_good_rows_are_never_called_wild(filmed, seed):
    track, _ = filmed(np.random.default_rng(seed), noise=0.004)
    wild, noise = wild_rows(track.t, track.xy)
    assert not wild.any()
    assert noise == pytest.approx(0.004, rel=0.25)


def test_outliers_and_bursts_are_excluded(filmed, rng):
    track, _ = filmed(rng)
    xy = track.xy.copy()
    singles = rng.choice(len(xy), 25, replace=False)
    xy[singles] += rng.choice([-1.0, 1.0], (25, 2)) * rng.uniform(0.1, 5.0, (25, 2))
    xy[300:306] += [0.4, -1.0]
    (part,), _ = free_slides([Trajectory(t=track.t, xy=xy)])
    spoilt = set(singles) | set(range(300, 306))
    assert not spoilt & set(part.rows.tolist())
    assert len(part.rows) > 0.85 * (2.0 / A) * 30


@pytest.mark.parametrize(("fps", "noise"), [(4, 0.001), (4, 0.005), (12, 0.001), (8, 0.005)])
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
