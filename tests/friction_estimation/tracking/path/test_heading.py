"""A heading from pictures that each show little, mislead, or show somebody's foot."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.tracking import tuning
from friction_estimation.tracking.path.heading import (
    HeadingCurve,
    HeadingViews,
    KnownHeading,
    fit_heading_curve,
    headings_near,
    unseen_turn,
)

T = np.arange(0, 20, 1 / 15)
SPEED = np.maximum(2.0 - 0.1 * T, 0.0)
TRUTH = 0.4 + 1.1 * np.cumsum(np.where(SPEED > 0, (SPEED / 2) ** 0.25, 0)) / 15
HEADINGS = np.linspace(-np.pi, np.pi, 24, endpoint=False)


def seen(rng, truth=TRUTH, *, line=3.0, front=1.5, noise=2.0, every=5):
    """Misfits of all headings in single pictures: the handle's line, its front, and noise."""
    views = HeadingViews()
    for t, theta in zip(T[::every], truth[::every], strict=True):
        off = HEADINGS - theta
        cost = line * (1 - np.cos(2 * off)) + front * (1 - np.cos(off))
        waves = rng.normal(0, noise / 2, (2, 4))
        phases = np.outer(np.arange(1, 5), HEADINGS)
        views.add(t, cost + waves[0] @ np.cos(phases) + waves[1] @ np.sin(phases))
    return views


def miss(turn, truth=TRUTH):
    """Errors where the heading is trusted, but for whole revolutions, (n,) [rad]."""
    trusted = turn.trusted(T)
    off = (turn.at(T) - truth)[trusted]
    return off - 2 * np.pi * np.round(np.median(off) / (2 * np.pi))


@pytest.mark.parametrize("direction", [1, -1])
def test_pictures_that_hardly_show_the_heading_show_it_together(direction):
    views = seen(np.random.default_rng(1), direction * TRUTH, noise=3.0)
    first = [HEADINGS[np.argmin(cost)] for cost in views.cost]
    wrong = np.abs(np.angle(np.exp(1j * (first - direction * TRUTH[::5])))) > 0.7
    assert wrong.mean() > 0.05
    turn = fit_heading_curve(views, T, SPEED)
    assert turn.trusted(T).mean() > 0.95
    assert np.abs(miss(turn, direction * TRUTH)).max() < 0.4


def test_a_spin_that_falls_otherwise_than_a_power_of_the_speed_is_followed():
    truth = TRUTH + 1.2 * np.sin(T / 4)
    turn = fit_heading_curve(seen(np.random.default_rng(2), truth), T, SPEED)
    assert turn.trusted(T).mean() > 0.9
    assert np.sqrt(np.mean(miss(turn, truth) ** 2)) < 0.2


@pytest.mark.parametrize("seed", range(5))
def test_when_both_ends_look_alike_there_is_no_heading(seed):
    assert fit_heading_curve(seen(np.random.default_rng(seed), front=0.0), T, SPEED) is None


@pytest.mark.parametrize("seed", range(5))
def test_when_pictures_show_no_handle_there_is_no_heading(seed):
    assert fit_heading_curve(seen(np.random.default_rng(seed), line=0, front=0), T, SPEED) is None


@pytest.mark.parametrize("off", [2.0, np.pi])
def test_many_pictures_of_a_stone_at_rest_do_not_outvote_those_of_its_way(off):
    """At rest all of them show another heading, as a handle in a bad light does."""
    speed = np.maximum(2.0 - 0.5 * T, 0.0)
    truth = 0.4 + 1.1 * np.cumsum(np.where(speed > 0, (speed / 2) ** 0.25, 0)) / 15
    shown = np.where(speed > 0, truth, truth + off)
    views = seen(np.random.default_rng(6), shown, front=3.0, noise=1.0)
    assert (np.interp(views.t, T, speed) == 0).sum() > 2 * tuning.MIN_HEADING_VIEWS
    turn = fit_heading_curve(views, T, speed)
    slides = turn.trusted(T) & (speed > 0.1)
    assert slides.sum() > 0.9 * (speed > 0.1).sum()
    assert np.abs(np.angle(np.exp(1j * (turn.at(T) - truth)))[slides]).max() < 0.7


def test_a_foot_beside_the_handle_is_not_taken_for_it():
    """For five seconds all pictures show another heading, which stays the same."""
    rng = np.random.default_rng(4)
    views, foot = seen(rng), seen(rng, np.full(len(T), 2.0), noise=0.5)
    hidden = [8 < t < 13 for t in views.t]
    views.cost = [f if h else c for c, f, h in zip(views.cost, foot.cost, hidden, strict=True)]
    turn = fit_heading_curve(views, T, SPEED)
    assert not turn.trusted(np.array([10.0, 10.5, 11.0])).all()
    assert turn.trusted(T[(T < 6) | (T > 15)]).all()
    sure = turn.trusted(T) & ((T < 7) | (T > 14))
    off = np.angle(np.exp(1j * (turn.at(T) - TRUTH)[sure]))
    assert np.abs(off).max() < 0.5


def test_headings_near_the_curve_are_kept_and_others_left_out():
    rng = np.random.default_rng(6)
    moments = np.arange(0, 20, 1.5)
    turn = HeadingCurve(moments, np.interp(moments, T, TRUTH))
    theta = TRUTH + rng.normal(0, 0.1, len(T))
    theta[30:40] += np.pi
    found, sigma = headings_near(turn, T, np.angle(np.exp(1j * theta)), np.full(len(T), 0.1))
    assert (np.isfinite(sigma) == np.isfinite(found)).all()
    assert np.isnan(found[30:40]).all()
    assert np.abs((found - TRUTH)[np.isfinite(found)]).max() < 0.7
    assert np.isfinite(found).sum() == len(T) - 10


def test_revolutions_are_not_counted_across_a_long_gap():
    """The stone may have turned once more than it seems while it was hidden."""
    moments = np.r_[np.arange(0, 7, 1.0), np.arange(10.5, 20, 1.0)]
    turn = HeadingCurve(moments, np.interp(moments, T, TRUTH) - 2 * np.pi * (moments > 8))
    found, _ = headings_near(turn, T, np.angle(np.exp(1j * TRUTH)), np.full(len(T), 0.1))
    known = np.isfinite(found)
    assert not known[T < 7].any()
    assert known[T > 10.5].mean() > 0.9


def test_where_frames_lose_the_handle_single_pictures_show_it():
    """From 9 s on each fit starts at the last one's wrong heading, which crosses the right one."""
    rng = np.random.default_rng(7)
    turn = fit_heading_curve(seen(rng, noise=0.5), T, SPEED)
    theta = TRUTH + rng.normal(0, 0.1, len(T))
    lost = T > 9
    theta[lost] = TRUTH[lost] + 1.2 * (12 - T[lost])
    found, sigma = headings_near(turn, T, np.angle(np.exp(1j * theta)), np.full(len(T), 0.1))
    off = np.angle(np.exp(1j * (found - TRUTH)))
    late = np.isfinite(found) & (T > 10)
    assert np.abs(off[late]).max() < 0.5
    assert np.isfinite(found[T < 7]).all()
    assert np.diff(T[late]).max() < 0.4
    assert (sigma[late] > 0).all()


def test_a_stone_turns_on_while_its_pixels_stay_the_same_until_it_rests():
    turn = HeadingCurve(T, 0.8 * T)
    speed = np.full(len(T), 0.06)
    age = np.where(T < 10, 0.05, 3.0)
    turned = unseen_turn(turn, T, speed, age)
    assert turned[T < 10] == pytest.approx(0.8 * 0.05)
    rests_after = 0.06 / tuning.HIDDEN_DECELERATION
    assert turned[T > 13] == pytest.approx(0.8 * rests_after)


def test_a_curve_differs_from_another_one():
    moments = np.arange(0, 20, 0.5)
    right = HeadingCurve(moments, np.interp(moments, T, TRUTH))
    assert not right.differs(HeadingCurve(moments, np.interp(moments, T, TRUTH) + 4 * np.pi))
    assert right.differs(HeadingCurve(moments, np.interp(moments, T, TRUTH) + np.pi))
    aside = np.interp(moments, T, TRUTH) + np.pi * (moments > 15)
    assert right.differs(HeadingCurve(moments, aside))
    assert not right.differs(HeadingCurve(moments, aside, moments < 14))


@pytest.mark.parametrize("seed", range(6))
def test_after_a_contact_the_heading_goes_on_from_where_it_was(seed):
    """A second and a half, whose pictures alone cannot tell the front of the handle.

    Between two of them a spin of 7.9 rad/s more or less turns the handle end for end.
    """
    truth, short = 0.4 - 2.3 * T, T < 1.5
    rng = np.random.default_rng(seed)
    views = seen(rng, truth, front=0.2, noise=1.0, every=6).between(0.0, 1.5)
    assert fit_heading_curve(views, T[short], SPEED[short]) is None
    known = KnownHeading(t=0.0, theta=float(truth[0]) + 0.1 + 4 * np.pi, spin=-1.5)
    turn = fit_heading_curve(views, T[short], SPEED[short], known)
    off = np.angle(np.exp(1j * (turn.at(T[short]) - truth[short])))
    assert np.abs(off).max() < 0.6


def test_a_known_heading_makes_no_handle_visible():
    views = seen(np.random.default_rng(3), line=0, front=0).between(0.0, 2.5)
    known = KnownHeading(t=0.0, theta=0.4)
    assert fit_heading_curve(views, T, SPEED, known) is None


def test_a_curve_through_headings_of_single_frames_is_nearer_than_each_of_them():
    rng = np.random.default_rng(5)
    t = np.sort(rng.choice(np.arange(0.0, 30.0, 0.2), 120, replace=False))
    true = 1.1 * t - 0.015 * t**2
    curve = HeadingCurve.through(t, true + 0.3 * rng.standard_normal(len(t)))
    inside = np.arange(1.0, 29.0, 0.1)
    off = curve.at(inside) - np.interp(inside, t, true)
    assert np.sqrt(np.mean(off**2)) < 0.15
