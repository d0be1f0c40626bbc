"""A discovery's report in plain words."""

from __future__ import annotations

import pytest

from curling_env.errors import InputError
from friction_estimation.reports import findings

REPORT = {
    "verdict": "The model lacks curl.",
    "effects": [
        {
            "name": "curl",
            "kind": "physics",
            "parameters": {"strength": {"value": 0.008, "stderr": 0.0001, "unit": "m/s²"}},
            "depends_on": [],
            "where": "paths bend to opposite sides; clearest in throws 1, 2, 3",
            "evidence": {"separating_throws": {"slope": "a throw back with the other handle"}},
            "alternatives": ["slope"],
        },
        {
            "name": "unknown",
            "kind": "unknown",
            "parameters": {},
            "depends_on": ["clock"],
            "where": "a push along that follows clock",
            "evidence": {},
            "alternatives": [],
        },
    ],
    "next_throws": [
        {
            "words": "draw weight (13.1 s hog to hog) towards the home end",
            "teaches": {"curl": 0.61, "slope": 0.2},
        }
    ],
    "gap": {},
}


def test_what_is_missing_and_what_would_settle_it():
    result = findings(REPORT)
    assert result.verdict == "The model lacks curl."
    curl, unknown = result.missing
    assert curl.title == "stones curl"
    assert curl.unsure == ("a slope of the ice",)
    assert curl.settled_by == "a throw back with the other handle"
    assert unknown.title == "something that no known effect explains"
    assert unknown.words == "stones slow down or bend differently by the time of the session"
    ((words, why),) = result.next_throws
    assert words.startswith("draw weight")
    assert why == "it removes 61 % of the uncertainty of curl"


def test_nothing_missing_is_no_fault():
    result = findings({"verdict": "Nothing is missing.", "effects": []})
    assert not result.missing
    assert result.next_throws == ()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"verdict": 3}, "verdict: expected text"),
        ({"effects": {}}, "effects: expected a list"),
        ({"effects": [{}]}, "effects[0]: missing name"),
    ],
)
def test_a_file_that_is_no_report_is_refused(change, complaint):
    with pytest.raises(InputError, match=complaint.replace("[", r"\[")):
        findings({**REPORT, **change})


def test_an_effect_without_words_of_its_own_is_described_by_what_it_follows():
    """Its sign comes first where there is one, and an unknown has none."""

    def shown(**given):
        (found,) = findings({"verdict": "V.", "effects": [{"name": "curl", **given}]}).missing
        return found

    both = shown(name="tracking_offset", depends_on=["speed", "t"])
    assert both.words == (
        "stones slow down or bend differently by the speed and the time since release"
    )
    assert shown(where="paths bend", depends_on=["t"]).words == "paths bend"
    unknown = shown(name="unknown", where="a push", depends_on=["x"])
    assert unknown.words == "stones slow down or bend differently by the line"
    assert shown(name="unknown", where="a push").words == "a push"


def test_a_throw_that_settles_is_the_separating_one_or_that_of_the_effect():
    def settled(**given):
        (found,) = findings({"verdict": "V.", "effects": [{"name": "curl", **given}]}).missing
        return found.settled_by

    throws = {"separating_throws": {"slope": "a draw", "air_drag": "a hit"}}
    assert settled(alternatives=["slope", "air_drag"], evidence=throws) == "a draw"
    assert settled(alternatives=["air_drag"], evidence=throws) == "a hit"
    usual = settled(alternatives=["sweeping"], evidence=throws)
    assert usual
    assert usual not in ("a draw", "a hit")
    assert settled(alternatives=["slope"], evidence={"separating_throws": 3}) == usual
    assert settled(evidence=throws) == ""
    assert settled(name="of somewhere else", alternatives=["slope"]) == ""


def test_a_next_throw_is_worth_what_it_teaches_most():
    report = {"verdict": "V.", "effects": [], "next_throws": [
        {"words": "a draw", "teaches": {"curl": 0.2, "air_drag": 0.456}}, {"words": "a guard"},
    ]}  # fmt: skip
    assert findings(report).next_throws == (
        ("a draw", "it removes 46 % of the uncertainty of air drag"),
        ("a guard", ""),
    )
