"""Numbers of a report, from findings that are given."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import catalogue
from friction_estimation.discovery import (
    CARD,
    Dependence,
    SessionNoise,
    Term,
    calibrate,
    neutral_values,
    read_reference,
)
from friction_estimation.discovery import report as reports
from friction_estimation.discovery.evidence.significance import EffectEvidence
from friction_estimation.discovery.search.residuals import Misfit
from friction_estimation.discovery.search.selection import CandidateScore


def of_effect(name: str, *free: str, **values: float) -> Term:
    card = catalogue()[name]
    return Term(card=card, values=neutral_values(card, **values), free=free or card.first)


def finding(**given: Any) -> Any:
    return SimpleNamespace(**{"calibrations": (), "dependences": [], "unproved": [], **given})


def test_a_named_effect_has_the_throws_in_which_it_is_clearest():
    effect = EffectEvidence(
        label="curl",
        gain=123.456789,
        p=1.23456789e-5,
        improvements=np.array([1.0, 9.0, -2.0, 4.0, 0.0, 8.0]),
    )
    other = SimpleNamespace(name="slope", throw="a draw")
    found = finding(
        final=SimpleNamespace(model=SimpleNamespace(term=lambda _: of_effect("curl"))),
        session=SimpleNamespace(throws=np.array([12, 10, 17, 14, 15, 11])),
        alternatives={"curl": [other]},
        closure=0.87654321,
        runner_up=lambda label: {"name": f"after {label}"},
    )
    shown = reports._named(found, effect, {("curl", "strength"): 0.0001})
    # Of throws 10, 11, 12, 14, 15, 17 in the order of play the second, fourth and last.
    assert shown["where"].endswith("; clearest in throws 11, 14, 17")
    assert shown["kind"] == "physics"
    assert shown["evidence"] == {
        "label": "curl",
        "gain": 123.457,
        "p": 1.23457e-5,
        "throws_improved": 4,
        "throws": 6,
        "closure": 0.876543,
        "runner_up": {"name": "after curl"},
        "separating_throws": {"slope": "a draw"},
    }
    assert shown["alternatives"] == ["slope"]
    assert shown["parameters"]["strength"]["stderr"] == 0.0001


def test_an_effect_has_its_fitted_parameters_and_those_without_a_usual_value():
    bias = of_effect("stone_bias", "factor", stone=4.0)
    assert reports._parameters(bias, {("stone_bias[4]", "factor"): 0.01}) == {
        "stone": (4.0, 0.0, bias.card.parameter("stone").unit),
        "factor": (1.0, 0.01, bias.card.parameter("factor").unit),
    }


def test_a_map_has_its_spread_where_stones_ran():
    class Field(SimpleNamespace):
        def __len__(self):
            return 8

    ln_mu = np.array([[0.1, -0.1], [9.0, 9.0]])
    field: Any = Field(ln_mu=ln_mu, crossed=np.array([0, 1]), length=2.0)
    shown = reports._parameters(Term(card=CARD, map_field=field), {})
    assert shown["spread"] == (pytest.approx(0.1), pytest.approx(0.1 / 4.0), "1")
    assert shown["length"] == (2.0, 0.5, "m")


def test_a_calibration_has_the_references_that_it_rests_on():
    scale = calibrate("scale_error", [read_reference("20.6,20,0.1", "scale_error")])
    shown = reports._calibration(scale)
    assert shown["kind"] == "measurement"
    assert shown["where"] == "every length in the tracks, according to the given length"
    assert shown["evidence"] == {
        "known": [{"measured": 20.6, "true": 20.0}],
        "standard_errors": 6.0,
    }
    assert shown["parameters"] == {"factor": {"value": 1.03, "stderr": 0.005, "unit": "1"}}


def test_what_was_not_checked_is_undecidable():
    scale = calibrate("scale_error", [read_reference("20,20", "scale_error")])
    clock = calibrate("frame_rate_error", [read_reference("20,20", "frame_rate_error")])
    neither = reports._undecidable(finding())
    assert neither["names"] == ["scale_error", "frame_rate_error"]
    assert "that all lengths or all times are off by a factor" in neither["why"]
    assert "--known-length" in neither["why"]
    assert " and an interval by a clock (--clock)." in neither["why"]
    one = reports._undecidable(finding(calibrations=(scale,)))
    assert one["names"] == ["frame_rate_error"]
    assert "that all times are off by a factor" in one["why"]
    both = reports._undecidable(finding(calibrations=(scale, clock)))
    assert both == {"names": [], "why": "lengths and times were checked against the given ones."}


def test_an_unknown_is_reported_by_what_it_follows_and_what_stood_for_it():
    after = Misfit(chi2=np.array([500.0]), dof=np.array([200.0]))
    spin = Dependence(variable="spin", share=0.7654321, p=1e-4, push="left")
    way = Dependence(variable="y", share=0.0, p=2e-4, push="along")
    found = finding(
        after=after, dependences=[spin, way], unproved=["stone_bias[1]", "stone_bias[2]", "slope"]
    )
    shown = reports._unknown(found)
    assert shown["where"] == "a push left that follows spin; a push along that follows direction"
    assert shown["depends_on"] == ["spin", "y"]
    assert shown["evidence"] == {
        "slow_misfit": 2.5,
        "tolerated": 1.25,
        "shares": {"spin": 0.765432, "y": 0.0},
        "p": {"spin": 1e-4, "y": 2e-4},
        "proxies": ["stone_bias", "slope"],
    }
    model = SimpleNamespace(spread=0.001)
    nothing = finding(after=after, final=SimpleNamespace(model=model))
    assert reports._unknown(nothing)["where"] == "no single variable stands out"
    events = reports._event(finding(events=[3, 8]))
    assert events["where"].startswith("only in throw 3, 8: ")
    assert events["evidence"] == {"throws": [3, 8]}


def test_candidates_that_were_fitted_go_first():
    """They are of the first round; the smallest detectable effects are of the last."""
    curl, slope, drag = (of_effect(name) for name in ("curl", "slope", "air_drag"))
    trial = SimpleNamespace(term=slope, gain=20.1234567, needed=20.0)
    scores = [CandidateScore(term=t, gain=g, smallest={"a": s}) for t, g, s in
              ((curl, 50.0, 0.1), (slope, 30.0, 0.2), (drag, 3.0, 0.3))]  # fmt: skip
    rounds = [SimpleNamespace(trials=[trial], scores=scores),
              SimpleNamespace(trials=[], scores=scores[2:])]  # fmt: skip
    found = finding(selection=SimpleNamespace(rounds=rounds))
    assert reports.ranked_candidates(found) == [
        {"name": "slope", "gain": 20.1235, "needed": 20.0},
        {"name": "curl", "gain": 50.0, "needed": None},
        {"name": "air_drag", "gain": 3.0, "needed": None},
    ]
    assert reports.smallest_detectable(found) == {"air_drag": {"a": 0.3}}


@pytest.fixture
def whole(monkeypatch):
    """A finding of which every part of a report is given."""
    for name, value in (("sentence", "V."), ("doubts", ["D."]), ("remarks", ["R."]),
                        ("changes", [])):  # fmt: skip
        monkeypatch.setattr(reports, name, lambda _, value=value: value)
    monkeypatch.setattr(reports, "standard_errors", lambda _: {("", "ln_mu"): 0.01})
    monkeypatch.setattr(reports, "with_sides", lambda _, errors: errors)
    noise = SessionNoise(white=(3e-3, 3e-3, 0.01), fading=(4e-3, 4e-3, 0.0), memory=(0.3, 0.4, 9.0))
    curl = of_effect("curl")
    base = SimpleNamespace(
        ice=Ice.uniform(0.009), ln_mu=0.1, ln_coupling=-0.2, spread=0.0123456789, terms=(curl,)
    )
    gap = SimpleNamespace(numbers=lambda: {"path_rms_m": 0.1})
    before = SimpleNamespace(ratio=3.0)
    return finding(
        effects=[], unknown=False, events=[],
        final_base=SimpleNamespace(model=base),
        final=SimpleNamespace(noise=noise, model=SimpleNamespace(spread=0.004)),
        gaps={"before": gap}, session=SimpleNamespace(throws=np.array([4, 6, 8]), left_out=("x",)),
        held_out=np.array([1]), closure=0.98765432, structure=("order", 0.0123456789),
        after=Misfit(chi2=np.array([30.0]), dof=np.array([20.0])),
        selection=SimpleNamespace(before=before, rounds=[SimpleNamespace(trials=[], scores=[])]),
    )  # fmt: skip


def test_a_report_has_friction_noise_and_what_is_left_in_numbers(whole):
    found = reports.document(whole, provenance={"version": "1"})
    mu = 0.009 * np.exp(0.1)
    assert found["verdict"] == "V."
    assert found["effects"] == []
    assert found["gap"] == {
        "before": {"path_rms_m": 0.1}, "held_out_throws": [6], "closure": 0.987654
    }  # fmt: skip
    base = found["baseline"]
    assert base["mu"] == pytest.approx(mu, rel=1e-5)
    assert base["mu_stderr"] == pytest.approx(0.01 * mu, rel=1e-5)
    assert base["mu_spread"] == 0.0123457
    coupling = Ice.uniform(0.009).stone.spin_coupling
    assert base["spin_coupling"] == pytest.approx(coupling * np.exp(-0.2), rel=1e-5)
    assert base["effects"] == ["curl"]
    assert base["slow_misfit"] == 3.0
    assert found["remaining"] == {
        "slow_misfit": 1.5, "white": True, "mu_spread": 0.004,
        "mu_follows": "order", "mu_follows_p": 0.0123457,
    }  # fmt: skip
    assert found["noise"] == {"position_m": 0.005, "heading_rad": 0.01, "memory_s": 0.4}
    assert found["left_out"] == ["x"]
    assert found["next_throws"] == []
    assert found["provenance"] == {"version": "1"}
    assert "provenance" not in reports.document(whole)


def test_a_report_lists_calibrations_an_unknown_and_events_beside_effects(whole):
    whole.calibrations = (
        calibrate("scale_error", [read_reference("21,20,0.1", "scale_error")]),
        calibrate("frame_rate_error", [read_reference("20,20", "frame_rate_error")]),
    )
    whole.unknown, whole.events = True, [8]
    following: Any = [SimpleNamespace(as_dict=lambda: {"words": "a draw"})]
    found = reports.document(whole, following)
    assert [effect["name"] for effect in found["effects"]] == ["scale_error", "unknown", "unknown"]
    assert found["effects"][1]["depends_on"] == []
    assert found["effects"][2]["depends_on"] == ["event"]
    assert found["next_throws"] == [{"words": "a draw"}]
    assert found["undecidable"]["names"] == []
    noise = whole.final.noise
    whole.final.noise = SessionNoise(white=noise.white, fading=(0.0, 0.0, 1.0), memory=noise.memory)
    assert reports.document(whole)["noise"]["memory_s"] == 0.0
