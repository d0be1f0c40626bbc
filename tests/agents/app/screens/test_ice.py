"""The screen Ice as a browser asks it."""

from __future__ import annotations

import json

import pytest

from agents.app.sheet import choices
from agents.coaching.draw_weight import Centre
from curling_env.ice import load_ice, save_ice

REPORT = {
    "verdict": "The model lacks <b>curl</b>.",
    "effects": [{"name": "curl", "where": "paths bend", "alternatives": ["slope"]}],
    "next_throws": [{"words": "draw weight towards the home end", "teaches": {"curl": 0.6}}],
}


@pytest.fixture
def evenings(club):
    """Three sessions, the last without an ice, and a fourth on another sheet."""
    made = [
        club.add_session(name, day, sheet, None)
        for name, day, sheet in (
            ("Tuesday", "2026-11-17", "B"),
            ("Other sheet", "2026-11-18", "C"),
            ("Friday", "2026-11-20", "B"),
            ("Sunday", "2026-11-22", "B"),
        )
    ]
    for session in made[:3]:
        save_ice(load_ice("standard"), club.ice_of(session))
    return made


def test_the_latest_ice_is_shown_against_those_before(visitor, evenings):
    text = visitor.get("ice").text
    assert "Ice: Friday" in text
    assert "<b>Tuesday, 2026-11-17</b>: of the same weight" in text
    assert "Other sheet" not in text.partition("<main")[2]
    assert "hog to hog" in text


def test_a_session_without_ice_says_so(visitor, evenings):
    answer = visitor.get(f"ice/{evenings[3].id}")
    assert answer.status == 200
    assert "No ice is known yet" in answer.text


def test_handles_are_those_of_the_hand(visitor, evenings):
    right, left = (visitor.get(f"ice?hand={hand}").text for hand in ("right", "left"))
    assert right.index(">in-turn<") < right.index(">out-turn<")
    assert left.index(">out-turn<") < left.index(">in-turn<")


def test_the_change_since_another_session_has_an_address(visitor, evenings):
    text = visitor.get(f"ice?against={evenings[0].id}").text
    assert "What changed since Tuesday" in text
    assert visitor.get(f"ice?against={evenings[1].id}").status == 404
    assert visitor.get("ice?against=x").status == 422


def test_missing_effects_are_listed_with_their_throws(visitor, club, evenings):
    folder = club.folder_of(evenings[2])
    (folder / "report.json").write_text(json.dumps(REPORT), encoding="utf-8")
    text = visitor.get("ice").text
    assert "The model lacks &lt;b&gt;curl&lt;/b&gt;." in text
    assert "It may be a slope of the ice instead" in text
    assert "Draw weight towards the home end" in text
    (folder / "report.json").write_text("[1]", encoding="utf-8")
    answer = visitor.get("ice")
    assert answer.status == 200
    assert "report.json" in answer.text


def test_ice_that_is_looked_at_or_no_longer_true_says_so(visitor, club, evenings):
    session = evenings[2]
    club.tracks_of(session).write_text("throw,t,x,y,theta")
    page = f"ice/{session.id}"
    assert "Look for it now" in visitor.get(page).text
    visitor.post(f"practice/{session.id}/work", {"kind": "discover"})
    text = visitor.get(page).text
    assert "This is being looked for now." in text
    assert "Look for it now" not in text
    assert "estimate it again" not in text
    with club.database.writing() as connection:
        connection.execute("update session set ice_of = 'other tracks'")
    assert "Throws have come or changed since this ice was estimated" in visitor.get(page).text


def test_conditions_stand_in_the_log_of_the_season(visitor, club, evenings, monkeypatch):
    first = evenings[0]
    about = {"name": "Tuesday", "day": "2026-11-17", "sheet": "B", "pebble": "fine <b>, 44 °C"}
    assert visitor.post(f"practice/{first.id}/correct", about).status == 303
    text = visitor.get("ice").text
    season = text[text.index("The season on B") :]
    assert "fine &lt;b&gt;, 44 °C" in season
    assert season.count('scope="row"') >= 2
    assert "2026-11-18" not in season  # another sheet
    # Worked out once: the next look reads what was kept.
    kept = club.answer(f"draws {first.id}", list[Centre])
    assert 10 < kept[0][0].seconds < 20
    monkeypatch.setattr(choices, "centre_of", lambda _: pytest.fail("worked out again"))
    visitor.get("ice")
