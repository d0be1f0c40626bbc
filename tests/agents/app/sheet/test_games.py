"""A game by its throws, as the page asks for it."""

from __future__ import annotations

import json

import pytest

from agents.app import CallsForm, GameForm, advised, asked, called, played
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.sheet import TEE_Y
from curling_env.throw import SKILLS

ICE, HANDS = load_ice("standard"), (SKILLS["club"], SKILLS["club"])
DRAW = {"speed": 2.1, "angle": 0.038, "spin": -1.5}
LATE = {"stones": [{"x": 0.0, "y": TEE_Y, "team": "away"}], "delivered": 13, "hammer": "home"}


def game(**wish):
    return played(ICE, HANDS, asked({"ice": "x", **wish}, GameForm))


def test_an_end_is_played_to_its_score():
    result = game(position=LATE, seed=4)
    assert result["throws"] == []
    assert result["state"]["to_throw"] == "home"
    assert result["state"]["stones_left"] == [2, 1]
    while not result["state"]["over"]:
        before = result["throws"]
        result = game(position=LATE, seed=4, throws=before, throw=DRAW, since=len(before))
        assert [line["team"] for line in result["deliveries"]][:2] == ["home", "away"][
            : len(result["deliveries"])
        ]
        assert result["deliveries"][0]["paths"]
    ends = result["deliveries"][-1]["score_of_end"]
    assert result["state"]["score"] == ends == result["state"]["line_score"][-1]
    assert len(result["throws"]) == 3
    # The address alone gives the same game.
    again = game(position=LATE, seed=4, throws=result["throws"])
    assert again["state"] == result["state"]
    json.dumps(result, allow_nan=False)


def test_the_score_goes_on_from_the_position():
    result = game(position={**LATE, "score": [3, 5], "ends_left": 2})
    assert result["state"]["score"] == [3, 5] == result["state"]["start_score"]
    assert result["state"]["line_score"] == []
    assert (result["state"]["end"], result["state"]["ends"]) == (1, 2)


def test_a_throw_out_of_turn_is_refused():
    # Red has the last stone with an even seed, so that yellow begins, and red answers.
    opening = game(seed=2)["throws"]
    assert len(opening) == 1
    with pytest.raises(InputError, match="not your turn"):
        game(seed=2, throw=DRAW)
    assert len(game(seed=2, throws=opening, throw=DRAW)["throws"]) == 3


def test_the_machine_advises_its_opponent():
    found = advised(ICE, HANDS, asked({"ice": "x", "position": LATE}, GameForm))
    same = called(ICE, HANDS[0], asked({"ice": "x", "position": LATE}, CallsForm))
    assert found["team"] == same["team"] == "home"
    assert [call["throw"] for call in found["calls"]] == [call["throw"] for call in same["calls"]]
    assert all(0 <= call["win"] <= 1 for call in found["calls"])
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"opponent": "/etc/passwd"}, "opponent"),
        ({"throws": [[2.0, 0.0]]}, "throws"),
        ({"throws": [[99.0, 0.0, 0.0]]}, "speed"),
        ({"rules": "bowls"}, "unknown set of rules"),
        ({"position": {**LATE, "delivered": 0}}, "1 stones of the away team"),
    ],
)
def test_what_cannot_be_is_one_line(wrong, complaint):
    with pytest.raises(InputError, match=complaint):
        game(**wrong)
