"""Removed sessions, films and throws leave pages and files, and come back unchanged."""

from __future__ import annotations

import numpy as np
import pytest

from agents.app import (
    Part,
    add_piece,
    begin_film,
    bring_back,
    delete_for_good,
    keep_part,
    remove,
    removed_in,
    removed_sessions,
    take_film,
    write_files,
)
from curling_env.trajectory import Trajectory, read_tracks


@pytest.fixture
def session(club):
    """Two films with two throws each, with a coach's notes."""
    session = club.add_session("Tuesday", "2026-11-17", "1", None)
    for number in range(2):
        film = begin_film(club, session, f"{number}.mp4", 4)
        film = add_piece(club, film, 0, b"film")
        t = np.linspace(0.0, 20.0, 50)
        throws = [
            [Trajectory(t=t, xy=np.column_stack([0 * t, 15 - (t / 20 - 1) ** 2]), clock=30.0 * k)]
            for k in range(2)
        ]
        keep_part(club, session, film, Part(throws=throws, handles=[[None], [None]]))
    with club.database.writing() as connection:
        connection.execute("update throw set called = 'draw ' || id")
    write_files(club, session)
    return session


def state(club, session):
    """Contents of a session on pages and in the files of commands."""
    folder = club.folder_of(session)
    tracks = club.tracks_of(session)
    return (
        [(one.number, one.id, one.called) for one in club.throws(session)],
        [one.name for one in club.films(session)],
        (folder / "throws.csv").read_text() if tracks.exists() else None,
        [(one.throw, one.clock) for one in read_tracks(tracks)] if tracks.exists() else None,
    )


@pytest.mark.parametrize("kind", ["film", "throw"])
def test_what_is_removed_is_nowhere_and_comes_back_as_it_was(club, session, kind):
    before = state(club, session)
    number = club.films(session)[0].id if kind == "film" else club.throws(session)[1].id
    remove(club, kind, number)
    throws, films, notes, tracks = state(club, session)
    left = [2, 3] if kind == "film" else [0, 2, 3]  # the numbers of the others stay
    assert [number for number, *_ in throws] == left
    assert [throw for throw, _ in tracks] == left
    assert notes.count("draw") == len(left)
    assert len(films) == (1 if kind == "film" else 2)
    (removed,) = removed_in(club, session)
    assert (removed.kind, removed.id) == (kind, number)
    assert getattr(club, kind)(number) is None
    bring_back(club, kind, number)
    assert state(club, session) == before
    assert removed_in(club, session) == []


def test_a_session_without_throws_has_no_tracks_until_they_come_back(club, session):
    before = state(club, session)
    films = [film.id for film in club.films(session)]
    for film in films:
        remove(club, "film", film)
    assert not club.tracks_of(session).exists()
    for film in films:
        bring_back(club, "film", film)
    assert state(club, session) == before


def test_a_session_comes_back_with_all_that_is_its(club, session):
    before = state(club, session)
    remove(club, "session", session.id)
    assert club.sessions() == []
    assert club.session(session.id) is None
    assert [one.name for one in removed_sessions(club)] == ["Tuesday, 2026-11-17"]
    bring_back(club, "session", session.id)
    assert state(club, session) == before


def test_only_what_was_removed_is_deleted_for_good(club, session):
    film = club.films(session)[0]
    path = club.path(film.file)
    delete_for_good(club, "film", film.id)
    assert path.exists()
    remove(club, "film", film.id)
    delete_for_good(club, "film", film.id)
    assert not path.exists()
    assert removed_in(club, session) == []
    assert len(club.throws(session)) == 2
    # The same film may come again, and is another one.
    assert begin_film(club, session, film.name, film.size).received == 0
    remove(club, "session", session.id)
    delete_for_good(club, "session", session.id)
    assert removed_sessions(club) == []
    assert not club.folder_of(session).exists()


def test_a_film_of_the_folder_films_is_not_deleted_but_offered_again(club):
    session = club.add_session("Tuesday", "2026-11-17", "1", None)
    path = club.folder / "films" / "mine.mp4"
    path.write_bytes(b"film")
    film = take_film(club, session, path)
    remove(club, "film", film.id)
    delete_for_good(club, "film", film.id)
    assert path.exists()
    assert take_film(club, session, path).id != 0
