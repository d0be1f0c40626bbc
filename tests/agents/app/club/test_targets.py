"""Targets are kept by a name, and calls that say it mean the place."""

from __future__ import annotations

import pytest

from agents.app import keep_target, remove_target, with_places
from agents.coaching import read_call
from curling_env.errors import InputError


def test_a_call_that_names_a_target_means_its_place(club):
    keep_target(club, "Ben's corner", 0.6, 17.3735 - 0.4)
    keep_target(club, "Ben", -1.0, 17.3735)
    targets = club.named_targets()
    call = read_call(with_places("draw ben's corner out broom 0.6 left 14.1 s", targets))
    assert call.target == (0.6, -0.4)
    assert (call.handle, call.broom, call.hog_to_hog) == ("out-turn", -0.6, 14.1)
    assert with_places("hit Ben", targets) == "hit -1.00,0.00"
    assert with_places("Benny threw", targets) == "Benny threw"


def test_a_target_at_the_home_end_is_as_the_thrower_sees_it(club):
    kept = keep_target(club, "pocket", -0.6, -(17.3735 - 0.4))
    assert (kept.x, kept.y) == pytest.approx((0.6, 17.3735 - 0.4))


@pytest.mark.parametrize(
    "name", ["button", "in", "corner guard", "right", "Draw", "", "2nd", "a,b"]
)
def test_a_name_that_calls_have_a_meaning_for_is_refused(club, name):
    with pytest.raises(InputError):
        keep_target(club, name, 0.0, 17.0)
    assert club.targets() == []


def test_a_renamed_target_is_renamed_in_its_calls(visitor, club):
    kept = keep_target(club, "pocket", 0.6, 17.0)
    session = club.add_session("Tuesday", "2026-11-17", "1", None)
    club.change("session", session.id, drill="draw Pocket in")
    query = "insert into throw (session_id, number, part, called) values (?, 0, 0, ?)"
    club.database.write(query, session.id, "draw pocket out, pockets")
    form = {"table": "target", "id": str(kept.id), "session": str(session.id)}
    assert visitor.post("practice/rename", form | {"name": "Ben's corner"}).status == 303
    assert [target.name for target in club.targets()] == ["Ben's corner"]
    assert club.throws(session)[0].called == "draw Ben's corner out, pockets"
    assert club.session(session.id).drill == "draw Ben's corner in"
    assert visitor.post("practice/rename", form | {"name": "button"}).status == 422
    # With the name of another target both are one, and calls mean the place of that one.
    other = keep_target(club, "hole", 0.2, 17.4)
    assert visitor.post("practice/rename", form | {"name": "hole"}).status == 303
    assert club.targets() == [other]
    assert club.throws(session)[0].called == "draw hole out, pockets"
    club.database.write("insert into position (name, address) values ('Split', '#mode=target')")
    form = {"table": "position", "id": "1", "session": str(session.id), "name": "Split the house"}
    assert "Split</option>" in visitor.get(f"practice/{session.id}").text
    assert visitor.post("practice/rename", form).status == 303
    assert "Split the house</option>" in visitor.get(f"practice/{session.id}").text


def test_a_place_off_the_ice_is_refused(club):
    with pytest.raises(InputError, match="between the hog line and the back line"):
        keep_target(club, "away", 0.0, 25.0)


def test_what_a_throw_has_called_keeps_its_meaning(club):
    kept = keep_target(club, "pocket", 0.5, 17.0)
    assert keep_target(club, "Pocket", 0.6, 17.0).id == kept.id  # no throw has called it yet
    session = club.add_session("Tuesday", "2026-11-17", "1", None)
    with club.database.writing() as connection:
        connection.execute(
            "insert into throw (session_id, number, part, called) values (?, 0, 0, 'draw pocket')",
            (session.id,),
        )
    with pytest.raises(InputError, match="were called with"):
        keep_target(club, "pocket", 0.7, 17.0)
    remove_target(club, kept.id)
    assert club.targets() == []
    assert with_places("draw pocket", club.named_targets()) == "draw 0.60,-0.37"
    assert keep_target(club, "pocket", 0.6, 17.0).removed is None
