"""No name gets into a donated file."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import InputError
from friction_estimation.donation import refuse_names, without_names
from friction_estimation.tracks import ThrowNote

CALL_WORDS = {
    *("draw", "guard", "freeze", "hit", "takeout", "stay", "and", "peel", "tap", "raise"),
    *("button", "top", "back", "left", "right", "four", "eight", "twelve", "centre", "center"),
    *("corner", "in", "out", "broom", "normal", "firm", "hack", "board", "control", "turn"),
    *("turns", "short", "past", "m", "cm", "ft", "inch", "inches", "s"),
}
"""None of them is a name."""


def test_athletes_become_numbers_in_the_order_of_their_first_throw() -> None:
    notes = {
        5: ThrowNote(athlete="Ada", called="draw 0.3,-1.2 in", note="lovely, Bo!"),
        1: ThrowNote(athlete="Bo", stone="Bo's own", called="Ask Peter"),
        7: ThrowNote(athlete="Bo"),
        9: ThrowNote(called="hit 2,-4 ft normal"),
    }
    kept, left_out = without_names(notes, {"Ada": "left"})
    assert [(k.throw, k.athlete, k.hand, k.called) for k in kept] == [
        (1, 0, "", ""),
        (5, 1, "left", "draw 0.3,-1.2 in"),
        (7, 0, "", ""),
        (9, None, "", "hit 2,-4 ft normal"),
    ]
    assert left_out == 1


def called(text: str) -> str:
    """Return the called shot that is kept from a note."""
    ((kept,), _) = without_names({0: ThrowNote(called=text)}, {})
    return kept.called


WORDS = st.sampled_from(["draw", "Guard", "in", "-1.2", "ft", "Ada", "drawn", "guard_bo", "é", "+"])


@given(st.one_of(st.text(max_size=30), st.lists(WORDS).map(" ".join)))
def test_a_call_that_is_kept_has_no_other_words(text: str) -> None:
    kept = called(text)
    assert kept in ("", text)
    assert set("".join(c if c.isalpha() else " " for c in kept.lower()).split()) <= CALL_WORDS


@pytest.mark.parametrize("text", ["Draw to Ada", "draw Ädа", "guard_bo", "", "ｄｒａｗ"])
def test_text_that_is_no_call(text: str) -> None:
    assert called(text) == ""


@pytest.mark.parametrize("text", ["ADA agrees.", "We, Lovelace, agree", "Agreed by Ada-Lovelace"])
def test_a_consent_that_names_an_athlete_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="names an athlete") as error:
        refuse_names(text, ["Bo", "Ada Lovelace"])
    assert "Ada" not in str(error.value)


def test_a_consent_without_names_passes() -> None:
    refuse_names("All who threw agree; the adage holds.", ["Ada", "Bo"])
