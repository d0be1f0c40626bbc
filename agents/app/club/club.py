"""The club: its folder, and questions to its database."""

from __future__ import annotations

import fcntl
import re
import secrets
import sqlite3
import unicodedata
from collections.abc import Generator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from agents.app.club.database import Database, Row, rows_of
from agents.app.club.records import (
    Answer,
    Athlete,
    Camera,
    Film,
    Note,
    Session,
    Stone,
    Target,
    Throw,
)
from curling_env.errors import InputError
from curling_env.infrastructure.files.writing import make_directory
from curling_env.infrastructure.provenance import sha256_of
from curling_env.units import Units

DATABASE = "club.sqlite"
SESSIONS, FILMS, CAMERAS, PLAYABLE = "sessions", "films", "cameras", "playable"
TRACKS, ICE, DISCOVERY = "tracks.csv", "ice.json", "discovery"
"""Names of a session's files, as every command knows them."""
LONGEST_NAME = 80
THROWS = (
    "select throw.*, coalesce(athlete.name, '') as athlete, coalesce(stone.name, '') as stone, "
    "coalesce(athlete.hand, 'right') as hand from throw left join film on film.id = throw.film_id "
    "left join athlete on athlete.id = throw.athlete_id "
    "left join stone on stone.id = throw.stone_id "
    "where throw.removed is null and film.removed is null and "
)
"""The question for throws that are there, with the names of athlete and stone."""


class Club:
    """A club folder.

    Parameters
    ----------
    folder : made if it is missing

    Raises
    ------
    InputError : a database that cannot be used
    OutputError : the folder cannot be made
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = make_directory(folder).resolve()
        for name in (SESSIONS, FILMS, CAMERAS):
            make_directory(self.folder / name)
        self.database = Database(self.folder / DATABASE)

    # --- the folder ------------------------------------------------------------------------------

    @contextmanager
    def alone(self) -> Generator[None]:
        """Keep the folder for one server.

        Raises
        ------
        InputError : another one has it
        """
        with (self.folder / ".open").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise InputError(
                    "is open in another `curling app`; close that one first", source=self.folder
                ) from None
            yield

    def path(self, name: str) -> Path:
        """A file of the folder by its name from there.

        Raises
        ------
        InputError : it leads out of the folder, also by a link
        """
        try:
            path = (self.folder / name).resolve()
        except (OSError, RuntimeError, ValueError) as error:
            raise InputError("expected a plain file name", source=name[:80]) from error
        if not path.is_relative_to(self.folder):
            raise InputError("lies outside of the club folder", source=name[:80])
        return path

    def name_of(self, path: Path) -> str:
        """The name of a file from the folder.

        Raises
        ------
        InputError : it lies elsewhere
        """
        return self.path(str(path)).relative_to(self.folder).as_posix()

    def folder_of(self, session: Session) -> Path:
        """Return the folder of a session: `tracks.csv`, `throws.csv`, `ice.json`, and others."""
        return self.path(session.folder)

    def tracks_of(self, session: Session) -> Path:
        """The tracks file of a session, which may not be there yet."""
        return self.folder_of(session) / TRACKS

    def ice_of(self, session: Session) -> Path:
        """The ice file of a session, which may not be there yet."""
        return self.folder_of(session) / ICE

    @property
    def units(self) -> Units:
        """Units in which the app displays lengths."""
        return Units(self.setting("units") or Units.METRES)

    def choose_units(self, units: Units) -> None:
        """Display lengths in these units, in the whole app."""
        self.keep_setting("units", units)

    def secret(self, name: str) -> str:
        """A secret that is kept, made when it is first asked for.

        Parameters
        ----------
        name : which one, such as ``this machine`` or ``network``
        """
        query = "insert into setting values (?, ?) on conflict do nothing"
        self.database.write(query, f"secret: {name}", secrets.token_urlsafe(16))
        return self.setting(f"secret: {name}")

    def setting(self, name: str) -> str:
        """A setting that is kept; empty if absent."""
        with self.database.reading() as connection:
            query = "select value from setting where name = ?"
            found = connection.execute(query, (name,)).fetchone()
        return "" if found is None else str(found[0])

    def keep_setting(self, name: str, value: str) -> None:
        """Keep a setting."""
        self.database.write("insert or replace into setting values (?, ?)", name, value)

    # --- what is in it ---------------------------------------------------------------------------

    def athletes(self) -> list[Athlete]:
        """All athletes by name."""
        return self.database.rows(Athlete, "select * from athlete order by name")

    def stones(self) -> list[Stone]:
        """All stones, by name as people count: red 2 before red 10."""
        found = self.database.rows(Stone, "select * from stone")
        return sorted(found, key=lambda stone: _as_counted(stone.name))

    def cameras(self) -> list[Camera]:
        """All cameras by name."""
        return self.database.rows(Camera, "select * from camera order by name")

    def camera(self, number: int | None) -> Camera | None:
        """A camera by its number."""
        return self.database.row(Camera, "select * from camera where id = ?", number)

    def camera_of(self, session: Session, film: Film) -> Camera | None:
        """The camera of a film: the session's, or as it stood after it was moved."""
        number = session.camera_id if film.camera_id is None else film.camera_id
        return self.camera(number)

    def sessions(self) -> list[Session]:
        """All sessions, the latest first."""
        query = "select * from session where removed is null order by day desc, id desc"
        return self.database.rows(Session, query)

    def session(self, number: int) -> Session | None:
        """A session by its number."""
        query = "select * from session where id = ? and removed is null"
        return self.database.row(Session, query, number)

    def films(self, session: Session) -> list[Film]:
        """The films of a session in order of play."""
        query = "select * from film where session_id = ? and removed is null order by place"
        return self.database.rows(Film, query, session.id)

    def film(self, number: int | None) -> Film | None:
        """A film by its number."""
        query = "select * from film where id = ? and removed is null"
        return self.database.row(Film, query, number)

    def throws(self, session: Session) -> list[Throw]:
        """The throws of a session in order of play."""
        query = f"{THROWS} throw.session_id = ? order by throw.number"
        return self.database.rows(Throw, query, session.id)

    def throw(self, number: int) -> Throw | None:
        """A throw by its own number, not that within its session."""
        return self.database.row(Throw, f"{THROWS} throw.id = ?", number)

    def names(self, table: str) -> list[tuple[int, str]]:
        """Numbers and names of a table, sorted as people count."""
        there = " where removed is null" if table == "target" else ""
        with self.database.reading() as connection:
            found = connection.execute(f"select id, name from {table}{there}").fetchall()
        return sorted(map(tuple, found), key=lambda one: _as_counted(one[1]))

    def targets(self) -> list[Target]:
        """The targets that are offered, by name."""
        return [target for target in self.named_targets() if target.removed is None]

    def named_targets(self) -> list[Target]:
        """All targets that calls may name, also those that are no longer offered."""
        return self.database.rows(Target, "select * from target order by name")

    def notes(self, session: Session) -> list[Note]:
        """Remarks about a session, in the order in which they were written."""
        query = "select * from note where session_id = ? order by id"
        return self.database.rows(Note, query, session.id)

    # --- what is added and changed ---------------------------------------------------------------

    def answer(self, name: str, form: type[Row]) -> tuple[Row, str] | None:
        """Return an answer that was kept and the digest of what it follows from; None without."""
        found = self.database.row(Answer, "select * from answer where name = ?", name)
        try:
            return None if found is None else (decoded(found.content, form), found.of)
        except msgspec.DecodeError:  # of another version of this program
            return None

    def keep_answer(self, name: str, of: str, answer: object) -> None:
        """Keep an answer, with the digest of what it follows from."""
        query = "insert or replace into answer values (?, ?, ?)"
        self.database.write(query, name, of, encoded(answer))

    def add(self, form: type[Row], **values: object) -> Row:
        """Add a row to the table of a class of `records`."""
        table = form.__name__.lower()
        with self.database.writing() as connection:
            number = added(connection, table, **values)
            (found,) = rows_of(connection, form, f"select * from {table} where id = ?", (number,))
        return found

    def change(self, table: str, row: int, /, **values: object) -> None:
        """Change values of a row."""
        with self.database.writing() as connection:
            changed(connection, table, row, **values)

    def add_session(self, name: str, day: str, sheet: str, camera: Camera | None) -> Session:
        """Add a session with its own folder.

        Raises
        ------
        InputError : an empty or too long name
        """
        name = named(name, "a session")
        with self.database.writing() as connection:
            after = connection.execute("select coalesce(max(id), 0) + 1 from session").fetchone()[0]
            folder = f"{SESSIONS}/{day}-{after}-{plain(name)}"
            number = connection.execute(
                "insert into session (name, day, sheet, camera_id, folder) values (?, ?, ?, ?, ?)",
                (name, day, sheet, None if camera is None else camera.id, folder),
            ).lastrowid
            make_directory(self.folder / folder)
        found = self.session(number or 0)
        assert found is not None
        return found


def encoded(value: object) -> bytes:
    """A value for the database, with NumPy's arrays."""

    def as_list(one: Any) -> Any:
        if isinstance(one, np.ndarray | np.generic):
            return one.tolist()
        raise NotImplementedError

    return msgspec.msgpack.encode(value, enc_hook=as_list)


@lru_cache(maxsize=4096)
def decoded(content: bytes, form: type[Row]) -> Row:
    """A value that `encoded` has written."""

    def as_array(_kind: Any, value: Any) -> Any:
        return np.array(value, dtype=np.float64)

    return msgspec.msgpack.decode(content, type=form, dec_hook=as_array)


def added(connection: sqlite3.Connection, table: str, **values: object) -> int:
    """Add a row; gives its number."""
    names, marks = ", ".join(values), ", ".join("?" * len(values))
    query = f"insert into {table} ({names}) values ({marks})"
    number = connection.execute(query, tuple(values.values())).lastrowid
    assert number is not None
    return number


def changed(connection: sqlite3.Connection, table: str, row: int, /, **values: object) -> None:
    """Change values of a row."""
    names = ", ".join(f"{name} = ?" for name in values)
    connection.execute(f"update {table} set {names} where id = ?", (*values.values(), row))


def named_row(connection: sqlite3.Connection, table: str, name: str, **new: object) -> int | None:
    """Return the number of an athlete or a stone by name, added if new; None without a name.

    Parameters
    ----------
    new : further values of a row that is added
    """
    if not name:
        return None
    name = named(name, "an athlete" if table == "athlete" else "a stone")
    query = f"select id from {table} where name = ?"
    found = connection.execute(query, (name,)).fetchone()
    return added(connection, table, name=name, **new) if found is None else found[0]


def named(text: str, what: str) -> str:
    """Return a name that a user typed, in one line.

    Raises
    ------
    InputError : nothing, or more than a name
    """
    name = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    if not 1 <= len(name) <= LONGEST_NAME:
        raise InputError(
            f"the name of {what} has {len(name)} letters; expected 1 to {LONGEST_NAME}"
        )
    return name


def digest_of_file(path: Path) -> str:
    """Return a digest of a file's content; empty without the file."""
    try:
        return _digest(path, path.stat().st_mtime_ns)
    except OSError:
        return ""


@lru_cache(maxsize=512)
def _digest(path: Path, _changed: int) -> str:
    return str(sha256_of(path))


def plain(name: str) -> str:
    """A name as part of a file's name on any system."""
    letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", letters).strip("-")[:40] or "session"


def _as_counted(name: str) -> list[tuple[int, str]]:
    parts = re.findall(r"\d+|\D+", name.lower())
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]
