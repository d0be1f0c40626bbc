"""The club's database: kept or not changed at all, whatever ends the process."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import textwrap

import pytest

from agents.app import Club
from agents.app.club.database import VERSIONS, Database
from curling_env.errors import InputError


def test_a_new_file_has_the_newest_version_and_its_settings(tmp_path):
    database = Database(tmp_path / "club.sqlite")
    with database.reading() as connection:
        assert connection.execute("pragma user_version").fetchone()[0] == len(VERSIONS)
        assert connection.execute("pragma journal_mode").fetchone()[0] == "wal"
        assert connection.execute("pragma foreign_keys").fetchone()[0] == 1


def test_an_older_file_is_brought_up_to_date_and_keeps_its_rows(tmp_path, monkeypatch):
    path = tmp_path / "club.sqlite"
    with Database(path).writing() as connection:
        connection.execute("insert into athlete (name) values ('Anna')")
    more = (*VERSIONS, ("alter table athlete add column club text not null default 'ours'",))
    monkeypatch.setattr("agents.app.club.database.VERSIONS", more)
    with Database(path).reading() as connection:
        assert tuple(connection.execute("select name, club from athlete").fetchone()) == (
            "Anna",
            "ours",
        )


def test_a_version_that_fails_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    path = tmp_path / "club.sqlite"
    Database(path)
    broken = (*VERSIONS, ("alter table athlete add column club text", "no such thing"))
    monkeypatch.setattr("agents.app.club.database.VERSIONS", broken)
    with pytest.raises(InputError):
        Database(path)
    monkeypatch.undo()
    with Database(path).reading() as connection:
        columns = [row[1] for row in connection.execute("pragma table_info(athlete)")]
    assert "club" not in columns


def test_files_that_are_not_a_clubs_are_refused_and_left_alone(tmp_path):
    other = tmp_path / "other.sqlite"
    with sqlite3.connect(other) as connection:
        connection.execute("create table mine (x)")
    with pytest.raises(InputError, match="another program"):
        Database(other)
    text = tmp_path / "text.sqlite"
    text.write_text("no database at all, but long enough to look at\n" * 50)
    with pytest.raises(InputError, match=r"text\.sqlite"):
        Database(text)
    newer = tmp_path / "newer.sqlite"
    Database(newer)
    with sqlite3.connect(newer) as connection:
        connection.execute("pragma user_version = 99")
    with pytest.raises(InputError, match="newer version"):
        Database(newer)


def test_a_killed_writer_leaves_what_it_had_finished(tmp_path):
    folder = tmp_path / "club"
    Club(folder)
    program = f"""
        import os, signal
        from agents.app.club import Club
        club = Club({str(folder)!r})
        with club.database.writing() as connection:
            connection.execute("insert into athlete (name) values ('Anna')")
        with club.database.writing() as connection:
            connection.execute("insert into athlete (name) values ('Ben')")
            os.kill(os.getpid(), signal.SIGKILL)
    """
    ended = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], check=False)
    assert ended.returncode == -9
    assert [athlete.name for athlete in Club(folder).athletes()] == ["Anna"]


def test_a_row_cannot_point_at_nothing(tmp_path):
    with (
        pytest.raises(sqlite3.IntegrityError),
        Database(tmp_path / "club.sqlite").writing() as connection,
    ):
        connection.execute("insert into note (session_id, text, written) values (7, 'x', 'y')")
