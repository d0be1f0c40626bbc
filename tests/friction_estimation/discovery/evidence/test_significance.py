"""Whether the throws' own frictions follow something, or differ by chance."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.physics import catalogue
from friction_estimation.discovery import (
    Term,
    base_model,
    fit_with_noise,
    friction_structure,
    neutral_values,
    open_session,
    own_frictions,
    refit,
)
from friction_estimation.discovery.evidence.significance import (
    _correlations,
    add_effects_between_throws,
    own_values,
    throw_covariates,
)
from friction_estimation.discovery.tuning import PERMUTATIONS

from ..conftest import effect


@pytest.fixture
def fitted_to(make_session):
    def make(*effects, **options):
        session = open_session(make_session(effects, **options))
        return fit_with_noise(base_model(None, session), session)

    return make


def test_correlations_are_pearsons(rng):
    columns = rng.normal(size=(12, 3))
    columns = (columns - columns.mean(axis=0)) / columns.std(axis=0)
    values = rng.normal(size=(5, 12)) + 7.0
    expected = [[abs(np.corrcoef(v, c)[0, 1]) for c in columns.T] for v in values]
    assert _correlations(columns, values) == pytest.approx(np.array(expected))


def test_weights_count_a_throw_as_often_as_they_say(rng):
    columns, values = rng.normal(size=(6, 2)), rng.normal(size=6)
    times = np.array([1, 3, 0, 2, 1, 4])
    repeated = _correlations(np.repeat(columns, times, axis=0), np.repeat(values, times))
    assert _correlations(columns, values, times.astype(float)) == pytest.approx(repeated)


def test_the_curl_of_each_throw_is_told_with_its_error(fitted_to):
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


def test_the_friction_of_each_throw_is_told_with_its_error(fitted_to):
    fitted = fitted_to(effect("stone_bias", stone=1, factor=1.03), throws=9, scatter=0.0)
    found, sigma = own_frictions(fitted)
    assert found.shape == sigma.shape == (9,)
    assert (sigma > 0).all()
    assert (sigma < 0.01).all()
    biased = fitted.session.stones == 1
    step = found[biased].mean() - found[~biased].mean()
    assert step == pytest.approx(np.log(1.03), abs=3 * sigma.max())
    pulls = (found - np.where(biased, found[biased].mean(), found[~biased].mean())) / sigma
    assert 0.3 < np.sqrt((pulls**2).mean()) < 2.0


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


def test_friction_that_drifts_follows_its_order_and_chance_follows_nothing(fitted_to, rng):
    wear = fitted_to(effect("pebble_wear", rate=-0.01), throws=14)
    name, p = friction_structure(wear, rng)
    assert name == "order"
    assert p == pytest.approx(1 / (PERMUTATIONS + 1))  # as rarely by chance as can be told
    columns, own = throw_covariates(wear.session, wear.states), own_frictions(wear)[0]
    best = max(columns, key=lambda k: abs(np.corrcoef(columns[k], own)[0, 1]))
    assert best == name
    more = add_effects_between_throws(wear, wear.session, rng)
    (term,) = more.model.terms
    assert term.name == "pebble_wear"
    assert term.values["rate"] == pytest.approx(-0.01, rel=0.15)

    # Chance does as well in the share of the orders of throws that Pearson's r says.
    none = fitted_to(throws=14)
    columns, own = throw_covariates(none.session, none.states), own_frictions(none)[0]
    table = np.array(list(columns.values()))

    def strongest(values):
        return np.abs(np.corrcoef(np.vstack([table, values]))[-1, :-1]).max()

    found = strongest(own)
    chance = np.mean([strongest(rng.permutation(own)) >= found for _ in range(1000)])
    assert friction_structure(none, rng)[1] == pytest.approx(chance, abs=0.06)
    assert friction_structure(none, rng)[1] > 0.004
    assert add_effects_between_throws(none, none.session, rng) is none
    few = fitted_to(throws=6)
    assert friction_structure(few, rng) == ("", 1.0)
