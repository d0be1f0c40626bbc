"""Sentences of a discovery, and the numbers in them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import catalogue
from curling_env.sheet import PAPER_SHEET, TEE_Y, Direction
from friction_estimation.discovery import Dependence, Term, remarks, sentence, verdict
from friction_estimation.discovery.evidence.next_throws import TrialThrow, in_words
from friction_estimation.discovery.search.residuals import Misfit

STRENGTH = "curl", "strength"
EXPONENT = "curl", "speed_exponent"


def corrected(monkeypatch, values, errors, given) -> Any:
    """Return a discovery that corrects the curl of a given ice, and names sweeping beside it."""
    card = catalogue()["curl"]
    term = Term(card=card, values=values, free=tuple(name for _, name in errors))
    monkeypatch.setattr(verdict, "standard_errors", lambda _: errors)
    ice = Ice.uniform(0.009, effects=(ActiveEffect(name="curl", parameters=given),))
    states = np.array([[0, 0, 0, 2.0, 0, 1.5], [0, 0, 0, -2.0, 0, -1.5]])
    return SimpleNamespace(
        given=ice,
        effects=[SimpleNamespace(label="slope")],
        unknown=False,
        final=SimpleNamespace(model=SimpleNamespace(terms=(term,)), states=states),
        session=SimpleNamespace(gates=None, turns=np.array([True, True])),
        calibrations=(),
        fits_worse_than_uniform=False,
    )


@pytest.mark.parametrize(
    ("spread", "unknown", "listed"),
    [(0.044, False, True), (0.012, False, False), (0.044, True, False)],
)
def test_friction_that_scatters_in_the_last_fit_is_reported(spread, unknown, listed):
    found: Any = SimpleNamespace(
        effects=[SimpleNamespace(label="curl")],
        alternatives={},
        unknown=unknown,
        final=SimpleNamespace(model=SimpleNamespace(spread=spread)),
    )
    sentences = verdict.doubts(found)
    assert all("differs by 4 % from throw to throw" in one for one in sentences)
    assert bool(sentences) == listed


@pytest.mark.parametrize(
    ("strength", "sentences"),
    [
        (0.0100, ["In the given model, curl is 25 % stronger than given."]),
        (0.0060, ["In the given model, curl is 25 % weaker than given."]),
        (0.0, ["In the given model, the strength of curl is 0, not 0.008."]),
        (-0.004, ["In the given model, the strength of curl is -0.004, not 0.008."]),
        (0.0091, ["In the given model, curl is 14 % stronger than given."]),
        (0.0089, []),
    ],
)
def test_a_strength_is_corrected_if_three_standard_errors_say_so(monkeypatch, strength, sentences):
    values = {"strength": strength, "speed_exponent": 0.5, "spin_exponent": 0.0}
    errors = {STRENGTH: 3.5e-4, EXPONENT: 0.01}
    given = {"strength": 0.008, "speed_exponent": 0.2, "spin_exponent": 0.0}
    found = corrected(monkeypatch, values, errors, given)
    assert remarks(found) == sentences
    # A shape that is corrected is listed, and not spoken of.
    listed = {change["parameter"]: change["found"] for change in verdict.changes(found)}
    assert listed["speed_exponent"] == 0.5
    assert ("strength" in listed) == bool(sentences)


def test_sweeping_lengthens_or_shortens_a_draw():
    further = verdict.gain_in_words({"value": 1.234, "stderr": 0.1})
    assert further.endswith("runs 1.23 ± 0.10 m further")
    assert verdict.gain_in_words({"value": -0.5, "stderr": 0.1}).endswith("0.50 ± 0.10 m shorter")


@pytest.mark.parametrize(
    ("past", "words"),
    [
        (0.0, "to the tee line"),
        (-0.6, "to the tee line"),
        (0.7, "to the back of the house"),
        (-0.7, "to the top of the house"),
        (1.9, "through the house"),
        (-1.9, "to a guard"),
    ],
)
@pytest.mark.parametrize("direction", [Direction.AWAY, Direction.HOME])
def test_a_throw_is_called_by_where_it_comes_to_rest(past, words, direction):
    path = np.zeros((101, 6))
    path[:, 1] = direction * np.linspace(-TEE_Y, TEE_Y + past, 101)
    throw = TrialThrow(direction=direction, speed=2.0, spin=0.8, weight="draw weight")
    end = "away" if direction is Direction.AWAY else "home"
    assert f"down the centre line, {words} at the {end} end" in in_words(
        throw, path, PAPER_SHEET, ()
    )


def test_misfit_is_what_is_left_beyond_noise():
    misfit = Misfit(chi2=np.array([30.0, 100.0]), dof=np.array([20.0, 30.0]), throw_tolerance=2.0)
    assert misfit.excess == pytest.approx(80.0)
    assert misfit.ratio == pytest.approx(2.6)
    assert misfit.z == pytest.approx(8.0)
    assert misfit.surprise == pytest.approx([-5 / np.sqrt(40), 20 / np.sqrt(60)])
    assert not misfit.white
    noise = Misfit(chi2=np.array([21.0, 31.0]), dof=np.array([20.0, 30.0]))
    assert noise.white
    # Many rows prove a small excess, and few rows prove no large one.
    many = Misfit(chi2=np.array([2300.0]), dof=np.array([2000.0]))
    assert many.z > 4.0
    assert many.white == (many.ratio < many.tolerated)
    assert Misfit(chi2=np.array([12.0]), dof=np.array([6.0])).white


@pytest.mark.parametrize(
    ("shares", "words"),
    [
        ([0.5], " that follows the place along the sheet"),
        ([0.0], " that follows the direction of play"),
        ([], ", by which friction differs by 5 % from throw to throw"),
    ],
)
def test_an_unknown_is_described_by_what_it_follows(shares, words):
    """Whole throws that follow y follow no place, but the direction of play."""
    noise = Misfit(chi2=np.array([20.0]), dof=np.array([20.0]))
    found = SimpleNamespace(
        session=TwelveThrows(),
        enough=True,
        effects=[],
        unknown=True,
        dependences=[Dependence(variable="y", share=s, p=0.001, push="along") for s in shares],
        calibrations=(),
        events=[],
        gaps=dict.fromkeys(("before", "after", "noise_floor"), SimpleNamespace(rest_error=0.1)),
        after=noise,
        final=SimpleNamespace(model=SimpleNamespace(spread=0.05)),
    )
    assert sentence(found) == (
        f"The model lacks something unknown{words}: fresh throws stop 10 cm from the forecast, "
        "and a perfect model would be off by 10."
    )


class TwelveThrows:
    gates = None

    def __len__(self):
        return 12
