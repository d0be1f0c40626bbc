"""A session's files are read by every command, and what a coach entered stays with its throw."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from agents.app import Club, Part, finish_files, keep_part, write_files
from agents.app.club.club import added
from curling_env.trajectory import Trajectory, read_tracks
from friction_estimation.tracks import load_tracks


def track(end: float, clock: float = 0.0, stone: int = 0) -> Trajectory:
    t = np.linspace(0.0, 20.0, 50)
    y = -10.0 + (end + 10.0) * (1 - (1 - t / 20.0) ** 2)
    return Trajectory(t=t, xy=np.column_stack([0 * t, y]), clock=clock, stone=stone)


def film_of(club, session, place):
    with club.database.writing() as connection:
        number = added(
            connection,
            "film",
            session_id=session.id,
            place=place,
            name=f"{place}.mp4",
            file=f"{place}.mp4",
            size=1,
            received=1,
        )
    return club.film(number)


def part(*ends: float) -> Part:
    throws = [[track(end, clock=30.0 * k)] for k, end in enumerate(ends)]
    return Part(throws=throws, handles=[["#c03030"] for _ in ends])


@pytest.fixture
def session(club):
    return club.add_session("Tuesday", "2026-11-17", "sheet 1", None)


def rests(club, session):
    return [round(float(k.xy[-1, 1]), 2) for k in read_tracks(club.tracks_of(session))]


def test_throws_stand_in_the_order_of_play_whichever_film_was_ready_first(club, session):
    first, second = film_of(club, session, 0), film_of(club, session, 1)
    keep_part(club, session, second, part(15.0))
    late = club.throws(session)[0]
    with club.database.writing() as connection:
        anna = added(connection, "athlete", name="Anna", hand="left")
        connection.execute(
            "update throw set athlete_id = ?, called = 'draw in' where id = ?", (anna, late.id)
        )
    keep_part(club, session, first, part(16.0, 17.0))
    assert rests(club, session) == [16.0, 17.0, 15.0]
    kept = club.throws(session)
    assert [(one.id == late.id, one.athlete_id) for one in kept] == [
        (False, None),
        (False, None),
        (True, anna),
    ]
    folder = club.folder_of(session)
    with (folder / "throws.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["throw"], row["athlete"], row["called"]) for row in rows] == [
        ("0", "", ""),
        ("1", "", ""),
        ("2", "Anna", "draw in"),
    ]
    assert (folder / "athletes.csv").read_text().split() == ["athlete,hand", "Anna,left"]


def test_clocks_run_on_from_film_to_film(club, session):
    keep_part(club, session, film_of(club, session, 0), part(16.0, 17.0))
    keep_part(club, session, film_of(club, session, 1), part(15.0))
    clocks = [k.clock for k in read_tracks(club.tracks_of(session))]
    assert clocks == [0.0, 30.0, 50.0]
    # In its own film each begins where it did.
    assert [one.clock for one in club.throws(session)] == [0.0, 30.0, 0.0]


def test_more_throws_of_a_film_leave_what_was_entered(club, session):
    film = film_of(club, session, 0)
    keep_part(club, session, film, part(16.0))
    with club.database.writing() as connection:
        connection.execute("update throw set made = 1, note = 'hurried'")
    keep_part(club, session, film, part(16.0, 14.0))
    assert [(one.made, one.note) for one in club.throws(session)] == [
        (True, "hurried"),
        (None, ""),
    ]


def test_names_of_stones_and_athletes_stay_text(club, session):
    keep_part(club, session, film_of(club, session, 0), part(16.0))
    with club.database.writing() as connection:
        name = 'Ann, "=cmd|" <script>'
        anna = added(connection, "athlete", name=name, hand="right")
        stone = added(connection, "stone", name="red 7")
        connection.execute("update throw set athlete_id = ?, stone_id = ?", (anna, stone))
    write_files(club, session)
    with (club.folder_of(session) / "throws.csv").open() as file:
        row = next(csv.DictReader(file))
    assert (row["athlete"], row["stone"]) == (name, "red 7")
    assert load_tracks(club.tracks_of(session))[0].stone == 0


def test_what_a_killed_process_left_undone_is_done_by_the_next(club, session):
    film = film_of(club, session, 0)
    keep_part(club, session, film, part(16.0))
    # As if it had been killed after an entry was kept and before the files were written.
    with club.database.writing() as connection:
        connection.execute("update throw set called = 'guard'")
        connection.execute("update session set stale = 1")
    club.tracks_of(session).unlink()
    again = Club(club.folder)
    finish_files(again)
    assert rests(again, session) == [16.0]
    assert "guard" in (again.folder_of(session) / "throws.csv").read_text()
    assert not again.session(session.id).stale
