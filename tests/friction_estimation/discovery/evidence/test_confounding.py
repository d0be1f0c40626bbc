"""Alternatives to an effect, among fits whose gains are given."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.physics import catalogue
from curling_env.sheet import HOG_LINE_Y, PAPER_SHEET, TEE_Y, Direction
from friction_estimation.discovery import Term, neutral_values
from friction_estimation.discovery.evidence import confounding
from friction_estimation.discovery.evidence.confounding import alternatives, separating_throw
from friction_estimation.discovery.evidence.next_throws import TrialThrow
from friction_estimation.discovery.search.selection import CandidateScore, Trial

from ..conftest import plain_session


def of_effect(name: str, **values: float) -> Term:
    card = catalogue()[name]
    return Term(card=card, values=neutral_values(card, **values), free=card.first)


@pytest.fixture
def rivals(monkeypatch):
    """The alternatives to curl, which gains 200, among candidates of given scores and gains."""

    def find(*given: tuple[Term, float, float], cost: int = 1) -> list[str]:
        model = SimpleNamespace(without=lambda _: SimpleNamespace(terms=()))
        fitted: Any = SimpleNamespace(deviance=500.0, model=model, session=None)
        without = SimpleNamespace(deviance=700.0, model=SimpleNamespace(terms=()))
        gains = {term.label: gain for term, _, gain in given}
        monkeypatch.setattr(confounding, "without_term", lambda *_: without)
        monkeypatch.setattr(confounding, "candidates", lambda *_: [])
        monkeypatch.setattr(
            confounding,
            "score_candidates",
            lambda *_: [CandidateScore(term=t, gain=score, smallest={}) for t, score, _ in given],
        )
        monkeypatch.setattr(
            confounding,
            "try_term",
            lambda _, term: Trial(term=term, fit=fitted, gain=gains[term.label], cost=cost),
        )
        monkeypatch.setattr(confounding, "separating_throw", lambda *_: ("a draw", 7.0))
        found = alternatives(fitted, "curl")
        assert all((each.throw, each.strength) == ("a draw", 7.0) for each in found)
        return [each.name for each in found]

    return find


def test_an_alternative_gains_nearly_as_much_as_the_effect(rivals):
    slope = of_effect("slope")
    assert rivals((slope, 190.0, 185.0)) == ["slope"]
    assert rivals((slope, 190.0, 183.0)) == []  # worse by 17: the throws rule it out
    assert rivals((slope, 190.0, 184.0)) == []
    # A score is linear: it may be a fifth too low, and the fit says more.
    assert rivals((slope, 165.0, 199.0)) == ["slope"]
    assert rivals((slope, 155.0, 199.0)) == []


def test_an_effect_is_no_alternative_to_itself_and_three_are_enough(rivals):
    names = ("slope", "spin_drag", "air_drag", "time_drift")
    others = [(of_effect(name), 195.0 - k, 195.0) for k, name in enumerate(names)]
    assert rivals((of_effect("curl"), 199.0, 199.0), *others) == list(names[:3])


def test_an_alternative_must_pay_for_its_parameters(rivals):
    slope = of_effect("slope")
    assert rivals((slope, 190.0, 195.0), cost=44) == ["slope"]  # 16 and 43 times 4
    assert rivals((slope, 190.0, 195.0), cost=46) == []


def test_gates_would_not_see_a_throw_that_separates_two_effects():
    fitted: Any = SimpleNamespace(session=SimpleNamespace(gates=SimpleNamespace()))
    assert separating_throw(fitted, fitted) == ("", 0.0)


def test_the_throw_that_separates_two_models_differs_most_of_those_that_can_be_made(monkeypatch):
    """By what is left of its path, and of the information on its friction."""
    throws = [
        TrialThrow(direction=Direction.AWAY, speed=2.0, spin=spin, weight="draw weight")
        for spin in (0.8, 2.2, -0.8, -2.2)
    ]
    ends = np.array([TEE_Y, TEE_Y, TEE_Y, 0.0])  # the last one is a hog
    grams, log_terms = np.zeros((4, 2, 2)), np.array([1.0, 2.0, 9.0, 0.0])
    grams[:, -1, -1] = [10.0, 30.0, 20.0, 99.0]
    fitted_to = []

    def predicted(model, session, states, ln_factors):
        assert model == "one"
        assert ln_factors.tolist() == [0.0] * 4
        rows = session.rows(0).stop
        path = np.zeros((4 * rows, 6))
        for k, end in enumerate(ends):
            own = path[session.rows(k)]
            own[:, 1] = np.linspace(-HOG_LINE_Y, end, rows)
            own[:, 3] = np.where(np.arange(rows) < rows // 2, 1.5, 0.0)
        return path

    def adapted(model, session, noise, *, states, shared):
        assert (model, noise, shared) == ("other", "noise", False)
        fitted_to.append(session)
        return SimpleNamespace(linear=SimpleNamespace(each=lambda: (grams, log_terms)))

    monkeypatch.setattr(confounding, "trial_throws", lambda *_: throws)
    monkeypatch.setattr(confounding, "predict", predicted)
    monkeypatch.setattr(confounding, "fit", adapted)
    monkeypatch.setattr(confounding, "noise_of_rows", lambda _: "noise")

    class Named(str):
        ice = SimpleNamespace(sheet=PAPER_SHEET)
        terms = ()

    one: Any = SimpleNamespace(session=plain_session(), model=Named("one"))
    other: Any = SimpleNamespace(model=Named("other"))
    words, strength = separating_throw(one, other)
    assert strength == 32.0
    assert "quick out-turn" in words
    assert "to the tee line at the away end" in words
    (session,) = fitted_to
    assert (np.diff(session.starts) == session.starts[1]).all()
    assert session.starts[1] == 64  # half of 32 s: at rest no row adds information
    assert session.xy[64, 1] == -HOG_LINE_Y
    ends[:] = 0.0
    assert separating_throw(one, other) == ("", 0.0)
