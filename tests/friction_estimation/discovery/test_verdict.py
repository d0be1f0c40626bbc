"""Sentences of a discovery, and the numbers in them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import catalogue
from curling_env.sheet import PAPER_SHEET, TEE_Y, Direction
from friction_estimation.discovery import (
    Dependence,
    Term,
    calibrate,
    neutral_values,
    read_reference,
    remarks,
    sentence,
    verdict,
    way_of,
)
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


def finding(**given: Any) -> Any:
    """A discovery in which twelve throws lack nothing, with other contents as given."""
    noise = Misfit(chi2=np.array([20.0]), dof=np.array([20.0]))
    found = {
        "session": TwelveThrows(), "enough": True, "effects": [], "alternatives": {},
        "unknown": False, "dependences": [], "calibrations": (), "events": [], "after": noise,
        "gaps": {key: SimpleNamespace(rest_error=value) for key, value in
                 (("before", 0.5), ("after", 0.1), ("noise_floor", 0.012))},
        "final": SimpleNamespace(model=SimpleNamespace(spread=0.005, terms=())), "given": None,
        "fits_worse_than_uniform": False,
    }  # fmt: skip
    return SimpleNamespace(**{**found, **given})


@pytest.fixture
def without_errors(monkeypatch):
    monkeypatch.setattr(verdict, "standard_errors", lambda _: {})


def named(*labels: str) -> list[Any]:
    return [SimpleNamespace(label=label) for label in labels]


def test_a_verdict_is_one_sentence_with_the_forecast_before_and_after(without_errors):
    nothing = "Nothing is missing: fresh throws "
    assert sentence(finding()) == f"{nothing}now stop 10 cm from the forecast, not 50."
    gaps = finding().gaps
    # A twentieth nearer is no progress.
    gaps["after"] = SimpleNamespace(rest_error=0.48)
    assert sentence(finding(gaps=gaps)) == (
        f"{nothing}stop 48 cm from the forecast, and a perfect model would be off by 1.2."
    )
    gaps["after"] = SimpleNamespace(rest_error=0.47)
    assert "now stop 47 cm" in sentence(finding(gaps=gaps))
    lacking = finding(effects=named("curl", "air_drag"), events=[3, 7, 9])
    assert sentence(lacking).startswith(
        "The model lacks curl and air drag, and a single event disturbed throw 3, 7 and 9: fresh "
    )
    timed = TwelveThrows()
    timed.gates = SimpleNamespace()
    assert "fresh throws now pass the last gate 10 cm" in sentence(finding(session=timed))


def test_distances_have_a_decimal_below_two_centimetres():
    assert [verdict._centimetres(v) for v in (0.04, 1.94, 2.0, 2.6, 37.2)] == [
        *("0.0", "1.9", "2", "3", "37"),
    ]


@pytest.mark.parametrize(
    ("throws", "words"), [(1, "1 throw slides freely"), (7, "7 throws slide freely")]
)
def test_of_too_few_throws_no_effect_is_named(throws, words):
    found = finding(enough=False, session=range(throws))
    assert sentence(found) == f"No effect is named: {words}, and naming one needs 8 or more."


def test_stones_of_one_effect_and_their_alternatives_are_named_once(without_errors):
    other = SimpleNamespace(name="slope", throw="a draw")
    found = finding(
        effects=named("stone_bias[1]", "stone_bias[4]", "curl"),
        alternatives={"curl": [other], "stone_bias[4]": [SimpleNamespace(name="curl", throw="")]},
    )
    stone, curl, slope = (
        (way.words if (way := way_of(name)) else "") for name in ("stone_bias", "curl", "slope")
    )
    assert verdict._missing_effects(found) == [f"{stone} or else {curl}", f"{curl} or else {slope}"]
    assert verdict.doubts(found) == [
        f"{stone[0].upper()}{stone[1:]} or {curl}? These throws do not decide.",
        f"{curl[0].upper()}{curl[1:]} or {slope}? These throws do not decide; this one would: "
        "a draw.",
    ]


def test_wrong_lengths_and_times_are_reported_as_too_long_or_too_short():
    def lengths(text, name="scale_error"):
        return calibrate(name, [read_reference(text, name)])

    given = lengths("20.53,20,0.01"), lengths("19,20,0.01", "frame_rate_error")
    assert verdict._off(finding(calibrations=given)) == [
        "all lengths in the tracks are 2.6 % too long by what was given",
        "all times in the tracks are 5.0 % too short by what was given",
    ]
    agrees = lengths("20.01,20,0.01")
    of_a_file = SimpleNamespace(clearly_off=True, references=(), name="scale_error", factor=1.2)
    assert verdict._off(finding(calibrations=(agrees, of_a_file))) == []


def test_an_unknown_that_scatters_is_described_by_its_scatter_if_nothing_else_is_left():
    def scatter(spread, **given):
        model = SimpleNamespace(spread=spread, terms=())
        return verdict.scatter_in_words(finding(final=SimpleNamespace(model=model), **given))

    assert scatter(0.031) == "friction differs by 3 % from throw to throw"
    assert scatter(0.0149) == ""
    rest = Misfit(chi2=np.array([900.0]), dof=np.array([200.0]))
    assert scatter(0.031, after=rest) == ""
    follows = Dependence(variable="t", share=0.5, p=0.001, push="along")
    assert scatter(0.031, dependences=[follows]) == ""


def test_variables_are_named_in_words():
    assert verdict.in_words("clock") == "the time of the session"
    assert verdict.in_words("speed") == "the speed"
    assert verdict._and(["a"]) == "a"
    assert verdict._and(["a", "b"]) == "a and b"
    assert verdict._and(["a", "b", "c"]) == "a, b and c"


def test_a_change_from_nothing_or_of_its_sign_has_no_per_cent():
    def words(before, after):
        change = {"name": "curl", "parameter": "strength", "given": before, "found": after}
        return verdict._change_in_words(change)

    assert words(0.01, 0.013) == "curl is 30 % stronger than given"
    assert words(-0.01, -0.007) == "curl is 30 % weaker than given"
    assert words(0.0, 0.0123) == "the strength of curl is 0.012, not 0"
    assert words(0.01, -0.01) == "the strength of curl is -0.01, not 0.01"
    factor = {"name": "sweeping", "parameter": "friction_factor", "given": 0.8, "found": 0.7}
    assert verdict._change_in_words(factor) == "sweeping is 50 % stronger than given"


def test_a_session_is_blind_to_what_all_its_throws_share():
    states = np.zeros((3, 6))
    states[:, 3], states[:, 5] = [2.0, -2.0, 2.0], [1.0, -1.0, 1.0]
    turns = np.array([True, True, True])

    def blind(states, turns=turns, terms=(), calibrations=(), gates=None, worse=False):
        return verdict.blind_spots(
            finding(
                final=SimpleNamespace(states=states, model=SimpleNamespace(terms=terms)),
                session=SimpleNamespace(turns=turns, gates=gates),
                calibrations=calibrations,
                fits_worse_than_uniform=worse,
            )
        )

    assert blind(states) == []
    one_way = states.copy()
    one_way[:, 3] = 2.0
    assert blind(one_way) == [verdict.ONE_WAY]
    one_spin = states.copy()
    one_spin[1, 5] = 0.5
    assert blind(one_spin) == [verdict.ONE_SPIN]
    # A spin that was not seen is no other spin.
    assert blind(states, np.array([True, False, True])) == [verdict.ONE_SPIN]
    assert blind(states, ~turns) == [verdict.NO_HEADING]
    assert blind(one_way, ~turns, gates=object()) == [verdict.ONE_WAY, verdict.GATES_SHOW]
    card = catalogue()["lens_distortion"]
    lens = Term(card=card, values=neutral_values(card), free=card.first)
    assert blind(states, terms=(lens,)) == [verdict.NO_SCENE]
    length = SimpleNamespace(name="scale_error")
    clock = SimpleNamespace(name="frame_rate_error")
    assert blind(states, terms=(lens,), calibrations=(length,)) == []
    assert blind(states, terms=(lens,), calibrations=(clock,)) == [verdict.NO_SCENE]
    assert blind(states, worse=True) == [verdict.OTHER_ICE]


def test_the_terminal_shows_the_verdict_and_one_next_throw():
    report = {"verdict": "V.", "doubts": ["D."], "remarks": ["R."]}
    assert verdict.terminal_text(report) == "V.\nD.\nR."
    following = [{"words": "a draw"}, {"words": "a guard"}]
    assert verdict.terminal_text({**report, "next_throws": following}).splitlines() == [
        *("V.", "D.", "R.", "Most informative next throw: a draw."),
    ]


def test_the_gain_of_sweeping_is_that_of_the_next_throw(monkeypatch):
    asked = []

    def gain(ice, **given):
        asked.append((ice, given))
        return SimpleNamespace(metres=1.23456789, stderr=0.0123456789)

    session = SimpleNamespace(
        clocks=np.array([60.0, 200.0, 120.0]),
        orders=np.array([4, 9, 7]),
        stones=np.array([1, 2, 3]),
    )
    found: Any = SimpleNamespace(session=session, improved_ice=lambda: "ice")
    monkeypatch.setattr(verdict, "sweeping_gain", gain)
    assert verdict.metres_gained(found) == {"value": 1.23457, "stderr": 0.0123457, "unit": "m"}
    assert asked == [("ice", {"clock": 200.0, "order": 10, "stone": 3})]
    monkeypatch.setattr(verdict, "sweeping_gain", lambda *_, **__: None)
    assert verdict.metres_gained(found) is None


@pytest.mark.parametrize(("effects", "corrected", "mentioned"), [
    (("sweeping",), (), True), (("curl",), (), False), ((), ("sweeping",), True),
    ((), ("curl",), False),
])  # fmt: skip
def test_what_sweeping_gains_is_remarked_where_it_is_named_or_corrected(
    monkeypatch, effects, corrected, mentioned
):
    strengths = {"sweeping": "friction_factor", "curl": "strength"}
    listed = [{"name": name, "parameter": strengths[name]} for name in corrected]
    monkeypatch.setattr(verdict, "changes", lambda _: listed)
    monkeypatch.setattr(verdict, "_corrections", lambda _: [])
    monkeypatch.setattr(verdict, "blind_spots", lambda _: ["B."])
    gain = {"value": 1.0, "stderr": 0.1}
    monkeypatch.setattr(verdict, "metres_gained", lambda _: gain)
    found = remarks(finding(effects=named(*effects)))
    assert found[-1] == "B."
    assert len(found) == (2 if mentioned else 1)
    if mentioned:
        assert found[0].startswith("A draw swept over the last third of its path runs 1.00")
    monkeypatch.setattr(verdict, "metres_gained", lambda _: None)
    assert remarks(finding(effects=named(*effects))) == ["B."]


def test_corrections_are_remarked_beside_effects_and_else_are_the_verdict(monkeypatch):
    monkeypatch.setattr(verdict, "changes", lambda _: [])
    monkeypatch.setattr(verdict, "_corrections", lambda _: ["curl is stronger", "slope is weaker"])
    monkeypatch.setattr(verdict, "blind_spots", lambda _: [])
    words = "In the given model, curl is stronger and slope is weaker."
    assert remarks(finding(effects=named("air_drag"))) == [words]
    assert remarks(finding(unknown=True)) == [words]
    assert remarks(finding()) == []
    assert sentence(finding()).startswith(
        "Nothing is missing, but curl is stronger and slope is weaker: fresh throws"
    )


def test_only_free_parameters_of_effects_that_were_given_are_corrected(monkeypatch):
    card, bias = catalogue()["curl"], catalogue()["stone_bias"]
    curl = Term(card=card, values=neutral_values(card, strength=0.5), free=("strength",))
    stone = Term(card=bias, values=neutral_values(bias, stone=2.0, factor=1.5), free=("factor",))
    given = Ice.uniform(
        0.009,
        effects=(
            ActiveEffect(name="stone_bias", parameters={"stone": 2.0, "factor": 1.1}),
            ActiveEffect(name="curl", parameters={"strength": 0.004, "speed_exponent": 9.0}),
        ),
    )
    errors = {("curl", "strength"): 1e-4, (stone.label, "factor"): 1e-4}
    monkeypatch.setattr(verdict, "standard_errors", lambda _: errors)
    final = SimpleNamespace(model=SimpleNamespace(terms=(curl, stone)))
    assert verdict.changes(finding(final=final, given=given)) == [
        {"name": "curl", "parameter": "strength", "given": 0.004, "found": 0.5, "stderr": 1e-4}
    ]
    assert verdict.changes(finding(final=final)) == []
