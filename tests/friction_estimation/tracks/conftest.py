"""Fixtures for the tests of tracks."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.trajectory import Trajectory

A = 0.09
HOG = 10.9725


def stone_on_film(
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


@pytest.fixture(scope="session")
def filmed():
    """Return a function that makes the track of a filmed stone, and the time of its release."""
    return stone_on_film
