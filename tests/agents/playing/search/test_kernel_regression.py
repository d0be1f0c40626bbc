"""Value of a throw, from all simulations near it."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing.search.kernel_regression import estimate
from curling_env.throw import Skill


def test_kernel_regression_finds_the_mean_of_a_known_worth():
    """Worth is a parabola of the speed, so its mean under the error is known: -(v² + σ²)."""
    rng = np.random.default_rng(0)
    sigma = np.array([0.1, 0.01, 0.1])
    tried = np.array([[v, 0.0, 1.5] for v in (-0.2, -0.1, 0.0, 0.1, 0.2)])
    often = np.full(5, 400.0)
    executed = (tried[:, None] + rng.standard_normal((5, 400, 3)) * sigma).reshape(-1, 3)
    worth = -(executed[:, 0] ** 2)
    asked = np.concatenate([tried, [[0.05, 0.0, 1.5]]])  # the last one was never tried
    mean, error = estimate(asked, tried, often, executed, worth, sigma)
    truth = -(asked[:, 0] ** 2 + sigma[0] ** 2)
    assert np.all(np.abs(mean - truth) < 4 * error)
    assert error.max() < 0.003
    alone = executed[:400], worth[:400]
    _, by_itself = estimate(tried[:1], tried[:1], often[:1], *alone, sigma)
    assert error[2] < by_itself[0] * 1.5


@pytest.mark.parametrize("tails", [3.0, np.inf])
def test_nearby_throws_are_evidence_on_a_throw_also_with_tails_and_a_correlation(tails):
    skill = Skill(name="own", sigma_speed=0.02, sigma_angle=0.003, sigma_spin=0.1, tails=tails,
                  correlation=0.7)  # fmt: skip
    sigma = np.array([0.02, 0.003, 0.1])
    tried = np.array([[2.0, 0.0, 1.5], [2.02, 0.002, 1.5], [1.98, -0.003, 1.5]])
    rng, often = np.random.default_rng(8), np.full(3, 3000.0)
    errors = np.array([skill.standard_errors(3000, rng) for _ in tried]) * sigma
    executed = (tried[:, None] + errors).reshape(-1, 3)

    def made(throws):  # needs speed and line together, as a throw behind a guard does
        speed, angle = ((throws[:, :2] - tried[0, :2]) / sigma[:2]).T
        return ((np.abs(speed) < 1) & (np.abs(angle) < 0.5)).astype(float)

    asked = np.concatenate([tried, [[2.01, 0.001, 1.5]]])
    mean, error = estimate(
        asked, tried, often, executed, made(executed), sigma, tails=tails, correlation=0.7
    )
    many = skill.standard_errors(100_000, rng) * sigma
    truth = np.array([made(one + many).mean() for one in asked])
    assert np.abs(mean - truth).max() < 0.015
    assert np.all(np.abs(mean - truth) < 4 * error)


def test_handles_are_independent():
    tried = np.array([[2.0, 0.0, 1.5], [2.0, 0.0, -1.5]])
    executed = np.repeat(tried, 10, axis=0)
    worth = np.repeat([0.2, 0.8], 10)
    mean, _ = estimate(tried, tried, np.full(2, 10.0), executed, worth, np.array([0.1, 0.1, 0.1]))
    np.testing.assert_allclose(mean, [0.2, 0.8], atol=1e-6)
