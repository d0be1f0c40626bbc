"""A steady turn from headings that are noisy, half a turn off, or missing."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.tracking.heading import Turn, consistent_heading, heading_about

T = np.arange(0, 20, 1 / 15)
SPEED = np.maximum(2.0 - 0.1 * T, 0.0)
TRUTH = 0.4 + 1.1 * np.cumsum(np.where(SPEED > 0, (SPEED / 2) ** 0.25, 0)) / 15


def measured(rng, *, noise=0.2, slips=0.3):
    theta = TRUTH + rng.normal(0, noise, len(T)) + np.pi * (rng.random(len(T)) < slips)
    return np.angle(np.exp(1j * theta)), np.full(len(T), noise)


@pytest.mark.parametrize("direction", [1, -1])
def test_half_turns_are_put_right(direction):
    theta, sigma = measured(np.random.default_rng(1))
    found = consistent_heading(T, direction * theta, sigma, SPEED)
    known = np.isfinite(found)
    assert known.mean() > 0.9
    miss = found[known] - direction * TRUTH[known]
    miss -= 2 * np.pi * np.round(np.median(miss) / (2 * np.pi))
    assert np.sqrt(np.mean(miss**2)) < 0.3


def test_when_both_ends_look_alike_there_is_no_heading():
    theta, sigma = measured(np.random.default_rng(2), slips=0.5)
    assert np.isnan(consistent_heading(T, theta, sigma, SPEED)).all()


def test_when_headings_follow_no_turn_there_is_none():
    rng = np.random.default_rng(3)
    theta = rng.uniform(-np.pi, np.pi, len(T))
    assert np.isnan(consistent_heading(T, theta, np.full(len(T), 0.2), SPEED)).all()


def test_frames_without_a_heading_stay_without():
    theta, sigma = measured(np.random.default_rng(4), slips=0.1)
    theta[50:80] = np.nan
    found = consistent_heading(T, theta, sigma, SPEED)
    assert np.isnan(found[50:80]).all()
    assert np.isfinite(found[80:]).mean() > 0.9


def test_a_turn_that_loses_count_while_the_stone_is_hidden_is_not_believed_there():
    """Clear pictures on both sides of a gap in which it turned once more than they seem to say."""
    rng = np.random.default_rng(5)
    moments = np.r_[np.arange(0, 7, 1.0), np.arange(10.5, 20, 1.0)]
    headings = np.interp(moments, T, TRUTH) - 2 * np.pi * (moments > 8)
    theta = np.angle(np.exp(1j * (TRUTH + rng.normal(0, 0.1, len(T)))))
    found = heading_about(Turn(moments, headings), T, theta, np.arange(len(T)) % 5 == 0)
    known = np.isfinite(found)
    assert not known[(T > 7.7) & (T < 8.7)].any()
    assert max(known[T < 4].mean(), known[T > 16].mean()) > 0.8
    miss = (found - TRUTH)[known]
    assert np.ptp(miss) < 1.0  # one count of whole turns throughout


def test_a_turn_that_is_right_is_believed_throughout():
    moments = np.arange(0, 20, 1.5)
    theta = np.angle(np.exp(1j * (TRUTH + np.random.default_rng(6).normal(0, 0.1, len(T)))))
    turn = Turn(moments, np.interp(moments, T, TRUTH))
    found = heading_about(turn, T, theta, np.arange(len(T)) % 5 == 0)
    assert np.isfinite(found).all()
    assert np.abs(found - TRUTH).max() < 0.7
