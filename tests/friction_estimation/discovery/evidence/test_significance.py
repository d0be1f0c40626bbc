"""Tests of whether the throws' frictions follow a variable or differ by chance."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import pearsonr, ttest_1samp, uniform

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
from friction_estimation.discovery.evidence import significance
from friction_estimation.discovery.evidence.significance import (
    _fit_without,
    _p_between_throws,
    _p_of_stones,
    broad_prior,
    own_values,
    throw_covariates,
    weigh_evidence,
)
from friction_estimation.discovery.model.model import Model

from ..conftest import effect, plain_session


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


# --- tests of significance on numbers that are given ---------------------------------------------


def test_a_broad_prior_is_as_wide_as_the_bounds_of_a_parameter():
    """A uniform distribution between them; without bounds it is nearly flat."""
    card = catalogue()["slope"]
    term = Term(card=card, values={"x": 0.0, "y": 0.0}, free=("x",))
    ice: Any = SimpleNamespace()
    model = Model(ice=ice, terms=(term,))
    limit = card.parameter("x")
    expected = [
        uniform.std(-3.0, 6.0),
        uniform.std(-1.0, 2.0),
        uniform.std(limit.low, limit.high - limit.low),
    ]
    gram = broad_prior(model)
    assert gram == pytest.approx(np.diag([*(np.array(expected) ** -2.0), 0.0]))
    endless = SimpleNamespace(bounds=(np.array([-np.inf]), np.array([np.inf])))
    flat = broad_prior(endless)
    assert flat.tolist() == [[pytest.approx(1e-6), 0.0], [0.0, 0.0]]


def test_a_mean_of_zero_and_few_throws_prove_nothing():
    assert p_of_mean(np.array([1.0, -1.0])) == 1.0
    assert p_of_mean(np.array([8.0])) == 1.0
    assert p_of_mean(np.array([1.0, 2.0])) == pytest.approx(
        ttest_1samp([1.0, 2.0], 0.0, alternative="greater").pvalue
    )


def test_rows_with_weights_count_as_often():
    """A row of twice the weight is one that is there twice, but for the degrees of freedom."""
    rng = np.random.default_rng(2)
    columns, values = rng.normal(size=(8, 3)), rng.normal(size=8)
    twice = np.array([2.0, 1.0, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0])
    rows = np.repeat(np.arange(8), twice.astype(int))
    r = np.array([pearsonr(columns[rows, k], values[rows]).statistic for k in range(3)])
    best = int(np.argmax(np.abs(r)))
    t = abs(r[best]) * np.sqrt(6 / (1 - r[best] ** 2))
    from scipy.stats import t as student_t

    found, p = strongest_correlation(columns, values, 5.0 * twice)
    assert (found, p) == (best, pytest.approx(min(1.0, 3 * 2 * student_t.sf(t, 6))))


def test_the_circumstances_of_throws_are_read_from_the_session():
    session = plain_session(throws=5, stones=np.array([4, 4, 7, 7, 9]))
    swept = np.zeros(len(session.times))
    swept[session.rows(2)] = 1.0
    swept[session.rows(3).start : session.rows(3).start + 3] = 1.0
    session = replace(session, swept=swept)
    states = np.zeros((5, 6))
    states[:, 0] = [0.1, 0.2, 0.4, 0.1, 0.0]
    states[:, 2], states[:, 3] = [0.3, 0, 0, 0, 0], [0.4, -2.0, 1.0, -3.0, 2.0]
    states[:, 5] = [1.0, -2.0, 1.5, -1.0, 0.5]
    columns = throw_covariates(session, states)

    def standard(*values):
        values = np.array(values, dtype=float)
        return pytest.approx((values - values.mean()) / values.std())

    assert set(columns) == {
        *("order", "clock", "speed", "spin", "spin side", "direction", "x", "swept"),
        *("stone 4", "stone 7"),  # the other was thrown once
    }
    assert columns["order"] == standard(0, 1, 2, 3, 4)
    assert columns["speed"] == standard(0.5, 2, 1, 3, 2)
    assert columns["spin"] == standard(1, 2, 1.5, 1, 0.5)
    assert columns["spin side"] == standard(1, -1, 1, -1, 1)
    assert columns["direction"] == standard(1, -1, 1, -1, 1)
    assert columns["x"] == standard(0.1, 0.2, 0.4, 0.1, 0.0)
    assert columns["swept"] == standard(0, 0, 1, 0.25, 0)
    assert columns["stone 7"] == standard(0, 0, 1, 1, 0)
    blind = replace(session, theta=np.full(len(session.times), np.nan))
    assert not {"spin", "spin side"} & set(throw_covariates(blind, states))


def scattered(frictions, *, spread=0.01, field=None, **columns) -> Any:
    """A fit whose throws have these frictions, far better known than they differ."""
    throws = len(frictions)
    session = plain_session(throws=throws, clocks=np.zeros(throws), **columns)
    reduced = np.zeros((throws, 2, 2))
    reduced[:, 0, 0] = 1e6
    reduced[:, 0, 1] = 1e6 * (np.array(frictions) - 0.5)
    states = np.zeros((throws, 6))
    rng = np.random.default_rng(3)
    states[:, 0], states[:, 3], states[:, 5] = rng.normal(size=(3, throws))
    return SimpleNamespace(
        session=session,
        states=states,
        ln_factors=np.full(throws, 0.5),
        linear=SimpleNamespace(reduced=reduced),
        model=SimpleNamespace(spread=spread, map_field=field),
    )


def test_the_own_friction_of_a_throw_is_that_of_the_fit_and_what_it_still_asks_for():
    own, sigma = own_frictions(scattered([0.1, 0.2, -0.3]))
    assert own == pytest.approx([0.1, 0.2, -0.3])
    assert sigma == pytest.approx(np.full(3, 1e-3))


def test_frictions_follow_the_line_unless_a_map_may_err_along_it():
    on_lines = scattered(np.zeros(9))
    x = on_lines.states[:, 0]
    on_lines.linear.reduced[:, 0, 1] = 1e6 * (0.01 * x - 0.5)
    name, p = friction_structure(on_lines)
    assert name == "x"
    assert p < 1e-6
    on_lines.model.map_field = SimpleNamespace()
    name, p = friction_structure(on_lines)
    assert name != "x"
    assert p > 1e-3


@pytest.mark.parametrize(
    ("throws", "spread", "asked"),
    [(7, 0.01, False), (8, 0.01, True), (8, 4e-4, False), (8, 5e-4, True)],
)
def test_frictions_follow_nothing_if_they_do_not_scatter(throws, spread, asked):
    found = friction_structure(scattered(0.01 * np.arange(throws), spread=spread))
    assert (found != ("", 1.0)) == asked
    if asked:
        assert found[0] == "order"


def test_an_effect_between_throws_is_tested_by_order_clock_and_stone_alone():
    """Here by the order and three stones: Pearson's p, times four."""
    rng = np.random.default_rng(4)
    stones = np.array([0, 1, 2] * 4)
    frictions = 0.01 * np.arange(12) + 0.05 * rng.normal(size=12)
    fitted = scattered(frictions, stones=stones)
    columns = np.column_stack([np.arange(12), *(stones == s for s in range(3))]).astype(float)
    each = [pearsonr(column, frictions).pvalue for column in columns.T]
    assert _p_between_throws(fitted) == pytest.approx(4 * min(each))


def test_evidence_is_counted_in_the_order_of_play_with_the_throws_held_out(monkeypatch):
    """Of throws 1, 5, 8 that were fitted, and 3, 6 that were not."""
    card = catalogue()["curl"]
    term = Term(card=card, values=neutral_values(card), free=card.first)
    model: Any = SimpleNamespace(term=lambda _: term)
    fitted: Any = SimpleNamespace(
        session=SimpleNamespace(throws=np.array([1, 5, 8])), model=model, deviance=100.0, own=0.0
    )
    without = SimpleNamespace(deviance=130.0, own=1.0)
    held: Any = SimpleNamespace(throws=np.array([3, 6]))
    monkeypatch.setattr(significance, "_fit_without", lambda *_: without)
    seen, unseen = np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0])
    monkeypatch.setattr(significance, "left_out_scores", lambda f: 10.0 + f.own * seen)
    monkeypatch.setattr(significance, "unseen_scores", lambda f, _: 20.0 + f.own * unseen)
    (found,) = weigh_evidence(fitted, ["curl"], held, held)
    assert (found.label, found.gain) == ("curl", 30.0)
    assert found.improvements.tolist() == [1.0, 4.0, 2.0, 5.0, 3.0]
    expected = ttest_1samp(found.improvements, 0.0, alternative="greater").pvalue
    assert found.p == pytest.approx(expected)
    (alone,) = weigh_evidence(fitted, ["curl"], None, held)
    assert alone.improvements.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(("name", "held"), [("curl", False), ("tracking_offset", True)])
def test_a_cameras_error_cannot_replace_an_effect_of_the_camera(monkeypatch, name, held):
    from friction_estimation.discovery.model.gaussian_field import GatePlaces

    card = catalogue()[name]
    term = Term(card=card, values=neutral_values(card), free=card.first)
    places = GatePlaces(places=np.zeros(1), amplitude=0.01, values=np.zeros(1))
    ice: Any = SimpleNamespace()
    model = Model(ice=ice, terms=(term,), systematic_error=places)
    monkeypatch.setattr(significance, "refit", lambda _, model: model)
    monkeypatch.setattr(significance, "without_term", lambda one, label: one.model.without(label))
    fitted: Any = SimpleNamespace(model=model)
    left: Any = _fit_without(fitted, name)
    assert left.terms == ()
    assert left.systematic_error.held == held


def bias_of(stone: float, *free: str) -> Term:
    card = catalogue()["stone_bias"]
    return Term(card=card, values=neutral_values(card, stone=stone), free=free or ("factor",))


def test_the_own_value_of_a_throw_is_that_of_its_stone_and_of_the_first_parameter():
    """Of throws by stones 4 and 9 the columns of their stones follow those of the model."""
    stones = np.array([9, 4, 9])
    asked: list[tuple[Any, ...]] = []
    grams = np.zeros((3, 6, 6))
    for i, place in enumerate((4, 3, 4)):  # after three shared parameters
        grams[i, place, place], grams[i, place, -1] = (i + 1.0) ** 2, 10.0 * (i + 1)

    def linear_with(*terms):
        asked.extend((term.stone, term.free) for term in terms)
        return SimpleNamespace(each=lambda: (grams, None))

    model = SimpleNamespace(vector=np.zeros(3))
    fitted: Any = SimpleNamespace(
        session=plain_session(throws=3, stones=stones), linear_with=linear_with, model=model
    )
    own, sigma = own_values(fitted, bias_of(9.0, "curl_factor", "factor"))
    assert asked == [(4, ("curl_factor",)), (9, ("curl_factor",))]
    assert own == pytest.approx([10.0, 5.0, 10.0 / 3])
    assert sigma == pytest.approx([1.0, 1 / 2, 1 / 3])


def test_stones_differ_by_the_weighted_values_of_their_throws(monkeypatch):
    """A stone that was thrown once is no stone to compare, but its throw counts."""
    stones = np.array([1, 1, 2, 2, 2, 7, 1, 2])
    rng = np.random.default_rng(6)
    own, sigma = rng.normal(size=8) + (stones == 1), rng.uniform(0.5, 2.0, 8)
    monkeypatch.setattr(significance, "own_values", lambda *_: (own, sigma))
    fitted: Any = SimpleNamespace(session=plain_session(throws=8, stones=stones))
    columns = np.column_stack([stones == 1, stones == 2]).astype(float)
    weights = 1.0 / (sigma**2 + np.median(sigma) ** 2)
    expected = strongest_correlation(columns, own, weights)[1]
    assert _p_of_stones(fitted, bias_of(1.0)) == pytest.approx(expected)


def test_each_effect_is_tested_by_what_shows_it(monkeypatch):
    """One between throws by their frictions, one of a stone by its throws, others by scores."""
    terms = {
        "drift": Term(
            card=catalogue()["time_drift"], values=neutral_values(catalogue()["time_drift"]),
            free=catalogue()["time_drift"].first,
        ),
        "curls": bias_of(1.0, "curl_factor"),
        "curl": Term(card=catalogue()["curl"], values={}, free=("strength",)),
    }  # fmt: skip
    assert terms["drift"].between_throws
    assert not terms["curls"].between_throws
    model: Any = SimpleNamespace(term=terms.__getitem__)
    fitted: Any = SimpleNamespace(
        session=SimpleNamespace(throws=np.arange(3)), model=model, deviance=5.0
    )
    monkeypatch.setattr(significance, "_fit_without", lambda *_: SimpleNamespace(deviance=8.0))
    monkeypatch.setattr(significance, "_scores", lambda *_: np.zeros(3))
    monkeypatch.setattr(significance, "fit_to", lambda fitted, whole: whole)
    monkeypatch.setattr(significance, "_p_between_throws", lambda whole: 0.25)
    monkeypatch.setattr(significance, "_p_of_stones", lambda whole, term: 0.5)
    whole: Any = SimpleNamespace()
    found = weigh_evidence(fitted, list(terms), None, whole)
    assert [effect.p for effect in found] == [0.25, 0.5, 1.0]
    assert [effect.gain for effect in found] == [3.0, 3.0, 3.0]
