"""Tracks of a takeout are compared with the nearest stones."""

from __future__ import annotations

import numpy as np
import pytest
from films.takeouts import seen_of

from curling_env.trajectory import Trajectory

T = np.arange(0.0, 20.0, 0.1)
CONTACT = 10.0


def way(stone):
    """Return the path of a thrown stone that stops at a hit, with the other one moving on."""
    at = np.minimum(T, CONTACT) if stone == 0 else 10.3 + np.maximum(T - CONTACT, 0)
    return np.column_stack([np.zeros(len(T)), at])


TRUTH = {
    "paths": [
        {"t": T.tolist(), "xy": way(k).tolist(), "theta": (0.1 * T).tolist()} for k in (0, 1)
    ],
    "contact": CONTACT,
    "resting": [],
}


def seen(xy, stone=0, turned=0.0):
    track = Trajectory(
        t=T, xy=xy, theta=0.1 * T + turned, stone=stone, sigma_xy=np.full(len(T), 0.003)
    )
    return seen_of(track, TRUTH)


def test_errors_are_reported_before_and_after_the_contact():
    off = np.where(T[:, None] < CONTACT, [0.002, 0.0], [0.0, 0.008])
    found = seen(way(0) + off, turned=2 * np.pi + 0.2)
    assert (found.stone, found.right) == (0, True)
    assert (found.before, found.after) == pytest.approx((0.002, 0.008))
    assert found.turned == pytest.approx(0.2)


def test_a_track_that_continues_with_the_struck_stone_is_wrong():
    assert not seen(np.where(T[:, None] < CONTACT, way(0), way(1))).right
    assert not seen(way(1)).right
    assert seen(way(1), stone=1).right
