"""Friction outside that of any ice is questioned."""

from __future__ import annotations

import re

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.tracks import friction_question, rough_friction


def slide(mu, slow=1.0, speed=2.0):
    """Return a stone that slides to rest, in a film in slow motion."""
    brake = 9.80665 * mu
    t = np.arange(0, speed / brake + 1, 1 / 30)
    moving = np.minimum(t, speed / brake)
    y = speed * moving - brake * moving**2 / 2
    xy = np.column_stack([0.002 * np.random.default_rng(0).standard_normal(len(t)), y])
    return Trajectory(t=t * slow, xy=xy)


@pytest.mark.parametrize("mu", [0.006, 0.009, 0.02])
def test_friction_of_ice_is_not_questioned(mu):
    assert rough_friction(slide(mu)) == pytest.approx(mu, rel=0.1)
    assert friction_question(rough_friction(slide(mu))) is None


@pytest.mark.parametrize(
    ("slow", "asked"),
    [(2.0, r"below .* 2 times slower .* --slow 2"), (4.0, "--slow 4"), (8.0, "--slow 8")],
)
def test_slow_motion_is_questioned(slow, asked):
    question = friction_question(rough_friction(slide(0.0095, slow)))
    assert question is not None

    assert re.search(asked, question)


def test_friction_without_a_likely_playback_speed_is_questioned_in_general():
    assert "are the times of the frames" in (friction_question(0.00001) or "")
    assert "above that of curling ice" in (friction_question(0.2) or "")
    assert "2 times faster" in (friction_question(0.04) or "")


def test_a_stone_that_hardly_moves_is_no_evidence():
    track = slide(0.009)
    short = Trajectory(t=track.t[:30], xy=track.xy[:30])
    assert np.isnan(rough_friction(short))
    assert friction_question(np.nan) is None
