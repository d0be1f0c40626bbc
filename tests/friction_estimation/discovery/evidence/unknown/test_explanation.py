"""Variables that an unexplained residual follows, and effects found with it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from friction_estimation.discovery import (
    Combination,
    Following,
    base_model,
    candidates,
    explain,
    find_dependences,
    find_map,
    fit_beside,
    fit_with_noise,
    mixture,
    nearby,
    open_session,
    refit,
    standard_errors,
    try_term,
)
from friction_estimation.discovery.evidence.unknown.explanation import (
    may_correct_pushes,
    surviving,
)
from friction_estimation.discovery.search.selection import refine

from ..conftest import effect

CURL = effect("curl", strength=0.006)
SLOPE = effect("slope", x=1.5e-4, y=1e-4)


def test_a_push_that_follows_the_spin_is_found_to_follow_the_spin(fitted_to):
    found = find_dependences(fitted_to(CURL, throws=12))
    assert found
    assert (found[0].variable, found[0].push) == ("spin", "left")
    assert 0.5 < found[0].share <= 1.0
    assert found[0].p < 0.01
    assert len(found) <= 3


def test_nothing_is_followed_where_nothing_is_missing(fitted_to):
    assert find_dependences(fitted_to(throws=10)) == []


def test_a_proxy_is_dropped_and_what_it_stood_for_is_taken_beside_the_unknown(
    fitted_to, without_effects
):
    bare = fitted_to(CURL, SLOPE, throws=12)
    with without_effects("curl"):
        terms = {term.label: term for term in candidates(bare.session)}
        proxy = refit(bare, bare.model.with_terms(terms["sweeping"], terms["air_drag"]))
        found = explain(proxy, ())
        final = fit_beside(refit(bare, found.fit.model), found.pushes)
    assert [term.label for term in found.fit.model.terms] == ["slope"]
    assert "spin" in [each.variable for each in found.dependences]
    # No push follows the side of the spin and the speed at once, as the curl does.
    values, sigma = final.model.term("slope").values, standard_errors(final)
    assert values["x"] == pytest.approx(SLOPE.parameters["x"], rel=0.2)
    assert abs(values["y"] - SLOPE.parameters["y"]) < 2.0 * sigma["slope", "y"] < 1e-4


def test_without_an_unknown_a_fit_beside_it_is_the_fit(fitted_to):
    fitted = fitted_to(SLOPE, throws=8)
    terms = {term.label: term for term in candidates(fitted.session)}
    fitted = refit(fitted, fitted.model.with_terms(terms["slope"]))
    beside = fit_beside(fitted, ())
    assert beside.model.vector == pytest.approx(fitted.model.vector, rel=1e-2, abs=1e-4)
    assert np.diagonal(beside.linear.grams, axis1=1, axis2=2) == pytest.approx(
        np.diagonal(fitted.linear.grams, axis1=1, axis2=2), rel=0.3, abs=1e3
    )


def test_beside_an_unknown_effects_keep_their_form(fitted_to):
    """Though this ice has a finer one, to which the search would go."""
    law = effect("speed_dependent_friction", exponent=1.0, speed_offset=0.9, share=0.6)
    bare = fitted_to(law, throws=8, fps=5)
    (power,) = [t for t in candidates(bare.session) if t.label == law.name]
    fitted = refit(bare, bare.model.with_terms(power))
    assert fit_beside(fitted, ()).model.names == fitted.model.names
    assert refine(fitted).model.names != fitted.model.names


def test_what_pushes_may_do_is_never_more_than_what_the_throws_tell(fitted_to):
    fitted = fitted_to(SLOPE, throws=12)
    beside = fit_beside(fitted, (Following("speed", "along"),))
    for covariance in mixture(beside).covariances:
        scale = np.sqrt(np.diag(covariance))
        assert np.linalg.eigvalsh(covariance / np.outer(scale, scale)).min() > 0
    alone, doubted = (mixture(one).covariances[0, 0, 0] for one in (fitted, beside))
    assert doubted > 2 * alone  # friction that follows the speed leaves its mean open


def test_an_effect_that_the_unknown_may_be_does_not_survive_beside_it(fitted_to):
    """Of friction that follows the speed otherwise each way, the mean may follow it too."""
    bare = fitted_to(SLOPE, effect("speed_dependent_friction", exponent=0.02), throws=8)
    terms = {term.label: term for term in candidates(bare.session)}
    both = ("slope", "speed_dependent_friction")
    fitted = refit(bare, bare.model.with_terms(*(terms[label] for label in both)))
    around = nearby(fitted, both)
    one_way, alike = Following("speed", "along the sheet"), Following("speed", "along")
    made = Combination(effects=frozenset(both)).following(one_way)
    left = surviving(around, made, 1.0)
    assert left.effects == {"slope"}
    assert set(left.pushes) == {one_way, alike}
    # What follows the spin explains nothing of it.
    made = Combination(effects=frozenset(both)).following(Following("spin", "along the sheet"))
    assert surviving(around, made, 1.0) == made


@pytest.mark.parametrize(
    ("gain", "rest", "corrects"),
    [(250.0, 3e4, True), (350.0, 3e4, False), (250.0, 70.0, True), (250.0, 55.0, False)],
)
def test_a_term_may_correct_pushes_if_it_explains_little_and_leaves_much(gain, rest, corrects):
    """Less than three thousandths of what pushes explain, and a fifth of what was left."""
    push = Following("speed", "left")
    before = Combination(effects=frozenset(["slope"])).following(push)
    after = before.toggled("curl")

    def minimum_cost(made):
        if not made.pushes:
            return 1000.0 + rest + 1e5
        return 1000.0 + rest + (0.0 if made == after else gain)

    around: Any = SimpleNamespace(values=1000.0, minimum_cost=minimum_cost)
    assert may_correct_pushes(around, before, after) == corrects
    assert not may_correct_pushes(around, after, before)


def test_an_unknown_is_asked_for_no_further_where_a_map_explains_more(sliding, rng):
    smooth = sliding.random_field(rng, mu=0.009, spread=0.03, length=4.0)
    tracks = sliding.measured_throws(smooth, sliding.varied_starts(rng, 6), rng, fps=5)
    base = fit_with_noise(base_model(None, open_session(tracks)), open_session(tracks))
    mapped = try_term(base, find_map(base)[0]).fit
    assert explain(mapped, (), beyond_map=True) is None
    assert explain(mapped, ()) is not None
