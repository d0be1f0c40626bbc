"""A standard error is the half-width of 95 % of the mixture over all spreads, over 1.96."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from friction_estimation.discovery.evidence.intervals import _half_widths


def test_one_gaussian_has_its_own_standard_deviation():
    widths = _half_widths(np.ones(1), np.zeros((1, 2)), np.array([[0.3, 2.0]]))
    assert widths == pytest.approx([0.3, 2.0], rel=1e-9)


def test_a_mixture_holds_95_per_cent():
    weights = np.array([0.5, 0.3, 0.2])
    steps, deviations = np.array([[0.0], [0.4], [-1.0]]), np.array([[0.5], [1.0], [0.2]])
    half = 1.959964 * _half_widths(weights, steps, deviations)[0]
    inside = norm.cdf((half - steps) / deviations) - norm.cdf((-half - steps) / deviations)
    assert float(weights @ inside[:, 0]) == pytest.approx(0.95, abs=1e-6)
