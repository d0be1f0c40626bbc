"""The sentences and numbers of a discovery's page, from hand-made reports."""

from __future__ import annotations

import re
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

from curling_env.ice import Ice
from curling_env.units import Units
from friction_estimation.reports import discovery_page as module


def cells(page: str) -> list[list[str]]:
    """Plain text of each row's cells."""
    rows = re.findall(r"<tr>(.*?)</tr>", page)
    texts = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]
    return [[re.sub(r"<[^>]+>", " ", text).strip() for text in row] for row in texts]


def effect(name: str = "curl", **other):
    given = {"parameters": {}, "evidence": {}, "depends_on": [], "where": "everywhere"}
    return {"name": name, **given, **other}


def report(**other):
    given = {
        "verdict": "The model lacks <curl>.",
        "effects": [],
        "doubts": [],
        "remarks": [],
        "undecidable": {"why": "a level of the sheet is no friction"},
        "candidates": [],
        "smallest_detectable": {},
        "baseline": {"mu": 0.0091234567, "mu_stderr": 0.0000345, "slow_misfit": 3.14159},
        "noise": {"position_m": 0.00321, "heading_rad": 0.0456, "memory_s": 0.567},
        "remaining": {"mu_spread": 0.01234, "slow_misfit": 1.0678},
        "left_out": [],
    }
    return given | other


def test_next_throws_are_numbered_with_what_they_teach():
    throws = [
        {"words": "a <draw>", "teaches": {"curl": 0.456, "air_drag": 0.2}},
        {"words": "a guard", "teaches": {}},
    ]
    _, first, second = cells(module._next({"next_throws": throws}))
    assert first == ["1", "a &lt;draw&gt;", "curl 46 %, air drag 20 %"]
    assert second == ["2", "a guard", ""]
    assert module._next({}) == module._next({"next_throws": []}) == ""


def test_an_effect_has_its_parameters_its_gain_and_what_it_follows():
    strength = {"value": 0.00654321, "stderr": 0.000234, "unit": "m/s²"}
    power = {"value": -0.25, "stderr": 0.1, "unit": "1"}
    gain = {"value": 2.347, "stderr": 0.2}
    _, curl, sweeping, unknown, bare = cells(
        module._effects(
            report(
                effects=[
                    effect(parameters={"strength": strength, "exponent": power}),
                    effect(
                        "stone_bias",
                        parameters={"force": power},
                        evidence={"metres_gained": gain, "label": "stone_bias[3]"},
                    ),
                    effect("unknown", depends_on=["speed", "x"], where="<here>"),
                    effect("unknown"),
                ]
            )
        )
    )
    assert curl[1] == "strength = 0.006543 ± 0.00023 m/s², exponent = -0.25 ± 0.1"
    assert curl[0].endswith("curl")
    assert sweeping[1] == (
        "force = -0.25 ± 0.1: a draw swept over the last third of its path runs 2.35 ± 0.20 m "
        "further"
    )
    assert unknown[1:] == ["follows speed, x", "&lt;here&gt;"]
    assert bare[1:] == ["—", "everywhere"]
    assert module._effects(report()) == ""


def test_questions_are_doubts_remarks_proxies_and_what_no_throw_shows():
    effects = [effect(evidence={"proxies": ["air_drag", "curl"]}), effect()]
    asked = module._open_questions(report(doubts=["D."], remarks=["R."], effects=effects))
    assert asked == [
        "D.",
        "R.",
        "Proxies that explain part of the unknown, none of them proved: air drag, curl.",
        "A level of the sheet is no friction",
    ]


def test_candidates_have_gain_need_and_p():
    rows = [
        {"name": "curl", "gain": 123.46, "needed": 11.6},
        {"name": "air_drag", "gain": -0.04, "needed": None},
    ]
    effects = [effect(evidence={"p": 0.00123})]
    _, curl, drag = cells(module._candidates(report(candidates=rows, effects=effects)))
    assert curl[1:] == ["123.5", "12", "0.0012"]
    assert drag == ["air drag", "-0.0", "", ""]
    assert module._candidates(report()) == ""


def test_smallest_effects_and_numbers_are_in_the_units_of_a_coach():
    smallest = report(smallest_detectable={"air_drag": {"a": 0.0123456, "b": 2.0}})
    assert cells(module._smallest(smallest))[1] == ["air drag", "a 0.0123, b 2"]
    assert module._smallest(report()) == ""
    page = module._numbers(report(left_out=["throw <3>: too short"]))
    assert [row[1] for row in cells(page)[1:]] == [
        *("0.009123 ± 3e-05", "1.23 %", "3.2 mm", "46 mrad", "0.57 s", "3.14", "1.07"),
    ]
    assert "<li>throw &lt;3&gt;: too short</li>" in page
    assert "Excluded" not in module._numbers(report())


def test_each_forecast_is_shown_with_its_error(monkeypatch):
    drawn = []
    monkeypatch.setattr(module, "paths_picture", lambda found, when: drawn.append(when) or when)
    monkeypatch.setattr(module, "picture", lambda content, alt, caption: f"[{content}|{caption}]")
    gaps = {"before": SimpleNamespace(rest_error=2.347), "after": SimpleNamespace(rest_error=0.12)}
    shown = module._paths(SimpleNamespace(gaps=gaps), Units.METRES)
    assert "[before|The model before: 2.35 m off.]" in shown
    assert "[after|The improved model: 12 cm off.]" in shown
    assert drawn == ["before", "after"]
    assert "5 in off" in module._paths(SimpleNamespace(gaps=gaps), Units.FEET)
    assert module._paths(SimpleNamespace(gaps={}), Units.METRES) == ""


def test_evidence_is_titled_by_its_effect():
    assert "<h2>Evidence for air drag</h2>" in module._residuals("air_drag", Figure(figsize=(1, 1)))
    assert "<h2>Unexplained by any known effect</h2>" in module._residuals(
        "unknown", Figure(figsize=(1, 1))
    )


def test_a_page_has_a_section_for_all_that_is_known(monkeypatch, tmp_path):
    monkeypatch.setattr(module, "residual_pictures", lambda _: [("curl", Figure(figsize=(1, 1)))])
    monkeypatch.setattr(
        module, "draw_picture", lambda *_: (Figure(figsize=(1, 1)), "A draw runs on.")
    )
    found = SimpleNamespace(gaps={}, improved_ice=lambda: Ice.uniform(0.009))
    whole = report(
        effects=[effect()],
        candidates=[{"name": "curl", "gain": 1.0, "needed": None}],
        next_throws=[{"words": "a draw", "teaches": {}}],
    )
    path = tmp_path / "report.html"
    module.write_report_page(found, whole, path, throws="<h2>The throws</h2>")
    page = path.read_text()
    assert "<h1>The model lacks &lt;curl&gt;.</h1>" in page
    assert re.findall(r"<h2>(.*?)</h2>", page) == [
        "What is missing",
        "What these throws cannot show",
        "The most informative next throws",
        "A draw on this ice",
        "The same draw",
        "Evidence for curl",
        "The throws",
        "The candidates",
        "Noise and baseline",
    ]
    assert page.count("<section>") == 5
    monkeypatch.setattr(module, "draw_picture", lambda *_: None)
    module.write_report_page(found, report(), path)
    page = path.read_text()
    assert "The same draw" not in page
    assert page.count("<section>") == 3


@pytest.mark.parametrize(("value", "way"), [(0.5, "further"), (-0.5, "shorter")])
def test_sweeping_against_its_purpose_is_shorter(value, way):
    gain = {"value": value, "stderr": 0.25}
    swept = effect(evidence={"metres_gained": gain})
    assert f"0.50 ± 0.25 m {way}" in module._effects(report(effects=[swept]))
