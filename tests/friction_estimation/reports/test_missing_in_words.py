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
