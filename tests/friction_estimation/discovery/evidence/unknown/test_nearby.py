"""Predicted likelihoods of models near a fit, compared with their own fits."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.physics import GRAVITY, catalogue
from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import (
    CARD,
    Combination,
    Following,
    Term,
    candidates,
    crossed_by,
    field_along,
    fit,
    nearby,
    neutral_values,
    refit,
)
from friction_estimation.discovery.evidence.unknown.nearby import Nearby
from friction_estimation.discovery.model.linearisation import Linearisation, eliminate_factor
from friction_estimation.discovery.model.model import Model

from ...conftest import effect, plain_session

WEAK = effect("slope", x=2e-5, y=1e-5)
"""Strength at which paths respond linearly."""


@pytest.fixture
def around(fitted_to):
    """Models near a fit with the slope that the ice has, and the candidate curl."""
    bare = fitted_to(WEAK, throws=8)
    terms = {term.label: term for term in candidates(bare.session)}
    fitted = refit(bare, bare.model.with_terms(terms["slope"]))
    return nearby(fitted, ["slope"], [terms["curl"]])


def at_spread(around, *labels):
    return Combination(effects=frozenset(labels), spread=around.fitted.model.spread)


def test_taking_an_effect_out_or_in_costs_what_a_fit_says(around):
    fitted = around.fitted
    whole = around.minimum_cost(at_spread(around, "slope"))
    without = refit(fitted, fitted.model.without("slope"))
    loss = around.minimum_cost(at_spread(around)) - whole
    assert loss == pytest.approx(without.deviance - fitted.deviance, rel=0.1)
    curl = around.model.term("curl")
    with_curl = refit(fitted, fitted.model.with_terms(curl))
    gain = whole - around.minimum_cost(at_spread(around, "slope", "curl"))
    assert gain == pytest.approx(fitted.deviance - with_curl.deviance, abs=1.0)


def test_an_effect_of_the_ice_is_worth_more_than_one_that_is_not_there(around):
    plain = around.value(at_spread(around), 1.0)
    assert around.value(at_spread(around, "slope"), 1.0) < plain
    assert around.value(at_spread(around, "curl"), 1.0) > around.value(at_spread(around), 1.0) - 16
    both = around.value(at_spread(around, "slope", "curl"), 1.0)
    assert both > around.value(at_spread(around, "slope"), 1.0)
    # What is left counts for less where noise is taken to be larger.
    calm = [around.value(at_spread(around, *labels), 100.0) for labels in ((), ("slope",))]
    assert calm[0] - calm[1] < plain - around.value(at_spread(around, "slope"), 1.0)


def test_every_further_parameter_of_an_effect_costs(around):
    """The same as in the selection: 16 for an effect, and 4 for each parameter beyond the first."""
    made = at_spread(around, "slope", "curl")
    log_terms = float(around.linear.each(made.spread)[1].sum())
    further = sum(len(around.places[label]) - 1 for label in ("slope", "curl"))
    assert further == 1  # a slope has two, a curl one
    needed = around.value(made, 1.0) - around.minimum_cost(made) - log_terms
    assert needed == pytest.approx(2 * 16.0 + 4.0 * further)


def test_the_order_in_which_pushes_were_found_changes_nothing(around):
    """Not even by rounding, after which another effect may be chosen."""
    one, other = Following("speed", "along"), Following("spin", "left")
    first = at_spread(around, "slope").following(one).following(other, 0.3)
    second = at_spread(around, "slope").following(other, 0.3).following(one)
    assert list(first.pushes) == list(second.pushes)
    assert around.value(first, 1.0) == around.value(second, 1.0)


def test_a_push_does_what_the_effect_did(around):
    push = Following("", "across the sheet")
    bare = replace(at_spread(around), pushes={push: 0.3})
    assert around.minimum_cost(bare) < around.minimum_cost(at_spread(around)) - 10
    pushed = around.pushed(bare, 1.0)
    assert pushed.pushes is not None
    x = around.fitted.model.term("slope").values["x"]
    assert pushed.pushes.sizes[:, 2] == pytest.approx(GRAVITY * x, rel=0.2)
    assert not pushed.pushes.sizes[:, [0, 1, 3]].any()
    # Around a fit beside the pushes they are counted from none once more.
    model = around.fitted.model.without("slope")
    again = nearby(fit(model, pushed, around.fitted.noise), (), ())
    best = replace(bare, effects=frozenset(), spread=again.fitted.model.spread)
    same = again.pushed(best, 1.0).pushes
    assert same.sizes[:, 2] == pytest.approx(pushed.pushes.sizes[:, 2], rel=0.02)
    assert around.pushed(at_spread(around), 1.0).pushes is None


@pytest.mark.parametrize("dispersion", [1.0, 3.0])
def test_throws_are_scored_by_the_best_fit_to_the_others(around, dispersion):
    made = at_spread(around, "slope")
    scores = around.scores(made, dispersion)
    n = len(around.fitted.model.vector)
    own = np.append(np.arange(n), around.size - 1)
    grams = around.linear.each(made.spread)[0][:, own[:, None], own] / dispersion
    prior = around.linear.prior[np.ix_(own, own)]
    for gram, score in zip(grams, scores, strict=True):
        others = grams.sum(axis=0) - gram + prior
        step = np.linalg.solve(others[:n, :n], others[:n, n])
        move = np.append(-step, 1.0)
        assert score == pytest.approx(move @ gram @ move, rel=1e-4)


def test_a_push_is_integrated_over(around):
    """Determinant of the information on it, in units of its prior."""
    made = at_spread(around, "slope").following(Following("x", "left"), 0.3)
    quadratic = around.quadratic(made)
    assert quadratic.sizes == pytest.approx(np.full(3, 0.3 * 0.004))  # of 4 mm/s²
    inner, count = quadratic.gram[:-1, :-1], quadratic.always
    left = np.linalg.inv(np.linalg.inv(inner)[count:, count:])  # the others at their best
    integrated = np.linalg.slogdet(left * np.outer(quadratic.sizes, quadratic.sizes))[1]
    log_terms = float(around.linear.each(made.spread)[1].sum())
    needed = 2 * 16.0 + 4.0
    expected = around.minimum_cost(made) + integrated + log_terms + needed
    assert around.value(made, 1.0) == pytest.approx(expected, abs=0.01)


def test_information_that_a_push_may_take_over_is_that_on_what_it_copies(around):
    push = Following("", "across the sheet")
    made = replace(at_spread(around, "slope"), pushes={push: 1.0})
    lost = np.diag(around.absorbed_information(made))
    names = around.fitted.model.names
    x, y = names.index(("slope", "x")), names.index(("slope", "y"))
    result = np.diag(around.quadratic(made).gram)
    assert lost[x] > 0.9 * result[x]
    assert lost[y] < 0.2 * result[y]


def test_pushes_are_no_further_effect(around):
    """A constant push across the sheet is a slope, and one over time may be constant."""

    def beside(variable, push, effect="slope"):
        return replace(at_spread(around, effect), pushes={Following(variable, push): 1.0})

    assert around.repeats(beside("", "across the sheet"))
    assert around.repeats(beside("t", "across the sheet"))
    assert not around.repeats(beside("x", "across the sheet"))
    assert not around.repeats(beside("", "left"))
    assert not around.repeats(beside("", "across the sheet", "curl"))
    assert not around.repeats(at_spread(around, "slope", "curl"))


# --- models of random columns, against least squares ---------------------------------------------

STRONG, WEAK_PUSH = Following("speed", "left"), Following("t", "turn")
SIZES = {STRONG: 0.004, WEAK_PUSH: 0.01}


@pytest.fixture
def by_hand(rng):
    """A fit with a map and curl by random columns, and two pushes of two functions each."""
    y = np.linspace(-8.0, 8.0, 40)
    field = field_along(
        PAPER_SHEET, crossed_by(PAPER_SHEET, [np.column_stack([0 * y, y])]), 9.0, np.inf
    )
    field = field.at(0.03 * rng.normal(size=len(field)))
    card = catalogue()["curl"]
    curl = Term(
        card=card,
        values=neutral_values(card, strength=0.02, speed_exponent=0.4),
        free=("strength", "speed_exponent"),
    )
    ice: Any = SimpleNamespace(sheet=PAPER_SHEET)
    model = Model(ice=ice, terms=(Term(card=CARD, map_field=field), curl), ln_coupling=0.05)
    own = len(model.vector)
    columns = rng.normal(size=(3, 60, 7 + own + 4 + 1))
    columns[:, :, 7:9] *= 20.0
    columns[:, :, 9 : 9 + len(field)] *= 40.0
    columns[:, :, 7 + own : 7 + own + 4] *= 100.0
    grams = np.einsum("kni,knj->kij", columns, columns)
    linear = Linearisation(model=model, ln_factors=0.01 * rng.normal(size=3), grams=grams)
    fitted: Any = SimpleNamespace(session=plain_session(throws=3), model=model)
    paths: Any = None
    return Nearby(
        fitted=fitted, model=model, paths=paths, functions={}, linear=linear,
        optional=(CARD.name, "curl"),
        pushes={STRONG: own + np.arange(2), WEAK_PUSH: own + 2 + np.arange(2)},
    )  # fmt: skip


def by_least_squares(around, made, dispersion):
    """Least F of a combination, and the information on its parameters, written out."""
    model, field = around.model, around.model.map_field
    grams, log_terms = eliminate_factor(
        around.linear.reduced, around.linear.ln_factors, made.spread
    )
    values, vectors = np.linalg.eigh(grams.sum(axis=0) / dispersion)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    count, size = len(model.vector), root.shape[1] - 1
    where = np.arange(count)[model.map_slice]
    curl = np.arange(count - 2, count)
    fixed = np.zeros(size)
    free = [0, 1]
    rows, right = [np.eye(size)[1] / 0.15], [-model.ln_coupling / 0.15]
    if "curl" in made.effects:
        free += curl.tolist()
    else:
        fixed[curl[0]] = -model.terms[1].values["strength"]  # its shape is no strength
    fixed[where] = -field.values
    for push, scale in made.pushes.items():
        free += around.pushes[push].tolist()
        rows += list(np.eye(size)[around.pushes[push]] / (scale * SIZES[push]))
        right += [0.0, 0.0]
    matrix = np.vstack([root[:, :-1], *rows])
    target = np.append(root[:, -1], right) - matrix @ fixed
    best = matrix[:, free] @ np.linalg.lstsq(matrix[:, free], target)[0]
    information = matrix[:, free].T @ matrix[:, free]
    return float(((target - best) ** 2).sum()), information, free, float(log_terms.sum())


@pytest.mark.parametrize("dispersion", [1.0, 4.0])
@pytest.mark.parametrize("effects", [(), ("curl",)])
@pytest.mark.parametrize("pushes", [{}, {STRONG: 0.3}, {STRONG: 1.0, WEAK_PUSH: 0.1}])
def test_a_combination_costs_what_least_squares_leave(by_hand, dispersion, effects, pushes):
    made = Combination(effects=frozenset(effects), pushes=pushes, spread=0.02)
    least, information, free, log_terms = by_least_squares(by_hand, made, dispersion)
    assert by_hand.minimum_cost(made, dispersion) == pytest.approx(least)
    # Pushes are integrated over: the determinant of what is known of them beside others.
    sizes = [scale * SIZES[push] for push, scale in pushes.items() for _ in range(2)]
    integrated = 0.0
    if sizes:
        first = len(free) - len(sizes)
        inner = np.linalg.inv(np.linalg.inv(information)[first:, first:])
        integrated = np.linalg.slogdet(inner * np.outer(sizes, sizes))[1]
    needed = 16.0 * (len(effects) + len(pushes)) + (4.0 if "curl" in effects else 0.0)
    value = by_hand.value(made, dispersion)
    assert value == pytest.approx(least + integrated + log_terms + needed)


def test_terms_have_their_places_and_strengths(by_hand):
    n = len(by_hand.model.map_field)
    assert by_hand.size == len(by_hand.model.vector) + 4 + 1
    assert by_hand.always.tolist() == [0, 1]
    assert by_hand.places[CARD.name].tolist() == list(range(2, 2 + n))
    assert by_hand.places["curl"].tolist() == [2 + n, 3 + n]
    places, off = by_hand.offsets["curl"]
    assert places.tolist() == [2 + n]
    assert off.tolist() == [0.02]
    places, off = by_hand.offsets[CARD.name]
    assert off == pytest.approx(by_hand.model.map_field.values)
    assert by_hand.slow == 3 * sum(min(2 * 5.5 / 2.0, 12 // 6) for _ in range(3))


def test_a_combination_is_changed_by_one_term_at_a_time():
    made = Combination(effects=frozenset(["slope"])).following(STRONG, 0.3)
    assert made.toggled("slope").effects == frozenset()
    assert made.toggled("curl").effects == {"slope", "curl"}
    assert made.following(WEAK_PUSH).pushes == {STRONG: 0.3, WEAK_PUSH: 1.0}
    assert made.following(STRONG).pushes == {STRONG: 1.0}
    assert made.following(WEAK_PUSH).without(STRONG).pushes == {WEAK_PUSH: 1.0}
    assert made.pushes == {STRONG: 0.3}


def test_pushes_are_some_per_cent_of_friction_beforehand(by_hand):
    """Of 0.009: as a share along, as an acceleration to the side, and of the spin by the torque."""
    usual = {"along": 1.0, "left": 0.009 * GRAVITY, "turn": 0.2, "along the sheet": 1.0,
             "across the sheet": 0.009 * GRAVITY}  # fmt: skip
    for push, friction in usual.items():
        following = Following("speed", push)
        around = replace(by_hand, pushes={following: by_hand.pushes[STRONG]})
        sizes = around.quadratic(Combination().following(following)).sizes
        assert len(sizes) == 2
        assert ((sizes > 0.02 * friction) & (sizes < 0.07 * friction)).all()


def test_the_dispersion_is_what_is_left_over_its_slow_shapes(by_hand):
    """At least one: what fits better than noise may do so by chance."""
    made = Combination(effects=frozenset(["curl"]))
    assert by_hand.values == 3 * 3 * 12
    left = by_hand.minimum_cost(made) - 108.0
    assert left > by_hand.slow
    assert by_hand.dispersion(made) == pytest.approx(1.0 + left / by_hand.slow)
    calm = replace(by_hand)
    calm.__dict__["values"] = by_hand.minimum_cost(made) + 1.0
    assert calm.dispersion(made) == 1.0


def test_the_best_of_a_combination_is_no_worse_than_any_spread_or_scale(by_hand):
    made = Combination(effects=frozenset(["curl"])).following(STRONG)
    value, best = by_hand.at_best(made, 1.0)
    assert value == by_hand.value(best, 1.0)
    assert set(best.pushes) == {STRONG}
    assert best.effects == made.effects
    for scale in (0.1, 0.3, 1.0, 3.0):
        for spread in (0.002, 0.005, 0.02, 0.1):
            other = replace(made.following(STRONG, scale), spread=spread)
            assert by_hand.value(other, 1.0) > value - 1.5  # between the tried ones it is flat
