"""Rows that agree keep agreeing, and every other one is explained."""

from __future__ import annotations

import pytest

from curling_env.ice import load_ice
from curling_env.validation import (
    ICE_ROWS,
    OTHER_ROWS,
    Verdict,
    as_text,
    compare,
    counts,
    in_words,
    preset_of,
)

ROWS = (*ICE_ROWS, *OTHER_ROWS)
PASS_ON_STANDARD = {
    "friction at 0.2 to 0.3 m/s",
    "friction at 2.1 to 2.2 m/s",
    "steepness: −d ln μ / d ln v from 0.25 to 2.15 m/s",
    "greatest friction, at 0.1 m/s",
    "least friction, at 2.2 m/s",
    "draw, hog to hog",
    "draw, hog to tee",
    "hog to tee on old slow ice, 12.25 s hog to hog",
    "turns of a draw released at 0.9 rad/s",
    "largest over smallest curl, spins 0.9 to 2.6 rad/s",
    "the same swept, on ice scaled to 5.84 m",
}
PASS_ON_FITTED = PASS_ON_STANDARD | {"its turns, on ice scaled to its distance", "curl of a draw"}
PASS_ON_FCV1 = PASS_ON_STANDARD - {
    "friction at 0.2 to 0.3 m/s",
    "greatest friction, at 0.1 m/s",
} | {
    "its turns, on ice scaled to its distance",
    "hog to tee where a draw is 14.0 s hog to hog",
    "speed of a fully hit stone over the thrown stone's",
    "energy kept in a full hit",
}  # fmt: skip

PASS_ON_CLUB = PASS_ON_STANDARD - {
    "friction at 0.2 to 0.3 m/s",
    "friction at 2.1 to 2.2 m/s",
    "draw, hog to tee",
} | {
    "distance of a stone at 2.09 m/s and 1.01 rad/s",
    "its curl, on ice scaled to its distance",
    "speed kept from hog line to hog line, in 12.8 s",
}  # fmt: skip


@pytest.mark.parametrize(
    ("preset", "passing"),
    [
        ("standard", PASS_ON_STANDARD),
        ("fitted", PASS_ON_FITTED),
        ("club", PASS_ON_CLUB),
        ("fcv1", PASS_ON_FCV1),
    ],
)
def test_the_rows_that_pass(preset: str, passing: set[str]) -> None:
    found = compare(load_ice(preset), preset)
    assert {c.row.name for c in found if c.verdict is Verdict.AGREES} == passing
    assert [c.row.name for c in found if c.verdict is Verdict.DIFFERS] == []


def test_rows_of_no_ice_agree() -> None:
    for comparison in compare(load_ice("standard"), "standard", OTHER_ROWS):
        assert comparison.verdict in (Verdict.AGREES, Verdict.NOT_MEASURED), comparison.row.name


def test_every_row_has_a_unique_name_and_a_source() -> None:
    names = [row.name for row in ROWS]
    assert len(set(names)) == len(names)
    assert all(row.source and row.unit and row.published for row in ROWS)


def test_an_explanation_is_of_a_preset_that_exists() -> None:
    for row in ROWS:
        assert all(name == "any" or preset_of(name) for name in row.why), row.name


def test_ice_unlike_any_rink_is_distinguished() -> None:
    found = compare(load_ice("paper"), "paper")
    number = counts(found)
    assert sum(number.values()) == len(ICE_ROWS)
    assert number["differs"] == 0
    text = as_text(found)
    assert "coaches' watches" in text
    assert "paper's μ of 0.0019" in text
    assert f"Of {len(ICE_ROWS)} rows" in in_words(found)
