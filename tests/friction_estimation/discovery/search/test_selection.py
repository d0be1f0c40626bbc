from __future__ import annotations

import pytest

from friction_estimation.discovery import (
    base_model,
    candidates,
    find_patches,
    fit_with_noise,
    open_session,
    refit,
    score_candidates,
    try_term,
)
from friction_estimation.discovery.search import selection
from friction_estimation.discovery.search.selection import (
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
