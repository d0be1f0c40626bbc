"""Practice: sessions, cameras and films, as the browser asks for them."""

from __future__ import annotations

import pytest

from agents.app import remove
from agents.app.club.club import added


def begin(visitor, **fields):
    given = {"name": "Tuesday", "day": "2026-11-17", "sheet": "2", "camera": ""}
    return visitor.post("practice", given | fields)


def test_a_session_begins_with_a_new_camera(visitor, club):
    answer = begin(visitor, camera="new", camera_name="far house", size="45.72x4.75")
    (session,) = club.sessions()
    assert answer.status == 303
    assert answer.headers["location"] == f"/{visitor.secret}/practice/{session.id}"
    camera = club.camera(session.camera_id)
    assert (camera.name, camera.length, camera.width) == ("far house", 45.72, 4.75)
    assert club.folder_of(session).is_dir()
    assert "far house" in visitor.get(f"practice/{session.id}").text


@pytest.mark.parametrize(
    "fields",
    [
        {"day": "yesterday"},
        {"day": ""},
        {"sheet": ""},
        {"name": "x" * 81},
        {"camera": "7"},
        {"camera": "-1"},
        {"camera": "new", "camera_name": "", "size": "45.72x4.75"},
        {"camera": "new", "camera_name": "a", "size": "1x1"},
    ],
)
def test_what_cannot_be_begun_is_reported_and_not_begun(visitor, club, fields):
    answer = begin(visitor, **fields)
    assert answer.status == 422
    assert 'role="alert"' in answer.text
    assert club.sessions() == []
    assert club.cameras() == []


def test_names_are_shown_as_text(visitor, club):
    begin(visitor, name='<script>alert("x")</script>')
    page = visitor.get("practice").text
    assert "<script>alert" not in page
    assert "&lt;script&gt;" in page


def test_a_film_is_sent_and_goes_on(visitor, club):
    begin(visitor)
    (session,) = club.sessions()
    begun = visitor.send(f"practice/{session.id}/films", {"name": "a.mp4", "size": 6}).document
    path = f"practice/films/{begun['film']}"
    assert visitor.put(f"{path}?begin=0", b"abc").document == {"received": 3}
    assert visitor.put(f"{path}?begin=0", b"abc").status == 422
    again = visitor.send(f"practice/{session.id}/films", {"name": "a.mp4", "size": 6}).document
    assert again == {"film": begun["film"], "received": 3}
    assert visitor.put(f"{path}?begin=3", b"def").document == {"received": 6}
    assert club.path(club.film(begun["film"]).file).read_bytes() == b"abcdef"


def test_a_film_of_a_session_that_is_removed_meanwhile_is_refused(visitor, club):
    begin(visitor)
    (session,) = club.sessions()
    begun = visitor.send(f"practice/{session.id}/films", {"name": "a.mp4", "size": 3}).document
    remove(club, "session", session.id)
    answer = visitor.put(f"practice/films/{begun['film']}?begin=0", b"abc")
    assert answer.status == 404
    assert "does not exist or was removed" in answer.text


@pytest.mark.parametrize("sent", [{}, {"name": 5, "size": 5}, {"name": "a.mp4", "size": "5"}, []])
def test_what_is_no_announcement_is_refused(visitor, club, sent):
    begin(visitor)
    (session,) = club.sessions()
    assert visitor.send(f"practice/{session.id}/films", sent).status == 422


@pytest.mark.parametrize(
    "file", ["../outside.mp4", "/etc/passwd", "club.sqlite", "films/no.mp4", "", "\0"]
)
def test_only_films_of_the_club_folder_are_taken(visitor, club, file):
    begin(visitor)
    (session,) = club.sessions()
    assert visitor.post(f"practice/{session.id}/take", {"file": file}).status == 422
    assert club.films(session) == []


def test_a_note_is_kept(visitor, club):
    begin(visitor)
    (session,) = club.sessions()
    visitor.post(f"practice/{session.id}/note", {"text": "frost <b>left</b>"})
    assert "frost &lt;b&gt;left&lt;/b&gt;" in visitor.get("practice").text


def test_what_is_removed_can_be_brought_back_on_the_page(visitor, club):
    begin(visitor, name="Tuesday")
    (session,) = club.sessions()
    about = {"kind": "session", "id": str(session.id)}
    assert visitor.send("practice/remove", about).status == 422  # no form of ours
    answer = visitor.post("practice/remove", about)
    assert answer.headers["location"] == f"/{visitor.secret}/practice#removed"
    assert visitor.get(f"throws/{session.id}").status == 404
    page = visitor.get("practice").text
    assert "Bring back Tuesday" in page
    assert "Delete Tuesday, 2026-11-17 for good" in page
    visitor.post("practice/bring-back", about)
    assert visitor.get(f"practice/{session.id}").status == 200


def test_work_on_a_session_that_is_removed_ends(visitor, club):
    begin(visitor)
    (session,) = club.sessions()
    visitor.post(f"practice/{session.id}/work", {"kind": "estimate"})
    visitor.post("practice/remove", {"kind": "session", "id": str(session.id)})
    with club.database.reading() as connection:
        assert [tuple(row) for row in connection.execute("select state from job")] == [
            ("cancelled",)
        ]


@pytest.mark.parametrize(
    "fields",
    [{}, {"kind": "club", "id": "1"}, {"kind": "film", "id": "x"}, {"kind": "film", "id": "1"}],
)
def test_only_what_there_is_to_remove_is_removed(visitor, club, fields):
    begin(visitor)
    for path in ("remove", "bring-back", "delete"):
        assert visitor.post(f"practice/{path}", fields).status == 422
    assert len(club.sessions()) == 1


def test_what_has_two_names_is_merged_by_renaming(visitor, club):
    with club.database.writing() as connection:
        sizes = {"length": 44.5, "width": 4.5}
        first, second = (added(connection, "camera", name=k, **sizes) for k in ("end", "End wall"))
        people = [added(connection, "athlete", name=name) for name in ("Ana", "Anna")]
    session = club.add_session("Tuesday", "2026-11-17", "1", club.camera(second))
    with club.database.writing() as connection:
        for k, who in enumerate(people):
            about = {"session_id": session.id, "number": k, "part": k, "athlete_id": who}
            added(connection, "throw", **about)
    form = {"table": "athlete", "id": str(people[0]), "session": str(session.id), "name": "Anna"}
    assert visitor.post("practice/rename", form).status == 303
    assert [one.athlete for one in club.throws(session)] == ["Anna", "Anna"]
    assert [one.name for one in club.athletes()] == ["Anna"]
    form = {"table": "camera", "id": str(second), "session": str(session.id), "name": "end"}
    assert visitor.post("practice/rename", form).status == 303
    assert [one.id for one in club.cameras()] == [first]
    assert club.session(session.id).camera_id == first
    club.database.write("insert into position (name, address) values ('A', '#'), ('B', '#')")
    form = {"table": "position", "id": "1", "session": str(session.id), "name": "B"}
    assert "another position has this name" in visitor.post("practice/rename", form).text
