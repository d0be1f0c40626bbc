"""The paper's method: each window of a track gives a μ, and each cell averages its windows."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from friction_estimation.estimation import average_cells
from friction_estimation.tracks import FreeSlide

G, MU = 9.80665, 0.008


def braked(mu: float, x: float = 0.1, speed: float = 2.0, fps: float = 30.0) -> FreeSlide:
    """A slide with even deceleration along the sheet."""
    t = np.arange(0.0, 12.0, 1 / fps)
    y = -10.0 + speed * t - 0.5 * mu * G * t**2
    track = Trajectory(t=t, xy=np.column_stack([np.full(len(t), x), y]))
    return FreeSlide(
        track=track,
        rows=np.arange(len(t)),
        stretch=(0, len(t)),
        rests=False,
        wild=0,
        noise=1e-4,
    )


def test_even_deceleration_is_its_friction_in_every_cell_crossed():
    start = Ice.uniform(0.01, effects=(ActiveEffect(name="slope", parameters={"x": 1e-4}),))
    ice, mu, _ = average_cells([braked(MU)], start)
    assert mu == pytest.approx(MU, rel=1e-6)
    assert ice.effects == ()
    observed = ice.friction.observed
    rows, columns = np.nonzero(observed)
    assert set(columns.tolist()) == {4}
    whole = braked(MU).xy[15:-15, 1]
    inside = PAPER_SHEET.cell_of([[0.1, whole[0]], [0.1, whole[-1]]])[0]
    assert (rows.min(), rows.max()) == tuple(inside)
    assert (np.diff(rows) == 1).all()
    assert ice.friction.mu == pytest.approx(MU, rel=1e-6)  # elsewhere the average of all


def test_a_cell_averages_all_values_obtained_in_it():
    light, heavy = braked(0.006, x=0.1), braked(0.010, x=0.1)
    ice, mu, _ = average_cells([light, heavy], Ice.uniform(0.01))
    assert mu == pytest.approx(0.008, rel=1e-6)
    row, column = (int(k[0]) for k in PAPER_SHEET.cell_of([[0.1, -5.0]]))
    inside = [
        int(((s.xy[15:-15, 1] >= -5.25) & (s.xy[15:-15, 1] < -4.75)).sum()) for s in (light, heavy)
    ]
    expected = (0.006 * inside[0] + 0.010 * inside[1]) / sum(inside)
    assert ice.friction.mu[row, column] == pytest.approx(expected, rel=1e-6)
    # The standard error of a cell goes by the windows in it, thirty rows each.
    sigma = ice.friction.sigma
    assert sigma[row, column] == pytest.approx(0.002 / np.sqrt(sum(inside) / 30), rel=1e-3)
    assert sigma[0, 0] == pytest.approx(0.002, rel=1e-3)


def test_one_friction_is_the_average_with_the_spread_of_throws():
    ice, mu, sigma = average_cells(
        [braked(mu) for mu in (0.007, 0.008, 0.009)], Ice.uniform(0.01), uniform=True
    )
    assert mu == pytest.approx(0.008, rel=1e-6)
    assert sigma == pytest.approx(0.001 / np.sqrt(3), rel=1e-3)
    assert ice.friction.is_uniform
    assert ice.friction.mu[0, 0] == pytest.approx(0.008, rel=1e-6)
    assert ice.friction.sigma[0, 0] == pytest.approx(sigma)


def test_a_single_throw_is_as_uncertain_as_the_speeds_at_its_ends():
    sigma = average_cells([braked(MU)], Ice.uniform(0.01), uniform=True)[2]
    assert 0 < sigma < 1e-4


def test_friction_is_never_negative():
    ice, mu, _ = average_cells([braked(-0.002)], Ice.uniform(0.01))
    assert mu == pytest.approx(-0.002, rel=1e-6)
    assert ice.friction.mu.min() == 1e-4
    even = average_cells([braked(-0.002)], Ice.uniform(0.01), uniform=True)[0]
    assert even.friction.mu[0, 0] == pytest.approx(1e-4)


def test_a_track_shorter_than_a_window_is_used_whole():
    slide = braked(MU)
    short = FreeSlide(
        track=slide.track,
        rows=np.arange(20),
        stretch=(0, 20),
        rests=False,
        wild=0,
        noise=1e-4,
    )
    assert average_cells([short], Ice.uniform(0.01))[1] == pytest.approx(MU, rel=1e-6)
