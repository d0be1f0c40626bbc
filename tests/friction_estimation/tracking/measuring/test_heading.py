"""The heading that pictures of a handle agree on, and where they show none."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.tracking.measuring.heading import HeadingViews, fit_heading_curve

ANGLES = np.linspace(-np.pi, np.pi, 48, endpoint=False)
T = np.arange(0.0, 25.0, 0.4)
SPEED = np.clip(2.2 - 0.09 * T, 0.0, None)


def views(true, front, ends, noise, seed):
    """Pictures of a handle whose front and whose ends cost this much where they are misplaced."""
    rng = np.random.default_rng(seed)
    found = HeadingViews()
    for t, theta in zip(T, true, strict=True):
        cost = front * (1 - np.cos(ANGLES - theta)) + ends * (1 - np.cos(2 * (ANGLES - theta)))
        for wave in (1, 2, 3):
            phase = rng.uniform(0, 2 * np.pi)
            cost = cost + noise * rng.normal() / wave * np.cos(wave * ANGLES - phase)
        found.add(float(t), cost)
    return found


@pytest.mark.parametrize("spin", [0.0, 0.25, 1.2])
@pytest.mark.parametrize("seed", range(3))
def test_a_clear_handle_shows_its_heading(spin, seed):
    true = 0.2 + spin * T
    curve = fit_heading_curve(views(true, 8, 8, 3, seed), T, SPEED)
    assert curve is not None
    assert np.sqrt(np.mean(np.angle(np.exp(1j * (curve.at(T) - true))) ** 2)) < 0.3


@pytest.mark.parametrize("seed", range(4))
def test_pictures_without_a_handle_show_no_heading(seed):
    assert fit_heading_curve(views(0 * T, 0, 0, 4, seed), T, SPEED) is None


@pytest.mark.parametrize("seed", range(4))
def test_faint_shade_that_wanders_is_no_heading(seed):
    wanders = -0.5 - 2.1 * T / 25
    assert fit_heading_curve(views(wanders, 1.2, 0, 3, seed), T, SPEED) is None
