"""Releases and the frictions of single throws are eliminated as if they had been fitted beside."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery import base_model
from friction_estimation.discovery.model.linearisation import _believed, eliminate_factor
from friction_estimation.discovery.model.minimum import minimum_of, project_out, scaled_root
from friction_estimation.discovery.model.quadratic import bounded_step, profile_spread
from friction_estimation.discovery.tuning import LEAST_SPREAD, RELEASE_SIGMA

THROWS, ROWS, SHARED = 5, 40, 2


@pytest.fixture
def problem(rng):
    """Columns of each throw, (throws, rows, 6 states + factor + shared + residual)."""
    columns = rng.normal(size=(THROWS, ROWS, 6 + 1 + SHARED + 1))
    return columns, np.einsum("kni,knj->kij", columns, columns)


def least_squares(columns, ln_factors, spread, shared_prior):
    """F and the best shared step by one large least-squares problem with every unknown in it."""
    own = 7 if spread > 0 else 6
    size = THROWS * own + SHARED
    rows, right = [], []
    for k, block in enumerate(columns):
        part = np.zeros((ROWS, size))
        part[:, k * own : k * own + own] = block[:, :own]
        part[:, -SHARED:] = block[:, 7:-1]
        rows.append(part)
        # Without a spread the factor is one: its present deviation is undone.
        right.append(block[:, -1] + (0.0 if spread > 0 else ln_factors[k]) * block[:, 6])
        weak = np.zeros((6, size))
        weak[:, k * own : k * own + 6] = np.diag(1.0 / RELEASE_SIGMA)
        rows.append(weak)
        right.append(np.zeros(6))
        if spread > 0:
            pull = np.zeros((1, size))
            pull[0, k * own + 6] = 1.0 / spread
            rows.append(pull)
            right.append(np.array([-ln_factors[k] / spread]))
    weak = np.zeros((SHARED, size))
    weak[:, -SHARED:] = np.diag(np.sqrt(shared_prior))
    matrix, target = np.vstack([*rows, weak]), np.concatenate([*right, np.zeros(SHARED)])
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return solution[-SHARED:], float(((target - matrix @ solution) ** 2).sum())


@pytest.mark.parametrize("spread", [0.0, 0.01, 0.7])
def test_elimination_gives_what_one_large_fit_gives(problem, spread, rng):
    columns, grams = problem
    ln_factors = 0.3 * rng.normal(size=THROWS)
    prior = np.diag([4.0, 0.25, 0.0])
    reduced = project_out(_believed(grams), 6)
    left, log_terms = eliminate_factor(reduced, ln_factors, spread)
    found = minimum_of(left.sum(axis=0) + prior)
    expected, minimum = least_squares(columns, ln_factors, spread, np.array([4.0, 0.25]))
    assert found.step == pytest.approx(expected, rel=1e-6)
    assert float(found.value) == pytest.approx(minimum, rel=1e-8)
    # h is the information of a throw about its own friction, its release being free.
    for k, block in enumerate(columns):
        weak = np.vstack([block[:, :6], np.diag(1.0 / RELEASE_SIGMA)])
        factor = np.append(block[:, 6], np.zeros(6))
        rest = factor - weak @ np.linalg.lstsq(weak, factor, rcond=None)[0]
        assert log_terms[k] == pytest.approx(np.log1p(spread**2 * (rest @ rest)), abs=1e-9)


def test_the_spread_is_where_its_likelihood_is_greatest(problem, rng):
    _, grams = problem
    reduced = project_out(_believed(grams), 6)
    ln_factors = 0.1 * rng.normal(size=THROWS)
    prior = np.diag([1.0, 1.0, 0.0])
    spread, value = profile_spread(reduced, ln_factors, prior)

    def deviance(tau: float) -> float:
        left, log_terms = eliminate_factor(reduced, ln_factors, tau)
        return float(minimum_of(left.sum(axis=0) + prior).value) + float(log_terms.sum())

    assert value == pytest.approx(deviance(spread))
    assert value <= min(deviance(t) for t in np.geomspace(LEAST_SPREAD, 0.3, 200)) + 1e-3


def test_a_step_stops_at_a_bound_and_the_rest_adapts(make_session):
    from friction_estimation.discovery import open_session

    model = base_model(None, open_session(make_session(throws=3)))
    model = model.at(np.array([0.0, 0.0]))
    low, high = model.bounds
    # ln_coupling would go to 3 and may go to 1; ln_mu then goes where that leaves the least.
    inner = np.array([[2.0, 0.8], [0.8, 1.0]])
    wanted = np.array([-0.5, 3.0])
    total = np.zeros((3, 3))
    total[:2, :2] = inner
    total[:2, 2] = total[2, :2] = inner @ wanted
    total[2, 2] = 100.0
    assert (low[1], high[1]) == (-1.0, 1.0)
    step = bounded_step(total, minimum_of(total).step, model)
    assert step == pytest.approx([-0.5 + 0.8 * (3.0 - 1.0) / 2.0, 1.0])
    inside = np.array([0.1, -0.2])
    total[:2, 2] = total[2, :2] = inner @ inside
    assert bounded_step(total, minimum_of(total).step, model) == pytest.approx(inside)


@pytest.mark.parametrize("lost", [1e-12, 1e-9, 1e-7, 1e-4])
def test_a_matrix_that_rounding_left_without_a_root_has_that_of_one_nearby(lost):
    """No further away than a dozen times what it lacks."""
    units = np.array([1e-3, 10.0])
    lacking = np.array([[1.0, 1.0 + lost], [1.0 + lost, 1.0]])
    root, scale = scaled_root(lacking / np.outer(units, units))
    assert scale == pytest.approx(units)
    assert np.abs(root @ root.T - lacking).max() <= max(12 * lost, 1e-10) * (1 + 1e-3)
    assert np.isfinite(np.linalg.inv(root)).all()


def test_what_is_far_from_any_root_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        scaled_root(np.array([[1.0, 1.1], [1.1, 1.0]]))
