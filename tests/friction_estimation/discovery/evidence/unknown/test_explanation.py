"""Variables that an unexplained residual follows, and effects found with it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from friction_estimation.discovery import (
    Combination,
    Dependence,
    Following,
    candidates,
    explain,
    find_dependences,
    fit_beside,
    mixture,
    nearby,
    refit,
    standard_errors,
)
from friction_estimation.discovery.evidence.unknown import explanation
from friction_estimation.discovery.evidence.unknown.explanation import (
    _moves,
    dependences,
    may_correct_pushes,
    search,
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


# --- decisions on costs that are given -----------------------------------------------------------

SPEED, SIDE = Following("speed", "left"), Following("spin side", "left")
SPIN, EVEN = Following("spin", "turn"), Following("", "left")


class Costs:
    """Models near a fit: each term takes a part of a misfit of 1000 away."""

    values = 100.0
    optional = ("slope", "curl", "friction_map")
    pushes = (SPEED, SIDE, SPIN, EVEN)

    def __init__(self, parts, improvements=(5.0,) * 8, needed=16.0, dispersion=1.0):
        self.parts, self.improvements, self.needed = parts, np.array(improvements), needed
        self.at_least = dispersion

    def minimum_cost(self, made):
        return 1100.0 - sum(self.parts.get(term, 0.0) for term in [*made.effects, *made.pushes])

    def value(self, made, dispersion):
        count = len(made.effects) + len(made.pushes)
        return self.minimum_cost(made) / dispersion + self.needed * count

    def at_best(self, made, dispersion):
        return self.value(made, dispersion), made

    def dispersion(self, made):
        return max(self.at_least, self.minimum_cost(made) / 1100.0)

    def repeats(self, made):
        return False

    def scores(self, made, dispersion):
        del dispersion
        return -self.improvements * len(made.pushes)


def test_a_variable_has_the_share_of_its_pushes_and_the_push_that_does_most():
    turn = Following("spin", "along")
    around: Any = Costs({SPEED: 100.0, SIDE: 400.0, SPIN: 300.0, turn: 50.0})
    made = Combination().following(SPEED).following(SIDE).following(SPIN).following(turn)
    spin, speed = dependences(around, made, 1.0)
    assert (spin.variable, spin.push) == ("spin", "left")  # both by side and by size
    assert spin.share == pytest.approx(0.75)
    assert (speed.variable, speed.push) == ("speed", "left")
    assert speed.share == pytest.approx(0.1)
    assert spin.p < 1e-6
    # The strongest alone explains more than is missing: no share is above one.
    around = Costs({SIDE: 2000.0})
    (only,) = dependences(around, Combination().following(SIDE), 1.0)
    assert only.share == 1.0


@pytest.mark.parametrize(("part", "found"), [(41.0, ["spin", "speed"]), (39.0, ["spin"])])
def test_a_further_variable_has_a_tenth_of_the_first(part, found):
    around: Any = Costs({SIDE: 400.0, SPEED: part})
    made = Combination().following(SIDE).following(SPEED).following(EVEN)
    assert [each.variable for each in dependences(around, made, 1.0)] == found


@pytest.mark.parametrize(("improvements", "followed"), [((5.0, -4.0, 3.0, -2.0), False),
                                                        ((5.0, 4.0, 3.0, 2.0), True)])  # fmt: skip
def test_a_variable_is_followed_if_the_throws_agree(improvements, followed):
    around: Any = Costs({SIDE: 400.0}, improvements)
    assert bool(dependences(around, Combination().following(SIDE), 1.0)) == followed


def test_whole_throws_follow_the_direction_and_no_place():
    def followed(variable, share):
        return Dependence(variable=variable, share=share, p=0.01, push="along").followed

    assert followed("y", 0.0) == "direction"
    assert followed("y", 0.2) == "y"
    assert followed("speed", 0.0) == "speed"


def test_a_search_changes_one_term_at_a_time():
    around: Any = Costs({})
    made = Combination(effects=frozenset(["slope"])).following(SPEED)
    moves = _moves(around, made, held=False)
    changed = [(set(m.effects), dict(m.pushes)) for m in moves]
    assert changed[:3] == [
        (set(), {SPEED: 1.0}),
        ({"slope", "curl"}, {SPEED: 1.0}),
        ({"slope"}, {}),
    ]
    further = [pushes for effects, pushes in changed[3:] if effects == {"slope"}]
    assert len(further) == len(changed) - 3
    assert further == [
        {SPEED: 1.0, push: scale} for push in (SIDE, SPIN, EVEN) for scale in (0.3, 1.0)
    ]
    held = [(set(m.effects), dict(m.pushes)) for m in _moves(around, made, held=True)]
    assert held == changed[2:]
    three = made.following(SIDE).following(SPIN)
    assert all(len(m.pushes) <= 3 for m in _moves(around, three, held=True))
    assert len(_moves(around, three, held=True)) == 3
    around.repeats = lambda m: SIDE in m.pushes
    assert len(_moves(around, made, held=True)) == 5


def test_a_search_takes_the_terms_that_pay_and_drops_the_others():
    around: Any = Costs({"slope": 500.0, SIDE: 300.0, SPEED: 15.0, "curl": 16.5})
    made, dispersion = search(around, ["curl", "slope"])
    # Curl and speed would gain less than one beyond what they need.
    assert made.effects == {"slope", "curl"}
    assert list(made.pushes) == [SIDE]
    assert dispersion == 1.0
    around = Costs({"slope": 500.0, SIDE: 300.0, "curl": 10.0})
    assert search(around, ["curl"])[0].effects == {"slope"}
    kept, _ = search(around, ["curl"], held=True)
    assert kept.effects == {"curl"}
    assert list(kept.pushes) == [SIDE]
    # Where noise is taken to be fifty times larger nothing of this pays.
    noisy: Any = Costs({"slope": 500.0, SIDE: 300.0}, dispersion=50.0)
    made, dispersion = search(noisy, [])
    assert made == Combination()
    assert dispersion == 50.0


@pytest.mark.parametrize(("beside", "left"), [(249.0, set()), (251.0, {"slope"})])
def test_an_effect_survives_if_half_of_its_gain_remains(beside, left):
    """Beside a push of the same kind, with which the search began or not."""

    class Beside(Costs):
        pushes = (Following("speed", "along"), Following("speed", "along the sheet"))

        def minimum_cost(self, made):
            gain = 500.0 if len(made.pushes) < 2 else beside
            return 1100.0 - gain * ("slope" in made.effects)

    around: Any = Beside({})
    made = Combination(effects=frozenset(["slope"])).following(Beside.pushes[0])
    assert surviving(around, made, 1.0).effects == left


@pytest.fixture
def explained(monkeypatch):
    """An explanation of a misfit, by costs around fits with given effects."""

    def find(costs: Costs, *effects: str, kept=()):
        rounds: list[list[str]] = []

        def around(fitted, optional, others):
            del others
            rounds.append([term.label for term in fitted.model.terms])
            costs.optional = (*optional, "curl")
            return costs

        def beside(_, made, __, ___, *, shaped):
            assert shaped
            labels = [*kept, *sorted(made.effects)]
            return fit_of(*labels)

        def fit_of(*labels) -> Any:
            terms = tuple(SimpleNamespace(label=label) for label in labels)
            return SimpleNamespace(session=None, model=SimpleNamespace(terms=terms))

        monkeypatch.setattr(explanation, "nearby", around)
        monkeypatch.setattr(explanation, "candidates", lambda *_: [])
        monkeypatch.setattr(explanation, "_fit_beside", beside)
        monkeypatch.setattr(explanation, "with_patches_relocated", lambda fitted: fitted)
        found = explain(fit_of(*kept, *effects), kept)
        return ([term.label for term in found.fit.model.terms], found.pushes), rounds

    return find


def test_an_explanation_is_sought_again_until_its_effects_stay(explained):
    costs = Costs({"curl": 300.0, SIDE: 400.0, "slope": 5.0})
    found, rounds = explained(costs, "slope", kept=("air_drag",))
    # Curl is taken in place of the slope, and what was given stays.
    assert found == (["air_drag", "curl"], (SIDE,))
    assert rounds == [["air_drag", "slope"], ["air_drag", "curl"]]


def test_an_explanation_that_does_not_settle_ends_after_three_more_rounds(explained):
    turns = iter(
        [
            {"slope": 300.0},
            {"curl": 300.0},
            {"slope": 300.0, "curl": 300.0},
            {"drag": 300.0},
            {"slope": 300.0},
        ]
    )

    class Changing(Costs):
        @property
        def optional(self):
            return ("slope", "curl", "drag")

        @optional.setter
        def optional(self, _):
            self.parts = next(turns)

    (labels, _), rounds = explained(Changing({}), "slope")
    assert len(rounds) == 4
    assert labels == ["drag"]
