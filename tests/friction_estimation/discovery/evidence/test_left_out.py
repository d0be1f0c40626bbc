"""Scores of throws left out: against a covariance written out, and of models side by side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.discovery import (
    SessionNoise,
    base_model,
    candidates,
    fit,
    left_out_scores,
    linearise,
    refit,
    sensitivities,
    unseen_scores,
)
from friction_estimation.discovery.evidence.posterior import throw_constants
from friction_estimation.discovery.evidence.significance import broad_prior
from friction_estimation.discovery.tuning import COUPLING_SIGMA, RELEASE_SIGMA

WHITE = SessionNoise(white=(0.004, 0.004, 0.02), fading=(0.0, 0.0, 0.0), memory=(0.1, 0.1, 0.1))


def densities(fitted):
    """Ln of the density of every throw under the fit to all the others."""
    return -0.5 * (left_out_scores(fitted) + throw_constants(fitted))


def test_the_density_of_a_throw_given_the_others_is_that_of_their_joint_gaussian(curl_fit):
    spread = 0.01
    fitted = curl_fit(throws=4, scatter=0.01)
    model, session, states = replace(fitted.model, spread=spread), fitted.session, fitted.states
    factors = np.zeros(len(session))
    linear = linearise(model, session, WHITE, states, factors)[1]
    fitted = replace(fitted, noise=WHITE, linear=linear)
    found = densities(fitted)[3]

    # All rows of all throws together; every unknown is Gaussian and integrated out.
    predicted, columns = sensitivities(model, session, states, factors)
    residual = (session.observed - predicted[:, [0, 1, 4]]).ravel()
    owner = np.repeat(session.owner, 3)
    precision = broad_prior(model)[:-1, :-1].copy()
    precision[1, 1] += COUPLING_SIGMA**-2
    mean = np.zeros(len(precision))
    mean[1] = -model.ln_coupling * COUPLING_SIGMA**-2 / precision[1, 1]
    shared = columns[:, :, 7:].reshape(-1, len(precision))
    own = columns[:, :, :7].reshape(-1, 7) * [*RELEASE_SIGMA, spread]
    covariance = shared @ np.linalg.inv(precision) @ shared.T
    covariance += np.where(owner[:, None] == owner, own @ own.T, 0.0)
    covariance += np.diag((np.array(WHITE.white) * session.sigma[:, [0, 0, 1]]).ravel() ** 2)
    residual = residual - shared @ mean

    def log_density(rows):
        part, value = covariance[np.ix_(rows, rows)], residual[rows]
        least = value @ np.linalg.solve(part, value)
        return -0.5 * (least + np.linalg.slogdet(part)[1] + rows.sum() * np.log(2 * np.pi))

    joint, others = log_density(owner >= 0), log_density(owner != 3)
    assert found == pytest.approx(joint - others, abs=0.2)


def test_the_model_that_the_ice_has_is_best_and_needless_terms_are_not_clearly_better(curl_fit):
    fitted = curl_fit(throws=12, scatter=0.005)
    with_more = {
        term.label: refit(fitted, fitted.model.with_terms(term))
        for term in candidates(fitted.session, fitted.model.terms)
        if term.label in ("slope", "spin_drag", "time_drift", "stone_bias[1]")
    }
    without = refit(fitted, base_model(None, fitted.session))
    fits = {"none": without, "curl": fitted, **with_more}
    scores = {name: float(densities(each).sum()) for name, each in fits.items()}
    assert scores["none"] < scores["curl"] - 1000
    assert min(scores, key=scores.__getitem__) == "none"
    for label in with_more:
        assert scores[label] - scores["curl"] < 3.0, label


def test_a_throw_that_was_not_seen_scores_as_one_that_is_left_out(curl_fit):
    fitted = curl_fit(throws=6, scatter=0.01)
    others = fitted.session.only(np.arange(5))
    model, noise = fitted.model, fitted.noise
    start = {"states": fitted.states[:5], "ln_factors": fitted.ln_factors[:5]}
    part = fit(model, others, noise, **start, shared=False)
    unseen = unseen_scores(part, fitted.session.only(np.array([5])))
    assert unseen == pytest.approx(left_out_scores(fitted)[5:], abs=0.5)


def test_a_parameter_of_which_one_throw_alone_tells_does_not_break_the_comparison(curl_fit):
    fitted = curl_fit(throws=9)
    stones = np.arange(9) % 2
    stones[4] = 7
    session = replace(fitted.session, stones=stones)
    bias = next(
        t for t in candidates(replace(session, stones=stones), fitted.model.terms)
        if t.name == "stone_bias"
    ).with_values(stone=7.0)  # fmt: skip
    alone = refit(replace(fitted, session=session), fitted.model.with_terms(bias))
    found = densities(alone)
    assert np.isfinite(found).all()
    others = np.arange(9) != 4
    assert found[others] == pytest.approx(densities(fitted)[others], abs=3.0)
