"""The posterior of the shared parameters: Gaussians, and their weights over the spread."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery.evidence.intervals import weights_of, widths
from friction_estimation.discovery.model.minimum import minimum_of


def test_a_spread_stands_for_the_axis_half_way_to_its_neighbours():
    assert widths(np.array([0.0, 1.0, 3.0])) == pytest.approx([0.5, 1.5, 1.0])
    assert widths(np.array([0.2])) == pytest.approx([1.0])


def test_a_quadratic_is_the_gaussian_of_least_squares():
    rng = np.random.default_rng(2)
    columns, values = rng.normal(size=(30, 4)) * [1.0, 1e-3, 1e3, 5.0], rng.normal(size=30)
    whole = np.column_stack([columns, values])
    found = minimum_of(whole.T @ whole)
    best, least, *_ = np.linalg.lstsq(columns, values)
    assert found.step == pytest.approx(best, rel=1e-6)
    information = columns.T @ columns
    assert found.covariance == pytest.approx(np.linalg.inv(information), rel=1e-6)
    level = float(least[0]) + np.linalg.slogdet(information)[1]
    assert float(found.level) == pytest.approx(level, rel=1e-6)


def test_of_what_no_throw_feels_the_error_is_huge_and_the_rest_as_it_was():
    rng = np.random.default_rng(4)
    whole = rng.normal(size=(20, 4))
    whole[:, 1] = 0.0
    known = whole[:, [0, 2, 3]]
    felt, found = minimum_of(known.T @ known), minimum_of(whole.T @ whole)
    others = np.ix_([0, 2], [0, 2])
    assert np.isfinite(found.covariance).all()
    assert found.covariance[1, 1] > 1e50
    assert found.covariance[others] == pytest.approx(felt.covariance, rel=1e-6)


def test_many_at_once_are_as_each_alone():
    rng = np.random.default_rng(3)
    wholes = rng.normal(size=(5, 20, 4)) * [1.0, 1e-3, 10.0, 1.0]
    totals = np.swapaxes(wholes, 1, 2) @ wholes
    found, alone = minimum_of(totals), minimum_of(totals[3])
    assert found.level[3] == pytest.approx(float(alone.level), rel=1e-9)
    assert found.step[3] == pytest.approx(alone.step)
    assert found.covariance[3] == pytest.approx(alone.covariance)


def test_weights_count_likelihood_and_the_part_of_the_axis():
    weights = weights_of(np.array([0.0, 2.0 * np.log(2.0), 0.0]), np.array([0.0, 1.0, 3.0]))
    assert weights == pytest.approx(np.array([0.5, 0.75, 1.0]) / 2.25)
    assert weights_of(np.array([0.0, 50.0]), np.array([0.0, 1.0])) == pytest.approx(
        [1, 0], abs=1e-9
    )
