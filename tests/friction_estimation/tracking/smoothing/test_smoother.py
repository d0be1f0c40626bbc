"""The motion model run forward and backward over the measurements of one stone."""

from __future__ import annotations

import numpy as np

from friction_estimation.tracking.smoothing.smoother import smooth_path

NOISE = 0.01


def slide(t, start, velocity, deceleration=0.1):
    """Places (n, 2) of a stone that slides on ice until it rests."""
    speed = np.hypot(*velocity)
    going = np.minimum(t, speed / deceleration)
    way = speed * going - 0.5 * deceleration * going**2
    return np.asarray(start) + way[:, None] * np.asarray(velocity) / speed


def measured(true, seed=0):
    return true + np.random.default_rng(seed).normal(0.0, NOISE, true.shape)


def test_the_error_is_far_below_that_of_a_measurement_and_the_rest_is_found():
    t = np.arange(0.0, 26.0, 1 / 15)
    true = slide(t, (0.1, -11.0), (0.02, 2.1))
    found = smooth_path(t, measured(true), np.full(true.shape, 0.02))
    assert np.sqrt(np.mean((found.place - true) ** 2)) < 0.25 * NOISE
    assert abs(found.rests_from - 21.0) < 0.7
    assert abs(found.scale - 0.5) < 0.1
    off = (found.place - true) / found.sigma
    assert np.mean(np.abs(off) < 1.96) > 0.85


def test_outliers_and_gaps_hardly_move_the_path():
    t = np.arange(0.0, 15.0, 1 / 15)
    true = slide(t, (0.0, -11.0), (0.0, 2.1))
    places = measured(true)
    places[::17] += 0.3
    places[60:100] = np.nan
    found = smooth_path(t, places, np.full(true.shape, NOISE))
    assert np.hypot(*(found.place - true).T).max() < 3 * NOISE
    assert found.sigma[80, 1] > 2 * found.sigma[50, 1]
    assert found.rests_from == np.inf


def test_a_contact_lets_the_velocity_jump():
    t = np.arange(0.0, 10.0, 1 / 15)
    first = slide(t[t < 4.0], (0.0, -11.0), (0.0, 2.1))
    after = slide(t[t >= 4.0] - 4.0, first[-1] + [0.0, 0.1], (0.5, 0.4))
    true = np.concatenate([first, after])
    found = smooth_path(t, measured(true), np.full(true.shape, NOISE), contacts=(4.0 - 1 / 30,))
    assert np.hypot(*(found.place - true).T).max() < 3 * NOISE
    rounded = smooth_path(t, measured(true), np.full(true.shape, NOISE))
    assert np.hypot(*(rounded.place - true).T).max() > 5 * NOISE


def test_what_a_hand_does_says_nothing_of_the_ice():
    t = np.arange(0.0, 8.0, 1 / 15)
    pushed = np.minimum(t, 2.0)
    slides = slide(np.maximum(t - 2.0, 0.0), (0.0, 2.0), (0.0, 2.0))
    true = np.where(t[:, None] < 2.0, np.column_stack([0 * t, 0.5 * pushed**2]), slides)
    found = smooth_path(t, measured(true), np.full(true.shape, NOISE), released=2.0)
    assert np.hypot(*(found.place - true)[t > 2.2].T).max() < 2.5 * NOISE
    assert abs(np.hypot(*found.velocity[np.searchsorted(t, 2.5)]) - 1.95) < 0.03
