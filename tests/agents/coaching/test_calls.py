"""A coach's line is read as intended, and any other text is ignored."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.coaching import PLACES, Call, read_call
from agents.coaching.calls import call_error, shown_call, typed_call
from agents.coaching.throw_sheet import sheet_of
from curling_env.sheet import Direction
from curling_env.units import Units, shown_in
from friction_estimation.tracks.throw_list import ThrowNote
from friction_estimation.tracks.throw_table import ThrowMeasures


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("draw button", {"shot": "draw", "target": (0.0, 0.0)}),
        ("draw 0.3,-1.2 in", {"shot": "draw", "target": (0.3, -1.2), "handle": "in-turn"}),
        ("Guard", {"shot": "guard", "target": (0.0, -3.2)}),
        (
            "hit 0,1.2 normal out",
            {"shot": "takeout", "target": (0.0, 1.2), "weight": "normal", "handle": "out-turn"},
        ),
        ("draw 4 ft short 1 ft left", {"shot": "draw", "target": (-0.3048, -1.2192)}),
        ("button, out-turn", {"shot": "draw", "target": (0.0, 0.0), "handle": "out-turn"}),
        ("draw to the top 4-foot", {"shot": "draw", "target": PLACES["top four"]}),
        ("corner guard left", {"shot": "guard", "target": (-1.22, -3.2)}),
        ("draw 2,-4 ft", {"shot": "draw", "target": (0.6096, -1.2192)}),
        ("hit and stay 0.1,0.4 board", {"shot": "hit-and-stay", "weight": "board"}),
        ("peel", {"shot": "peel", "target": None}),
        ("draw tee broom 90 cm left", {"broom": -0.9}),
        ("draw broom centre line in", {"broom": 0.0, "target": (0.0, 0.0)}),
        ("draw 13.4 s 3 turns", {"hog_to_hog": 13.4, "turns": 3.0}),
        ("draw 0.3 , −1.2", {"target": (0.3, -1.2)}),
        ("hit and stick normal", {"shot": "hit-and-stay", "weight": "normal"}),
        ("hit and roll out", {"shot": "hit-and-roll", "handle": "out-turn"}),
        ("raise in", {"shot": "raise"}),
        ("tap back hack", {"shot": "tap-back", "weight": "hack"}),
        ("come around button in", {"shot": "draw", "target": (0.0, 0.0)}),
        ("run back firm", {"shot": "runback", "weight": "firm"}),
        ("double takeout", {"shot": "double"}),
        ("board weight", {"shot": "takeout", "weight": "board"}),
        ("draw 4 foot in turn", {"target": (0.0, 0.0), "handle": "in-turn"}),
        ("draw button out ice 4 feet", {"ice": 4 * 0.3048, "handle": "out-turn"}),
        ("draw button in 13.8", {"hog_to_hog": 13.8, "handle": None}),
        ("draw button 3.7 split", {"split": 3.7}),
        ("long guard", {"shot": "guard", "target": PLACES["high guard"]}),
        ("long centre guard", {"shot": "guard", "target": PLACES["high guard"]}),
        ("come around centre guard out", {"shot": "draw", "target": (0.0, 0.0)}),
        ("draw around the corner guard in", {"shot": "draw", "handle": "in-turn"}),
        ("draw top four behind the guard", {"target": PLACES["top four"]}),
        ("draw eight foot left", {"target": PLACES["left eight"]}),
        ("freeze to shot stone", {"shot": "freeze"}),
        ("freeze on red in", {"shot": "freeze", "handle": "in-turn"}),
        ("hit the yellow stone control", {"shot": "takeout", "weight": "control"}),
        ("hit and roll behind the guard", {"shot": "hit-and-roll"}),
        ("hit and roll left in", {"shot": "hit-and-roll", "handle": "in-turn"}),
        ("peel the guard", {"shot": "peel"}),
        ("run back double", {"shot": "runback"}),
        ("tap up", {"shot": "raise"}),
        ("tick shot out", {"shot": "tick", "handle": "out-turn"}),
    ],
)
def test_calls(text, meant):
    call = read_call(text)
    assert call is not None
    for name, value in meant.items():
        wanted = pytest.approx(value, abs=1e-9) if isinstance(value, tuple) else value
        assert getattr(call, name) == wanted, name
    assert call.text == text


@pytest.mark.parametrize(
    "text",
    [
        "", "nice draw by Anna", "in", "13.4 s", "draw 9,9", "draw 0,-6.5", "draw in out",
        "draw guard", "button top four", "draw 0,0 4 ft short", "1,2,3", "draw broom 7",
        "2 ft left 1 ft left", "draw 13.4 s 13.2 s", "broom", "hit normal hack",
    ],
)  # fmt: skip
def test_text_that_is_not_a_call(text):
    assert read_call(text) is None


def test_the_word_that_is_not_known_is_named():
    assert call_error("draw button nice") == "“nice” is not a word of a call"
    assert call_error("draw in out") == "the call has a handle twice"
    assert call_error("draw button") == ""


def test_ice_is_a_broom_on_the_side_that_hand_and_handle_ask_for():
    measures = ThrowMeasures(throw=0, stone=0, clock=0.0, direction=Direction.AWAY)
    brooms = {
        hand: sheet_of(measures, {0: ThrowNote(athlete="A", called="draw in ice 1.2")}, {"A": hand})
        for hand in ("right", "left")
    }
    assert brooms["right"].call.broom == pytest.approx(-1.2)
    assert brooms["left"].call.broom == pytest.approx(1.2)


def test_errors_are_pooled_by_weight_class():
    assert [read_call(text).weight_class for text in ("guard", "freeze 0,1", "draw", "peel")] == [
        "guard", "draw", "draw", "hit",
    ]  # fmt: skip


def test_in_words():
    call = read_call("draw 0.3,-1.2 in broom 1.1")
    assert (
        call.in_words() == "draw, 1.20 m short of the tee, 30 cm right, in-turn, broom 1.10 m right"
    )
    with shown_in(Units.FEET):
        assert read_call("4 ft short").in_words() == "draw, 4 ft 0 in short of the tee"
    assert read_call("draw top eight out").in_words() == "draw, top eight, out-turn"


@pytest.mark.parametrize(
    ("typed", "kept"),
    [
        ("Draw 2,-4 in Broom 3.5 right 13.4 s", "Draw 2ft,-4ft in Broom 3.5ft right 13.4 s"),
        ("draw 4 short 1.5 left ice 4", "draw 4ft short 1.5ft left ice 4ft"),
        ("draw top 4 foot, 30 cm short", "draw top 4 foot, 30 cm short"),
        ("draw 2,-4 ft, 3 turns, 3.7 split", "draw 2,-4 ft, 3 turns, 3.7 split"),
        ("draw button in 13.4", "draw button in 13.4"),
    ],
)
def test_lengths_without_units_are_in_the_chosen_ones(typed, kept):
    assert typed_call(typed) == typed
    with shown_in(Units.FEET):
        assert typed_call(typed) == kept
        assert typed_call(kept) == kept
        assert typed_call(shown_call(typed)) == shown_call(typed)  # what is stored is not changed


def test_stored_lengths_are_shown_with_their_unit_beside_feet():
    stored = "draw 0.3,-1.2 in broom 1.44 left"
    assert shown_call(stored) == stored
    with shown_in(Units.FEET):
        assert shown_call(stored) == "draw 0.3m,-1.2m in broom 1.44m left"
        assert read_call(shown_call(stored)).target == read_call(stored).target


WORDS = [
    "draw",
    "hit",
    "in",
    "0.3,-1.2",
    "broom",
    "left",
    "4",
    "ft",
    "short",
    "13",
    "s",
    "turns",
    "button",
    "guard",
    ",",
    "2.5",
]


@given(st.text(max_size=80) | st.lists(st.sampled_from(WORDS)).map(" ".join))
def test_any_text_is_read_without_an_error(text):
    call = read_call(text)
    assert call is None or isinstance(call, Call)


@pytest.mark.parametrize("name", PLACES)
def test_every_named_place_is_read_and_printed_by_name(name):
    call = read_call(f"draw {name}" if "guard" not in name else name)
    assert call.target == PLACES[name]
    reported = call.in_words()
    assert name in reported or "button" in reported
