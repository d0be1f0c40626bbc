"""The slow shapes in which residuals show what a model lacks."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery.search.residuals import slow_columns
from friction_estimation.discovery.tuning import SLOWEST_NOISE_PERIOD


def test_slow_shapes_are_cosines_down_to_the_slowest_noise():
    t = 3.0 + np.arange(0, 20.001, 1 / 15)
    shapes = slow_columns(t)
    assert shapes.shape == (len(t), int(2 * 20 / SLOWEST_NOISE_PERIOD))
    for k in (1, 5, shapes.shape[1]):
        assert shapes[:, k - 1] == pytest.approx(np.cos(np.pi * k * (t - 3.0) / (t[-1] - 3.0)))


@pytest.mark.parametrize(("rows", "count"), [(24, 4), (8, 2), (2, 2)])
def test_few_rows_show_few_shapes(rows, count):
    assert slow_columns(np.linspace(0, 30, rows)).shape == (rows, count)
