"""The normal equations against Gaussian conditioning written out with every unknown in it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.sheet import Sheet
from friction_estimation.inversion.friction.posterior import Hyperparameters, NormalEquations
from friction_estimation.inversion.throw.camera_bias import bias_root
from friction_estimation.inversion.tuning import (
    LEVEL_PRIOR_SD,
    LOG_LENGTH_SD,
    LOG_SPREAD_SD,
    USUAL_CAMERA_BIAS,
    USUAL_CAMERA_BIAS_LENGTH,
    USUAL_LENGTH,
    USUAL_SCATTER,
    USUAL_SPREAD,
)

SHEET = Sheet(cell_size=2.0)
CELLS = SHEET.shape[0] * SHEET.shape[1]
CROSSED, THROWS, EFFECTS, ROWS = np.arange(7, 57, 3), 4, 2, 25
NODES = np.linspace(-8.0, 8.0, 7)
HYPER = Hyperparameters(
    spread=0.05, length=4.0, scatter=0.01, smoothness=2.5, bias_sd=0.004, bias_length=2.0
)
OVER = np.isin(np.arange(CELLS), CROSSED[3:9])


def correlation(distance, length, smoothness):
    if smoothness == np.inf:
        return np.exp(-(distance**2) / (2 * length**2))
    r = np.sqrt(2 * smoothness) * distance / length
    return (1 + r + (r**2 / 3 if smoothness == 2.5 else 0)) * np.exp(-r)


@pytest.fixture(
    params=[HYPER, Hyperparameters(spread=0.1, length=6.0, scatter=0.0, smoothness=1.5)]
)
def problem(request, rng):
    """Random clear data, the equations made of them, and the Gaussians they stand for."""
    hyper, m = request.param, len(CROSSED)
    size = m + THROWS + EFFECTS + len(NODES)
    design = rng.normal(size=(ROWS, size)) * 80.0
    design[:, m + THROWS : m + THROWS + EFFECTS] *= 0.05
    design[:, m + THROWS + EFFECTS :] *= 20.0
    data = rng.normal(size=ROWS) * 3
    prior_mean, prior_sd = 0.02 * rng.normal(size=CELLS), rng.uniform(0.0, 0.03, CELLS)
    equations = NormalEquations(
        design.T @ design, design.T @ data, CROSSED, SHEET, prior_mean=prior_mean,
        prior_sd=prior_sd, effects=EFFECTS, nodes=NODES, square=float(data @ data),
    )  # fmt: skip
    x, y = np.meshgrid(SHEET.x_centres, SHEET.y_centres)
    places = np.column_stack([x.ravel(), y.ravel()])
    apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    field = correlation(apart, hyper.length, hyper.smoothness)
    field = field * (hyper.spread**2 + np.outer(prior_sd, prior_sd)) + LEVEL_PRIOR_SD**2
    whole = np.zeros((ROWS, CELLS + size - m))
    whole[:, CROSSED] = design[:, :m]
    whole[:, CELLS:] = design[:, m:]
    prior = np.zeros((whole.shape[1], whole.shape[1]))
    prior[:CELLS, :CELLS] = field
    at = CELLS
    for count, block in (
        (THROWS, hyper.scatter**2 * np.eye(THROWS)),
        (EFFECTS, np.eye(EFFECTS)),
        (len(NODES), hyper.bias_sd**2 * bias_root(NODES, hyper.bias_length)
         @ bias_root(NODES, hyper.bias_length).T),
    ):  # fmt: skip
        prior[at : at + count, at : at + count] = block
        at += count
    mean = np.zeros(whole.shape[1])
    mean[:CELLS] = prior_mean
    return SimpleNamespace(
        hyper=hyper, equations=equations, design=design, data=data, whole=whole, prior=prior,
        mean=mean, m=m,
    )  # fmt: skip


def conditioned(p):
    spread = np.eye(ROWS) + p.whole @ p.prior @ p.whole.T
    gain = p.prior @ p.whole.T @ np.linalg.inv(spread)
    mean = p.mean + gain @ (p.data - p.whole @ p.mean)
    return spread, mean, p.prior - gain @ p.whole @ p.prior


def test_the_posterior_is_gaussian_conditioning(problem):
    found = problem.equations.posterior(problem.hyper, OVER)
    _, mean, covariance = conditioned(problem)
    sigma = np.sqrt(np.diag(covariance))
    offsets = slice(CELLS, CELLS + THROWS)
    effects = slice(offsets.stop, offsets.stop + EFFECTS)
    bias = slice(effects.stop, None)
    assert found.field == pytest.approx(mean[:CELLS], abs=1e-6)
    assert found.field_sigma == pytest.approx(sigma[:CELLS], rel=1e-5)
    assert found.offsets == pytest.approx(mean[offsets], abs=1e-6)
    assert found.effects == pytest.approx(mean[effects], abs=1e-6)
    assert found.effects_sigma == pytest.approx(sigma[effects], rel=1e-5)
    assert found.bias == pytest.approx(mean[bias], abs=1e-7)
    assert found.bias_sigma == pytest.approx(sigma[bias], rel=1e-4, abs=1e-9)
    assert found.level == pytest.approx(mean[:CELLS][OVER].mean(), abs=1e-6)
    part = covariance[:CELLS, :CELLS][np.ix_(OVER, OVER)]
    assert found.level_sigma == pytest.approx(np.sqrt(part.mean()), rel=1e-4)
    # Independent numbers that the data determine, those of the camera's bias left out.
    gained = np.linalg.solve(np.eye(ROWS) + problem.whole @ problem.prior @ problem.whole.T,
                             problem.whole) @ problem.prior  # fmt: skip
    each = (gained * problem.whole).sum(axis=0)
    assert found.resolved == pytest.approx(each.sum() - each[bias].sum(), rel=1e-4)


def test_the_evidence_is_that_of_the_data(problem):
    spread, _, _ = conditioned(problem)
    hyper = problem.hyper
    beyond = problem.data - problem.whole @ problem.mean
    expected = beyond @ np.linalg.solve(spread, beyond) + np.linalg.slogdet(spread)[1]
    expected += (np.log(hyper.spread / USUAL_SPREAD) / LOG_SPREAD_SD) ** 2
    expected += (np.log(hyper.length / USUAL_LENGTH) / LOG_LENGTH_SD) ** 2
    expected += 2 * np.log(1 + (hyper.scatter / USUAL_SCATTER) ** 2)
    expected += 2 * np.log(1 + (hyper.bias_sd / USUAL_CAMERA_BIAS) ** 2)
    expected += (np.log(hyper.bias_length / USUAL_CAMERA_BIAS_LENGTH) / LOG_LENGTH_SD) ** 2
    found = problem.equations.minus_two_log_evidence(hyper) + problem.equations.constant
    assert found == pytest.approx(expected, rel=1e-6)


def test_effects_can_be_fixed_and_the_bias_integrated_out(problem, rng):
    effects = np.array([0.3, -0.7])
    errors = rng.normal(size=(ROWS, 3))
    m, hyper = problem.m, problem.hyper
    friction, acting = slice(m + THROWS), slice(m + THROWS, m + THROWS + EFFECTS)
    matrix, vector, systematic = problem.equations.without_effects(
        effects, hyper, problem.design.T @ errors
    )
    root = hyper.bias_sd * bias_root(NODES, hyper.bias_length)
    seen = problem.design[:, acting.stop :] @ root
    weight = np.linalg.inv(np.eye(ROWS) + seen @ seen.T)
    own = problem.design[:, friction]
    left = problem.data - problem.design[:, acting] @ effects
    assert matrix == pytest.approx(own.T @ weight @ own, rel=1e-5, abs=1e-3)
    assert vector == pytest.approx(own.T @ weight @ left, rel=1e-5, abs=1e-3)
    assert systematic == pytest.approx(own.T @ weight @ errors, rel=1e-5, abs=1e-3)
    assert problem.equations.without_effects(effects, hyper)[2] is None


def test_what_all_throws_err_by_together_widens_the_errors(problem, rng):
    errors = 0.5 * rng.normal(size=(ROWS, 2))
    plain = problem.equations.posterior(problem.hyper, OVER)
    wider = problem.equations.with_systematic_error(plain, problem.design.T @ errors, OVER)
    spread, _, covariance = conditioned(problem)
    moved = problem.prior @ problem.whole.T @ np.linalg.solve(spread, errors)
    total = np.sqrt(np.diag(covariance) + (moved**2).sum(axis=1))
    effects = slice(CELLS + THROWS, CELLS + THROWS + EFFECTS)
    assert wider.field_sigma == pytest.approx(total[:CELLS], rel=1e-4)
    assert wider.effects_sigma == pytest.approx(total[effects], rel=1e-4)
    level = moved[:CELLS][OVER].mean(axis=0)
    assert wider.level_sigma == pytest.approx(
        np.hypot(plain.level_sigma, np.linalg.norm(level)), rel=1e-4
    )
    assert wider.field == pytest.approx(plain.field)


def test_hyperparameters_climb_to_the_greatest_evidence(problem):
    start = problem.hyper
    scatter = start.scatter > 0
    best = problem.equations.optimise_hyperparameters(start, scatter=scatter)
    evidence = problem.equations.minus_two_log_evidence
    assert evidence(best) <= evidence(start)
    assert best.smoothness == start.smoothness
    assert (best.scatter > 0) is scatter
    assert (best.bias_sd > 0) is (start.bias_sd > 0)
    assert 1e-3 <= best.spread <= 0.5
    assert 0.4 <= best.length <= 20.0
