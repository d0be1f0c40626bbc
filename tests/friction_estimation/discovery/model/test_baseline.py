"""The friction from which a fit begins."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.discovery import first_friction, open_session


def slide(mu, seconds, *, speed=2.0, throw=0):
    """A straight slide by the school's formula, smoothed and with a claimed error, as from film."""
    t = np.arange(0.0, seconds, 0.05)
    y = -8.0 + speed * t - 0.5 * mu * 9.81 * t**2
    xy = np.column_stack([np.zeros_like(t), y])
    return Trajectory(t=t, xy=xy, sigma_xy=np.full(len(t), 0.004), throw=throw)


@pytest.mark.parametrize("seconds", [3.0, 6.0])
def test_a_short_slide_of_a_film_tells_the_friction(seconds):
    """Few rows of a smoothed track are kept: eight of a slide of three seconds."""
    session = open_session([slide(0.02, seconds)])
    assert session.smoothed
    assert len(session.times) <= 20
    assert first_friction(session) == pytest.approx(0.02, rel=0.05)


def test_a_slide_much_shorter_than_others_does_not_count():
    tracks = [slide(0.02, 8.0), slide(0.04, 2.0, throw=1), slide(0.04, 2.0, throw=2)]
    assert first_friction(open_session(tracks)) == pytest.approx(0.02, rel=0.05)
