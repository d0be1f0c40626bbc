"""Tests of whether the throws' frictions follow a variable or differ by chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import pearsonr, ttest_1samp

from curling_env.physics import catalogue
from friction_estimation.discovery import (
    Term,
    base_model,
    fit_with_noise,
    friction_structure,
    neutral_values,
    open_session,
    own_frictions,
    p_of_mean,
    refit,
    strongest_correlation,
)
from friction_estimation.discovery.evidence.significance import (
    own_values,
    throw_covariates,
)

from ..conftest import effect


@pytest.fixture
def fitted_to(make_session):
    def make(*effects, **options):
        session = open_session(make_session(effects, **options))
        return fit_with_noise(base_model(None, session), session)

    return make


def test_the_chance_of_one_column_is_that_of_pearsons_correlation(rng):
    column = rng.normal(size=(12, 1))
    values = 0.5 * column[:, 0] + rng.normal(size=12) + 7.0
    expected = pearsonr(column[:, 0], values).pvalue
    assert strongest_correlation(column, values) == (0, pytest.approx(expected))


def test_the_mean_improvement_is_tested_by_students_t():
    improvements = np.array([3.0, 2.0, 1.0, -0.5, 0.2])
    expected = ttest_1samp(improvements, 0.0, alternative="greater").pvalue
    assert p_of_mean(improvements) == pytest.approx(expected)
    assert p_of_mean(np.ones(8)) < 1e-9
    assert p_of_mean(-np.ones(8)) == p_of_mean(np.zeros(8)) == p_of_mean(np.ones(1)) == 1.0


def test_one_throw_alone_proves_nothing():
    improvements = np.array([1e6, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, -0.1])
    assert p_of_mean(improvements) > 0.15
    assert p_of_mean(-improvements[::-1] * 1e-6 + 1.0) < 0.001


def test_more_columns_prove_less(rng):
    columns = rng.normal(size=(12, 5))
    values = columns[:, 3] + 0.3 * rng.normal(size=12)
    expected = pearsonr(columns[:, 3], values).pvalue
    assert strongest_correlation(columns, values) == (3, pytest.approx(5 * expected))
    chance = [strongest_correlation(columns, rng.normal(size=12))[1] for _ in range(400)]
    assert np.mean(np.array(chance) < 0.05) < 0.09


def test_a_throw_without_weight_does_not_count(rng):
    columns, values = rng.normal(size=(9, 2)), rng.normal(size=9)
    weights = np.ones(9)
    weights[4] = 0.0
    odd = values.copy()
    odd[4] = 100.0
    assert strongest_correlation(columns, odd, weights) == pytest.approx(
        strongest_correlation(columns, values, weights)
    )


def test_the_curl_of_each_throw_has_its_error(fitted_to):
    curl = effect("curl", strength=0.008, speed_exponent=0.0)
    fitted = fitted_to(curl, effect("stone_bias", stone=1, curl_factor=1.1), throws=9)
    card, stone = catalogue()["curl"], catalogue()["stone_bias"]
    values = neutral_values(card, speed_exponent=0.0)
    term = Term(card=card, values=values, free=("strength",))
    fitted = refit(fitted, fitted.model.with_terms(term))
    asked = Term(card=stone, values=neutral_values(stone, stone=2.0), free=("curl_factor",))
    found, sigma = own_values(fitted, asked)
    assert found.shape == sigma.shape == (9,)
    biased = fitted.session.stones == 1
    step = found[biased].mean() - found[~biased].mean()
    assert step == pytest.approx(0.1, abs=0.03)
    assert ((sigma > 0.0) & (sigma < 0.1)).all()


def test_the_friction_of_each_throw_has_its_error(fitted_to):
    fitted = fitted_to(effect("stone_bias", stone=1, factor=1.03), throws=9, scatter=0.0)
    found, sigma = own_frictions(fitted)
    assert found.shape == sigma.shape == (9,)
    assert (sigma > 0).all()
    assert (sigma < 0.01).all()
    biased = fitted.session.stones == 1
    step = found[biased].mean() - found[~biased].mean()
    assert step == pytest.approx(np.log(1.03), abs=3 * sigma.max())
    pulls = (found - np.where(biased, found[biased].mean(), found[~biased].mean())) / sigma
    assert 0.6 < np.sqrt((pulls**2).mean()) < 1.6


def test_circumstances_are_standardised_and_constant_ones_left_out(fitted_to):
    fitted = fitted_to(throws=9)
    columns = throw_covariates(fitted.session, fitted.states)
    assert {"order", "clock", "speed", "spin", "spin side", "direction", "x", "swept"} <= set(
        columns
    )
    assert {"stone 0", "stone 1", "stone 2"} <= set(columns)
    for name, column in columns.items():
        assert column.shape == (9,)
        assert column.mean() == pytest.approx(0, abs=1e-12), name
        assert column.std() == pytest.approx(1), name
    assert (np.diff(columns["order"]) > 0).all()
    assert np.sign(columns["direction"]).tolist() == [1, -1] * 4 + [1]
    one_way = throw_covariates(fitted.session.only([0, 2, 4]), fitted.states[[0, 2, 4]])
    assert "direction" not in one_way


def test_friction_that_drifts_follows_its_order_and_chance_follows_nothing(fitted_to):
    wear = fitted_to(effect("pebble_wear", rate=-0.01), throws=14)
    name, p = friction_structure(wear)
    assert name == "order"
    assert p < 1e-4
    none = fitted_to(throws=14)
    assert friction_structure(none)[1] > 0.004
    few = fitted_to(throws=6)
    assert friction_structure(few) == ("", 1.0)


def test_a_stone_that_was_thrown_once_is_no_circumstance(fitted_to):
    """It would follow its one throw, whatever that is like."""
    fitted = fitted_to(throws=9)
    stones = np.arange(9) % 2
    stones[4] = 7
    session = replace(fitted.session, stones=stones)
    assert "stone 7" not in throw_covariates(session, fitted.states)
