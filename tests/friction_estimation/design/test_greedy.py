"""Variance removed by a throw, compared with the textbook's update."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.design import (
    Informative,
    covariance_after,
    first_of_best,
    variance_removed,
)


def test_a_measurement_updates_a_covariance_as_information_adds():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T + np.eye(6)
    touched, rows = np.array([0, 2, 5]), rng.normal(size=(4, 3))
    throw = Informative(touched, rows)
    whole = np.zeros((4, 6))
    whole[:, touched] = rows
    after = np.linalg.inv(np.linalg.inv(covariance) + whole.T @ whole)
    assert covariance_after(covariance, throw) == pytest.approx(after)
    fall = np.diag(covariance) - np.diag(after)
    counted, weights = np.array([1, 2]), np.array([3.0, 0.5])
    assert variance_removed(covariance, throw, np.arange(6)) == pytest.approx(fall.sum())
    weighted = variance_removed(covariance, throw, counted, weights)
    assert weighted == pytest.approx(float(weights @ fall[counted]))


def test_of_gains_that_differ_by_rounding_the_first_is_best():
    assert first_of_best([1.0, 3.0, 3.0 * (1 + 1e-12), 2.0]) == 1
    assert first_of_best([1.0, 3.0, 3.0 * (1 + 1e-6), 2.0]) == 2
