"""Throws: the table, a throw beside its film, and what a coach enters."""

from __future__ import annotations

import json
import time
from dataclasses import replace

import numpy as np
import pytest

from agents.app import SCREENS, Club, Part, State, finish_files, keep_part
from agents.app.club import session_files
from agents.app.club.club import added, encoded
from agents.app.club.database import VERSIONS
from agents.app.club.session_files import measures_of
from agents.app.take_in import add_film, take_in
from agents.app.views.film_view import speeds
from agents.app.views.throws import rounded
from agents.coaching import read_call
from curling_env.trajectory import Trajectory, write_tracks
from friction_estimation.tracks.throw_list import throws_beside

SPEED, DECELERATION = 2.1, 0.088


def straight(clock: float = 0.0, throw: int = 0) -> Trajectory:
    """A stone that slows down evenly and turns twice, from the hog line straight ahead."""
    t = np.arange(0.0, SPEED / DECELERATION + 1.0, 1 / 15)
    moving = np.minimum(t, SPEED / DECELERATION)
    y = -10.9725 + SPEED * moving - DECELERATION * moving**2 / 2
    theta = 4 * np.pi * (1 - (1 - moving / moving[-1]) ** 2)
    return Trajectory(
        t=t,
        xy=np.column_stack([0 * t, y]),
        theta=theta,
        sigma_xy=np.full(len(t), 0.004),
        throw=throw,
        clock=clock,
    )


@pytest.fixture
def session(club, tmp_path):
    folder = tmp_path / "evening"
    folder.mkdir()
    write_tracks(folder / "tracks.csv", [straight(60.0 * k, k) for k in range(3)])
    return take_in(club, folder, name="Tuesday", day="2026-11-17", sheet="2")


def enter(visitor, session, throw, **fields):
    given = {"athlete": "Ben", "hand": "left", "stone": "red 3", "called": "draw button in"}
    given |= {"made": "missed", "note": "hurried"}
    return visitor.post(f"throws/{session.id}/{throw.label}", given | fields)


def test_the_table_tells_what_was_measured(visitor, session):
    text = visitor.get(f"throws/{session.id}").text
    # 21.945 m from hog line to hog line at an even deceleration.
    time = (SPEED - (SPEED**2 - 2 * DECELERATION * 21.945) ** 0.5) / DECELERATION
    assert f"{time:.2f} s" in text
    assert text.count('<th scope="row">') == 3


def test_a_coachs_entry_stands_in_the_table_and_in_the_files(visitor, club, session):
    throw = club.throws(session)[1]
    assert enter(visitor, session, throw).status == 303
    kept = club.throw(throw.id)
    assert (kept.called, kept.made, kept.note) == ("draw button in", False, "hurried")
    page = visitor.get(f"throws/{session.id}/{throw.label}").text
    assert "Read as: draw, button, in-turn." in page
    table = visitor.get(f"throws/{session.id}?athlete=Ben").text
    assert table.count('<th scope="row">') == 1
    # By the hand of the athlete: counter-clockwise is a left-hander's in-turn.
    assert '<td data-label="Handle">in-turn</td>' in table
    assert (
        "1,Ben,red 3,draw button in,hurried" in (club.folder_of(session) / "throws.csv").read_text()
    )


def test_tracking_again_leaves_what_the_coach_entered(visitor, club, session, tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"film")
    film = add_film(club, session, path)
    keep_part(club, session, film, Part(throws=[[straight()]], handles=[["#c03030"]]))
    throw = club.throws(session)[-1]
    enter(visitor, session, throw)
    before = club.throw(throw.id)
    keep_part(club, session, film, Part(throws=[[straight()]] * 2, handles=[["#3030c0"]] * 2))
    assert club.throw(throw.id) == before
    assert club.film(film.id).state is State.DONE


def test_what_moves_a_stone_after_its_rest_is_not_its_throw(visitor, club, session, tmp_path):
    """A curve that climbs again after the stone has stopped is a hand's, or another stone's."""
    path = tmp_path / "a.mp4"
    path.write_bytes(b"film")
    film = add_film(club, session, path)
    slid = straight()
    t = slid.t[-1] + np.arange(1, 40) / 15
    xy = slid.xy[-1] + np.column_stack([0 * t, 4.1 * (t - t[0])])
    longer = replace(
        slid,
        t=np.concatenate([slid.t, t]),
        xy=np.concatenate([slid.xy, xy]),
        theta=np.concatenate([slid.theta, np.full(len(t), np.nan)]),
        sigma_xy=np.full(len(slid.t) + len(t), 0.004),
        swept=np.zeros(len(slid.t) + len(t)),
    )
    keep_part(club, session, film, Part(throws=[[longer]], handles=[[None]]))
    throw = club.throws(session)[-1]
    track = visitor.get(f"throws/{session.id}/{throw.label}/track").document
    late = np.array(track["speed"])[np.array(track["t"]) > slid.t[-1] - 1.5]
    assert late.max() < 0.3
    assert abs(measures_of(throw.measures).past.value - (slid.xy[-1, 1] - 17.3735)) < 0.02
    # A stone that another one hits goes on.
    hit = replace(slid, t=slid.t + 20.0, xy=slid.xy - [0.0, 0.3], stone=1)
    keep_part(club, session, film, Part(throws=[[longer, hit]], handles=[[None, None]]))
    track = visitor.get(f"throws/{session.id}/{throw.label}/track").document
    assert max(track["speed"][-10:]) > 2


@pytest.mark.parametrize(
    "fields",
    [
        {"made": "perhaps"},
        {"called": "x" * 301},
        {"note": "x" * 5001},
        {"athlete": "x" * 81},
        {"stone": "x" * 81},
        {"hand": "both"},
    ],
)
def test_an_entry_that_cannot_be_kept_changes_nothing(visitor, club, session, fields):
    throw = club.throws(session)[0]
    assert enter(visitor, session, throw, **fields).status == 422
    assert club.throw(throw.id) == throw
    assert club.athletes() == []


def test_names_are_text(visitor, club, session):
    throw = club.throws(session)[0]
    enter(visitor, session, throw, athlete='"><img src=x>', called="<i>draw</i>\nto the pin")
    for path in (f"throws/{session.id}", f"throws/{session.id}/{throw.label}"):
        page = visitor.get(path).text
        assert "<img src=x>" not in page
        assert "<i>draw" not in page
    assert club.throw(throw.id).called == "<i>draw</i> to the pin"


def test_a_throw_of_another_session_is_not_here(visitor, club, session):
    other = club.add_session("Wednesday", "2026-11-18", "2", None)
    throw = club.throws(session)[0]
    assert visitor.get(f"throws/{other.id}/{throw.label}").status == 404
    assert enter(visitor, other, throw).status == 404
    assert club.throw(throw.id) == throw


def test_a_film_is_sent_in_the_parts_that_are_asked_for(visitor, club, session, tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"0123456789")
    film = add_film(club, session, path)
    part = visitor.get(f"throws/films/{film.id}", range="bytes=3-5")
    assert (part.status, part.body) == (206, b"345")
    assert part.headers["content-type"] == "video/mp4"
    club.path(film.file).unlink()
    assert visitor.get(f"throws/films/{film.id}").status == 404
    assert visitor.get("throws/films/999").status == 404


def test_the_speed_of_a_stone_that_slows_evenly():
    track = straight()
    found = speeds(track)
    moving = track.t < SPEED / DECELERATION - 0.5
    inner = moving & (track.t > 0.5)
    assert np.abs(found - (SPEED - DECELERATION * track.t))[inner].max() < 1e-3
    assert found[-1] == 0.0


def test_the_curve_has_a_speed_for_each_time(visitor, club, session):
    throw = club.throws(session)[0]
    found = visitor.get(f"throws/{session.id}/{throw.label}/track").document
    assert len(found["t"]) == len(found["speed"]) == len(straight())
    assert found["picture"] is None


@pytest.mark.parametrize(
    ("value", "sigma", "words"),
    [
        (13.9012, 0.003, ("13.90", "± 0.01")),
        (23.77, 0.03, ("23.77", "± 0.03")),
        (23.77, 0.3, ("23.8", "± 0.3")),
        (4.04, None, ("4.04", "")),
        (127.3, 4.0, ("127", "± 4")),
    ],
)
def test_numbers_have_the_decimals_that_their_error_leaves(value, sigma, words):
    assert rounded(value, sigma) == words


def test_a_call_may_name_a_kept_target_and_commands_read_its_place(visitor, club, session):
    throw = club.throws(session)[0]
    enter(visitor, session, throw, called="draw pocket out")
    table = club.folder_of(session) / "throws.csv"
    page = f"throws/{session.id}/{throw.label}"
    assert "“pocket” is not a word of a call; kept as a remark" in visitor.get(page).text
    kept = {"name": "pocket", "place": {"x": 0.6, "y": 17.3735 + 0.3}}
    assert visitor.send("throw/targets", kept).status == 200
    text = visitor.get(page).text
    assert f"Read as: {read_call('draw 0.60,0.30 out').in_words()}." in text
    assert 'value="draw pocket out"' in text
    assert "draw 0.60,0.30 out" in table.read_text()


def test_next_is_the_next_throw_of_the_chosen_athlete(visitor, club, session):
    for throw in club.throws(session)[::2]:
        enter(visitor, session, throw, athlete="Anna")
    page = visitor.get(f"throws/{session.id}/1?athlete=Anna").text
    assert f'rel="next" href="/{visitor.secret}/throws/{session.id}/3?athlete=Anna"' in page


def test_only_what_was_changed_is_saved_and_a_newer_entry_is_not_overwritten(
    visitor, club, session
):
    throw = club.throws(session)[0]
    page = f"throws/{session.id}/{throw.label}"
    was = {"athlete": "", "hand": "right", "stone": "", "called": "", "made": "", "note": ""}
    fields = was | {"was": json.dumps(was)}
    assert visitor.post(page, fields | {"called": "guard", "made": "made"}).status == 303
    assert visitor.post(page, fields | {"note": "late"}).status == 303
    kept = club.throw(throw.id)
    assert (kept.called, kept.made, kept.note) == ("guard", True, "late")
    answer = visitor.post(page, fields | {"called": "draw button"})
    assert answer.status == 409
    assert "Someone else has changed this: called is now “guard”" in answer.text
    assert club.throw(throw.id).called == "guard"


def test_nothing_that_is_typed_is_cut(visitor, club, session):
    throw = club.throws(session)[0]
    note = "x" * 3000
    assert enter(visitor, session, throw, note=note).status == 303
    assert club.throw(throw.id).note == note
    assert note in visitor.get(f"throws/{session.id}/{throw.label}").text
    answer = enter(visitor, session, throw, note="y" * 6000)
    assert "has 6000 letters; expected at most 5000" in answer.text
    for path in ("practice", f"throws/{session.id}", f"throws/{session.id}/1", "throw"):
        assert "maxlength" not in visitor.get(path).text
    # The table that commands read has the beginning of it.
    assert throws_beside(club.tracks_of(session))[0].note.endswith(" …")


def test_nothing_is_measured_when_someone_looks(visitor, club, session, monkeypatch):
    def looked(*_, **__):
        raise AssertionError("measured when someone looked")

    monkeypatch.setattr(session_files, "throw_table", looked)
    monkeypatch.setattr(session_files, "read_tracks", looked)
    for screen in ("practice", "throws", f"throws/{session.id}/2"):
        assert visitor.get(screen).status == 200, screen
    assert "3 throws in all" in visitor.get("practice").text


def test_no_screen_works_long_after_a_winter_of_sessions(visitor, club, session):
    """51 sessions of 40 throws: each first answer takes less than a second of the processor."""
    measures = measures_of(club.throws(session)[0].measures)
    throws = [(n, n, encoded(replace(measures, throw=n))) for n in range(40)]
    with club.database.writing() as connection:
        for k in range(50):
            about = {"day": f"2026-11-{18 + k % 10}", "sheet": "2", "folder": f"sessions/{k}"}
            number = added(connection, "session", name=f"Evening {k}", stale=0, **about)
            connection.executemany(
                "insert into throw (session_id, number, part, measures) values (?, ?, ?, ?)",
                [(number, *one) for one in throws],
            )
    for screen in SCREENS:
        before = time.process_time()
        answer = visitor.get(screen.name)
        assert answer.status == 200, screen.name
        assert time.process_time() - before < 1.0, screen.name
        assert answer.text.count("<option value=") >= 51, screen.name  # all can be chosen
    assert visitor.get("throws").text.count('class="open"') == 40


def test_throws_of_an_earlier_version_are_measured_at_the_next_start(visitor, club, session):
    before = [throw.measures for throw in club.throws(session)]
    with club.database.writing() as connection:
        connection.execute("update throw set measures = null, measured_of = ''")
        connection.execute("alter table session add column draws text")
        connection.execute(f"pragma user_version = {len(VERSIONS) - 1}")
    finish_files(Club(club.folder))
    assert [throw.measures for throw in club.throws(session)] == before
    assert visitor.get("throws").status == 200
