from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest

from curling_env.physics import catalogue
from friction_estimation.discovery import (
    Term,
    base_model,
    candidates,
    find_patches,
    fit_with_noise,
    neutral_values,
    open_session,
    refit,
    score_candidates,
    try_term,
)
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.search import selection
from friction_estimation.discovery.search.selection import (
    CandidateScore,
    Trial,
    best_trials,
    prune,
    refine,
    select,
    with_patches_relocated,
)

from ..conftest import effect


def test_the_hidden_effect_comes_first(make_session):
    session = open_session(make_session([effect("curl", strength=0.005)]))
    fitted = fit_with_noise(base_model(None, session), session)
    scores = score_candidates(fitted, candidates(fitted.session))
    assert scores[0].term.name == "curl"
    assert all(value > 0 for score in scores for value in score.smallest.values())


def test_the_patch_is_found_where_it_is(make_session):
    patch = effect("friction_patch", x_min=-3.0, x_max=3.0, y_min=-4.0, y_max=0.0, factor=1.2)
    session = open_session(make_session([patch]))
    fitted = fit_with_noise(base_model(None, session), session)
    (found,) = find_patches(fitted)
    assert abs(found.values["y_min"] + 4.0) < 1.6
    assert abs(found.values["y_max"]) < 1.6
    # One that was misplaced, while something else was missing, is sought again.
    misplaced = found.with_values(y_min=-0.6, y_max=-0.3, factor=2.0)
    beside = refit(fitted, fitted.model.with_terms(misplaced))
    again = with_patches_relocated(beside)
    assert again.deviance < beside.deviance - 100.0
    placed = again.model.term(found.label).values
    assert abs(placed["y_min"] + 4.0) < 0.5
    assert abs(placed["factor"] - 1.2) < 0.02


def test_a_finer_law_of_friction_is_reached_from_the_power_law(make_session):
    """At the same parameters its level is far from that of the power law."""
    law = effect("speed_dependent_friction", exponent=1.0, speed_offset=0.9, share=0.6)
    session = open_session(make_session([law], throws=10))
    (power,) = [t for t in candidates(session) if t.label == "speed_dependent_friction"]
    plain = fit_with_noise(base_model(None, session).with_terms(power), session)
    finer = refine(plain)
    assert finer.deviance < plain.deviance - 1000.0
    found = finer.model.term("speed_dependent_friction").values
    assert found["speed_offset"] == pytest.approx(0.9, abs=0.1)
    assert found["share"] == pytest.approx(0.6, abs=0.05)


def test_a_term_that_does_not_pay_is_dropped_and_others_stay(make_session):
    session = open_session(make_session([effect("curl", strength=0.005)], throws=8))
    bare = fit_with_noise(base_model(None, session), session)
    terms = {term.label: term for term in candidates(session)}
    both = refit(bare, bare.model.with_terms(terms["curl"], terms["slope"]))
    assert [term.label for term in prune(both, set()).model.terms] == ["curl"]
    assert [term.label for term in prune(both, {"slope"}).model.terms] == ["curl", "slope"]
    # The weakest goes first, after which another may pay.
    three = refit(both, both.model.with_terms(terms["air_drag"]))
    cost = {
        label: refit(three, three.model.without(label)).deviance for label in ("slope", "air_drag")
    }
    left = [term.label for term in prune(three, {"curl"}).model.terms]
    assert left == ["curl", max(cost, key=lambda label: cost[label])]


@pytest.mark.parametrize(("exponent", "freed"), [(0.2, False), (1.0, True)])
def test_the_shape_of_an_effect_is_fitted_where_that_pays(make_session, exponent, freed):
    curl = effect("curl", strength=0.005, speed_exponent=exponent, spin_exponent=0.0)
    session = open_session(make_session([curl], throws=8))
    fitted = fit_with_noise(base_model(None, session), session)
    (term,) = [t for t in candidates(session) if t.label == "curl"]
    trial = try_term(fitted, term)
    assert (trial.term.free != term.free) == freed
    assert trial.cost == (3 if freed else 1)
    if freed:
        assert trial.term.values["speed_exponent"] == pytest.approx(exponent, abs=0.1)


def test_a_candidate_of_no_use_is_fitted_no_further(make_session, monkeypatch):
    session = open_session(make_session(throws=8))
    fitted = fit_with_noise(base_model(None, session), session)
    (drag,) = [t for t in candidates(session) if t.label == "air_drag"]
    fits: list[float] = []

    def counted(*args, **choices):
        fits.append(choices.get("goal"))
        return refit(*args, **choices)

    monkeypatch.setattr(selection, "refit", counted)
    trial = try_term(fitted, drag)
    assert trial.gain < 4.0
    assert trial.gain < trial.needed
    assert fits == [fitted.deviance - 4.0]


def test_a_selection_that_is_full_tries_nothing_more(make_session, monkeypatch):
    monkeypatch.setattr(selection, "MOST_EFFECTS", 0)
    session = open_session(make_session([effect("curl", strength=0.005)], throws=8))
    fitted = fit_with_noise(base_model(None, session), session)
    found = select(fitted)  # the residuals are no noise, and no effect may be added
    (only,) = found.rounds
    assert (only.chosen, only.trials) == ("", [])
    assert only.scores[0].term.name == "curl"
    monkeypatch.setattr(selection, "MOST_EFFECTS", 1)
    monkeypatch.setattr(selection, "MOST_ADDITIONS", 0)
    (only,) = select(fitted).rounds  # the limits of detection are known all the same
    assert (only.chosen, only.trials) == ("", [])
    assert only.scores[0].smallest
    monkeypatch.setattr(selection, "MOST_ADDITIONS", 6)
    rounds = select(fitted).rounds
    assert rounds[0].chosen == "curl"
    assert rounds[-1].trials  # after curl they are noise


# --- decisions, with fits whose deviances are given ----------------------------------------------


@dataclass(frozen=True)
class Given:
    """A fit of which only the model and the deviance are known."""

    model: Model
    deviance: float
    session: Any = None
    residuals: Any = None
    noise: Any = None


ANY_ICE: Any = SimpleNamespace()
BARE = Given(Model(ice=ANY_ICE), 1000.0)


def of_card(name: str, **search: Any) -> Term:
    card = catalogue()[name]
    card = replace(card, search=replace(card.search, **search))
    return Term(card=card, values=neutral_values(card), free=card.first)


@pytest.fixture
def deviances(monkeypatch):
    """Make fits of given deviances, by the free parameters of the last term and a value of it."""
    asked: list[tuple[Any, float]] = []

    def give(found: dict[Any, float], value: str = ""):
        def given(fitted, model, *, goal=0.0, **_):
            term = model.terms[-1]
            key = (term.free, term.values[value]) if value else term.free
            asked.append((key, goal))
            return replace(fitted, model=model, deviance=found[key])

        monkeypatch.setattr(selection, "refit", given)
        return asked

    return give


CURL_FIRST = ("strength",)
CURL_SHAPED = ("strength", "speed_exponent", "spin_exponent")


@pytest.mark.parametrize(
    ("shaped", "gain", "cost"),
    [(984.0, 16.0, 3), (987.0, 10.0, 1), (985.9, 14.1, 3), (986.0, 10.0, 1)],
)
def test_a_shape_is_taken_if_it_gains_two_for_each_parameter(deviances, shaped, gain, cost):
    curl = of_card("curl", shape=("speed_exponent", "spin_exponent"))
    asked = deviances({CURL_FIRST: 990.0, CURL_SHAPED: shaped})
    trial = try_term(BARE, curl)
    assert (trial.gain, trial.cost) == (pytest.approx(gain), cost)
    assert trial.term.free == (CURL_SHAPED if cost == 3 else CURL_FIRST)
    assert asked == [(CURL_FIRST, 996.0), (CURL_SHAPED, 986.0)]


def test_a_shape_is_not_tried_below_the_gain_of_a_parameter(deviances):
    curl = of_card("curl", shape=("speed_exponent",))
    asked = deviances({CURL_FIRST: 996.5})
    trial = try_term(BARE, curl)
    assert (trial.gain, trial.cost) == (3.5, 1)
    assert len(asked) == 1


@pytest.mark.parametrize(
    ("first", "other", "gain", "cost", "tries"),
    [
        (998.0, 950.0, 50.0, 2, 2),  # the first start led nowhere
        (998.0, 999.0, 2.0, 1, 2),  # the other is worse
        (998.0, 998.0, 2.0, 1, 2),  # the other is no better, and costs a parameter
    ],
)
def test_of_two_starts_the_better_one_is_taken(deviances, first, other, gain, cost, tries):
    curl = of_card("curl", shape=("speed_exponent",), other_start={"strength": 0.02})
    neutral, both = curl.values["strength"], ("strength", "speed_exponent")
    found = {(CURL_FIRST, neutral): first, (both, 0.02): other}
    asked = deviances(found, "strength")
    trial = try_term(BARE, curl)
    assert (trial.gain, trial.cost) == (pytest.approx(gain), cost)
    assert trial.term.values["strength"] == (0.02 if cost == 2 else neutral)
    assert len(asked) == tries
    assert asked[-1][1] == first  # it must do better than the first


def test_where_the_first_start_is_good_no_other_is_tried(deviances):
    curl = of_card("curl", shape=("speed_exponent",), other_start={"strength": 0.02})
    both = ("strength", "speed_exponent")
    asked = deviances({CURL_FIRST: 980.0, both: 970.0})
    trial = try_term(BARE, curl)
    assert (trial.gain, trial.cost) == (30.0, 2)
    assert trial.term.values["strength"] == curl.values["strength"]
    assert [free for free, _ in asked] == [CURL_FIRST, both]


@pytest.mark.parametrize(("shaped", "gain"), [(940.0, 60.0), (950.5, 50.0)])
def test_sides_that_were_searched_for_count_even_if_they_are_not_fitted(deviances, shaped, gain):
    patch = of_card("friction_patch")
    assert len(patch.card.search.area) == 4
    later = tuple(n for n in patch.card.search.shape if n not in patch.free)
    fitted = 950.0
    asked = deviances({patch.free: fitted, (*patch.free, *later): shaped})
    trial = try_term(BARE, patch)
    assert (trial.gain, trial.cost) == (gain, 5)
    assert len(asked) == (2 if later else 1)


def trial_of(label_card: str, gain: float, cost: int = 1) -> Trial:
    term = of_card(label_card)
    given: Any = replace(BARE, model=BARE.model.with_terms(term), deviance=1000.0 - gain)
    return Trial(term=term, fit=given, gain=gain, cost=cost)


def test_further_parameters_must_gain_four_each():
    trial = trial_of("curl", 30.0, cost=3)
    assert trial.needed == 24.0
    assert trial.net == 22.0


def test_the_most_promising_candidates_are_fitted_and_the_best_goes_first(monkeypatch):
    names = ("curl", "slope", "air_drag", "spin_drag", "sweeping", "time_drift")
    gains = dict(zip(names, (90.0, 80.0, 70.0, 60.0, 50.0, 3.9), strict=True))
    nets = {"curl": 1.0, "slope": 5.0, "air_drag": 3.0, "spin_drag": 2.0, "friction_patch": 4.0}

    def tried(_, term):
        return trial_of(term.name, nets[term.name])

    def labels(scores, found):
        monkeypatch.setattr(selection, "find_map", lambda _: found)
        return [trial.term.name for trial in best_trials(BARE, scores)]

    monkeypatch.setattr(selection, "try_term", tried)
    monkeypatch.setattr(selection, "find_patches", lambda _: [of_card("friction_patch")])
    scores = [CandidateScore(term=of_card(n), gain=g, smallest={}) for n, g in gains.items()]
    best = ["slope", "friction_patch", "air_drag", "spin_drag", "curl"]
    assert labels(scores, None) == best
    field = of_card("time_drift")
    nets["time_drift"] = 9.0
    assert labels(scores, (field, 3.9)) == best
    assert labels(scores, (field, 4.1)) == ["time_drift", *best]
    # Below the gain of a parameter only those are fitted that have another start.
    assert labels(scores[-1:], None) == ["friction_patch"]
    other = of_card("time_drift", other_start={"rate": 1.0})
    hopeful = CandidateScore(term=other, gain=0.1, smallest={})
    assert labels([hopeful], None) == ["time_drift", "friction_patch"]


@pytest.fixture
def endless(monkeypatch):
    """A selection in which every round finds another effect worth its parameter."""
    names = iter(["curl", "slope", "air_drag", "spin_drag", "sweeping", "time_drift", "stone_bias"])
    white = {"is": True}

    def further(fitted, _):
        term = of_card(next(names))
        better = replace(fitted, model=fitted.model.with_terms(term), deviance=0.0)
        return [Trial(term=term, fit=better, gain=20.0, cost=1)]

    monkeypatch.setattr(selection, "score_candidates", lambda *_: [])
    monkeypatch.setattr(selection, "candidates", lambda *_: [])
    monkeypatch.setattr(selection, "best_trials", further)
    monkeypatch.setattr(selection, "misfit_of", lambda _: SimpleNamespace(white=white["is"]))
    monkeypatch.setattr(selection, "estimate_noise", lambda *_, start: start)
    monkeypatch.setattr(selection, "refit", lambda fitted, model: replace(fitted, model=model))
    for name in ("renew_map", "refine"):
        monkeypatch.setattr(selection, name, lambda fitted: fitted)
    monkeypatch.setattr(selection, "prune", lambda fitted, _: fitted)
    return white


def test_a_selection_adds_six_effects_at_most(endless):
    found = select(BARE)
    assert [r.chosen for r in found.rounds] == [
        *("curl", "slope", "air_drag", "spin_drag", "sweeping", "time_drift"), "",
    ]  # fmt: skip
    assert len(found.best.model.terms) == 6
    assert found.base.model.terms == ()


def test_after_four_effects_that_leave_more_than_noise_no_other_is_added(endless):
    endless["is"] = False
    steps: list[tuple[float, float]] = []
    found = select(BARE, progress=lambda _, done, total=1.0: steps.append((done, total)))
    assert [r.chosen for r in found.rounds] == ["curl", "slope", "air_drag", "spin_drag", ""]
    assert steps == [(k, 7) for k in range(5)]


def test_candidates_that_gain_just_what_is_needed_are_not_taken(endless, monkeypatch):
    monkeypatch.setattr(
        selection, "best_trials", lambda *_: [trial_of("curl", 16.0), trial_of("slope", 15.0)]
    )
    found = select(BARE)
    assert [r.chosen for r in found.rounds] == [""]
    assert len(found.rounds[0].trials) == 2


def test_without_candidates_there_are_no_scores():
    assert selection.score_candidates(BARE, []) == []


@pytest.mark.parametrize(
    ("first", "second", "taken"),
    [
        (975.0, 960.0, "second"),  # the better of two finer forms
        (979.0, 985.0, "first"),  # it gains the 20 that one parameter and a further one need
        (981.0, 985.0, ""),
        (970.0, 975.0, "first"),  # the second is better than none, but not than the first
    ],
)
def test_the_best_finer_form_is_taken_if_it_pays(monkeypatch, first, second, taken):
    starts = (
        {"speed_exponent": 0.3, "spin_exponent": 0.1},
        {"speed_exponent": 0.9, "spin_exponent": 0.2},
        {"strength": 0.5},  # it names nothing that is not fitted
    )
    curl = of_card("curl", finer=lambda _: starts)
    begin = replace(BARE, model=BARE.model.with_terms(curl))
    goals = []

    def given(fitted, model, *, iterations, goal):
        exponent = model.terms[-1].values["speed_exponent"]
        goals.append(goal)
        return replace(fitted, model=model, deviance=first if exponent == 0.3 else second)

    monkeypatch.setattr(selection, "refit", given)
    monkeypatch.setattr(selection, "place_sides", lambda fitted: fitted)
    monkeypatch.setattr(selection, "_at_its_level", lambda _, model: model)
    found = refine(begin)
    (term,) = found.model.terms
    if taken:
        assert term.free == ("strength", "speed_exponent", "spin_exponent")
        assert term.values["speed_exponent"] == (0.3 if taken == "first" else 0.9)
        assert found.deviance == (first if taken == "first" else second)
    else:
        assert found is begin
    assert goals == [980.0, min(980.0, first)]


@pytest.mark.parametrize(
    ("losses", "left"),
    [
        ({"curl": 16.1, "slope": 20.1}, {"curl", "slope"}),
        ({"curl": 15.9, "slope": 20.1}, {"slope"}),
        ({"curl": 16.1, "slope": 19.9}, {"curl"}),  # a slope has two parameters
        ({"curl": 5.0, "slope": 4.0, "air_drag": 99.0}, {"air_drag"}),
        ({"curl": 5.0, "slope": 4.0}, {"curl"}),  # the last one is for the selection to judge
    ],
)
def test_terms_below_what_they_need_are_dropped_the_weakest_first(monkeypatch, losses, left):
    terms = [of_card(name) for name in losses]
    begin = replace(BARE, model=BARE.model.with_terms(*terms))

    def without(fitted, term, goal):
        assert goal == fitted.deviance + 16.0 + 4.0 * (len(term.free) - 1)
        model = fitted.model.without(term.label)
        return replace(fitted, model=model, deviance=fitted.deviance + losses[term.name])

    monkeypatch.setattr(selection, "_without", without)
    found = prune(begin, set())
    assert {term.label for term in found.model.terms} == left
    # Terms of the given model stay, and do not count as others.
    kept = prune(begin, set(losses))
    assert kept is begin
