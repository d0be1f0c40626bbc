"""One friction for all throws, with the scatter between them integrated out."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.inversion.friction.uniform_fit import uniform_posterior
from friction_estimation.inversion.tuning import USUAL_SCATTER

OWN = np.array([-4.70, -4.72, -4.69, -4.705, -4.71])
SIGMA = np.array([0.004, 0.006, 0.003, 0.005, 0.002])


def test_without_scatter_it_is_the_weighted_mean():
    weight = SIGMA**-2.0
    mean, sigma, scatter = uniform_posterior(weight, weight * OWN, scatter=False)
    assert mean == pytest.approx((weight @ OWN) / weight.sum())
    assert sigma == pytest.approx(weight.sum() ** -0.5)
    assert scatter == 0.0
    # It takes three throws to see that they differ.
    two = uniform_posterior(weight[:2], (weight * OWN)[:2], scatter=True)
    assert two == uniform_posterior(weight[:2], (weight * OWN)[:2], scatter=False)
    assert uniform_posterior(weight[:3], (weight * OWN)[:3], scatter=True)[2] > 0


@pytest.mark.parametrize("widen", [1.0, 4.0])
def test_with_scatter_it_is_the_integral_over_mean_and_scatter(widen):
    own = OWN.mean() + widen * (OWN - OWN.mean())
    weight = SIGMA**-2.0
    found = uniform_posterior(weight, weight * own, scatter=True)
    level = np.linspace(own.mean() - 0.15, own.mean() + 0.15, 1201)
    spread = np.linspace(0.0, 0.2, 1601)
    variance = SIGMA**2 + spread[:, None] ** 2
    log = -np.log1p((spread / USUAL_SCATTER) ** 2)[:, None] * np.ones(len(level))
    for k in range(len(own)):
        log += -0.5 * np.log(variance[:, k])[:, None]
        log += -0.5 * (own[k] - level) ** 2 / variance[:, k][:, None]
    share = np.exp(log - log.max())
    share /= share.sum()
    mean = float((share * level).sum())
    assert found[0] == pytest.approx(mean, abs=2e-5)
    assert found[1] == pytest.approx(float(np.sqrt((share * (level - mean) ** 2).sum())), rel=0.02)
    assert found[2] == pytest.approx(float((share * spread[:, None]).sum()), rel=0.05)
