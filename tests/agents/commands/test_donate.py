"""`curling donate`, and the extraction of the tracks."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from curling_env import simulate
from curling_env.ice import load_ice
from curling_env.throw import Throw
from curling_env.trajectory import read_tracks, write_tracks

CONSENT = "All who threw agree to publication."
CORNERS = {
    "home_left": [5, 115], "home_right": [55, 115], "away_left": [15, 5], "away_right": [45, 5],
}  # fmt: skip


@pytest.fixture
def evening(tmp_path: Path) -> Path:
    throws = [Throw(speed=2.0, spin=1.0), Throw(speed=2.1, spin=-1.0)]
    write_tracks(tmp_path / "t.csv", simulate(load_ice("standard"), throws, fps=5))
    (tmp_path / "s.json").write_text(json.dumps({"corners_px": CORNERS}))
    (tmp_path / "throws.csv").write_text(
        "throw,athlete,stone,called,note\n0,Zuleika,Zoe's,draw button in,well done Zuleika\n"
        "1,Quentin,2,ask Peter,\n"
    )
    (tmp_path / "athletes.csv").write_text("athlete,hand\nQuentin,left\n")
    return tmp_path


def donate(curling, evening: Path, *others: object, consent: str = CONSENT):
    return curling(
        "donate", evening / "t.csv", "--scene", evening / "s.json", "--consent", consent,
        "-o", evening / "session.json", *others,
    )  # fmt: skip


def test_a_session_in_one_file_without_names(curling, evening: Path) -> None:
    found = donate(curling, evening).json()
    assert (found["throws"], found["athletes"], found["called_left_out"]) == (2, 2, 1)
    text = (evening / "session.json").read_text()
    for word in ("Zuleika", "Quentin", "Zoe", "Peter", "well done", "t.csv", str(evening)):
        assert word not in text
    document = json.loads(text)
    assert document["consent"] == CONSENT
    assert document["throws"] == [
        {"throw": 0, "athlete": 0, "called": "draw button in"},
        {"throw": 1, "athlete": 1, "hand": "left"},
    ]
    again = (evening / "session.json").read_bytes()
    donate(curling, evening)
    assert (evening / "session.json").read_bytes() == again


def test_the_tracks_come_out_again(curling, evening: Path) -> None:
    donate(curling, evening)
    back = curling("convert", evening / "session.json", "-o", evening / "back.csv").json()
    assert back["throws"] == 2
    before, after = read_tracks(evening / "t.csv"), read_tracks(evening / "back.csv")
    assert [k.xy.tolist() for k in after] == [k.xy.tolist() for k in before]


def test_a_consent_that_names_an_athlete_is_refused(curling, evening: Path) -> None:
    message = donate(curling, evening, consent="I, Zuleika, agree to everything.").complaint
    assert "names an athlete" in message
    assert "Zuleika" not in message
    assert not (evening / "session.json").exists()


def test_a_short_consent_and_a_film_are_refused(curling, evening: Path) -> None:
    assert "note of consent" in donate(curling, evening, consent="ok").complaint
    (evening / "t.csv").write_bytes(b"\x00\x00\x00\x18ftypmp42" + bytes(100))
    assert "t.csv" in donate(curling, evening).complaint
    assert not (evening / "session.json").exists()
