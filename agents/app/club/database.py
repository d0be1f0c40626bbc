"""The club's database: one SQLite file, safe against a power cut, with its versions.

Python's own `sqlite3`: a connection to read, one to write, and rows as the frozen classes of
`records`.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from curling_env.errors import InputError

Row = TypeVar("Row")

PATIENCE = 10.0
"""Time that one writer waits for another [s]."""
APPLICATION_ID = 0x6375726C
"""By this number in its header the database of a club is known ("curl")."""


class Database:
    """One SQLite file with write-ahead log and foreign keys.

    A transaction that a killed process left is undone by SQLite when the file is opened next; one
    that had ended is on the disk.

    Parameters
    ----------
    path : the file, made if it is missing and brought to the newest version

    Raises
    ------
    InputError : another program's file, one of a newer version, or one that cannot be opened
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with self._connected() as connection:
                self._check_owner(connection)
                connection.execute("pragma journal_mode = wal")
                self._bring_up_to_date(connection)
        except sqlite3.Error as error:
            raise InputError(f"cannot be used as a database: {error}", source=path) from error

    @contextmanager
    def reading(self) -> Generator[sqlite3.Connection]:
        """A connection that sees the file as it is at its first question."""
        with self._connected() as connection:
            connection.execute("begin")
            try:
                yield connection
            finally:
                connection.rollback()

    @contextmanager
    def writing(self) -> Generator[sqlite3.Connection]:
        """A connection whose changes are all kept if the block succeeds, and else none."""
        with self._connected() as connection:
            connection.execute("begin immediate")
            try:
                yield connection
            except BaseException:
                connection.rollback()
                raise
            connection.commit()

    def rows(self, form: type[Row], query: str, *given: Any) -> list[Row]:
        """The rows that a query gives, as instances of a class of `records`."""
        with self.reading() as connection:
            return rows_of(connection, form, query, given)

    def row(self, form: type[Row], query: str, *given: Any) -> Row | None:
        """Return the first row that a query gives; None without rows."""
        return next(iter(self.rows(form, query, *given)), None)

    def write(self, query: str, *given: Any) -> None:
        """Change rows by one statement."""
        with self.writing() as connection:
            connection.execute(query, given)

    @contextmanager
    def _connected(self) -> Generator[sqlite3.Connection]:
        connection = sqlite3.connect(self.path, timeout=PATIENCE, isolation_level=None)
        try:
            connection.row_factory = sqlite3.Row
            connection.execute("pragma foreign_keys = on")
            # Each transaction is on the disk before it counts as done, also when the power goes.
            connection.execute("pragma synchronous = full")
            yield connection
        finally:
            connection.close()

    def _check_owner(self, connection: sqlite3.Connection) -> None:
        owner = connection.execute("pragma application_id").fetchone()[0]
        tables = connection.execute("select count(*) from sqlite_master").fetchone()[0]
        if owner != APPLICATION_ID and tables:
            raise InputError("is the database of another program", source=self.path)

    def _bring_up_to_date(self, connection: sqlite3.Connection) -> None:
        """Apply each version's changes in a separate transaction."""
        connection.execute(f"pragma application_id = {APPLICATION_ID}")
        connection.execute("begin immediate")
        try:
            now = connection.execute("pragma user_version").fetchone()[0]
            if now > len(VERSIONS):
                raise InputError(
                    f"was written by a newer version of this program (format {now}, "
                    f"this one knows {len(VERSIONS)})",
                    source=self.path,
                )
            for number, statements in enumerate(VERSIONS[now:], start=now + 1):
                for statement in statements:
                    connection.execute(statement)
                connection.execute(f"pragma user_version = {number}")
        except BaseException:
            connection.rollback()
            raise
        connection.commit()


def rows_of(
    connection: sqlite3.Connection, form: type[Row], query: str, given: Sequence[Any] = ()
) -> list[Row]:
    """The rows that a query gives, as instances of a class of `records`."""
    found = connection.execute(query, tuple(given)).fetchall()
    return [msgspec.convert(dict(row), form, strict=False) for row in found]


def row_of(
    connection: sqlite3.Connection, form: type[Row], query: str, given: Sequence[Any] = ()
) -> Row | None:
    """Return the first row that a query gives; None without rows."""
    return next(iter(rows_of(connection, form, query, given)), None)


_FIRST = (
    "create table setting (name text primary key, value text not null) strict",
    """create table athlete (
        id integer primary key, name text not null unique,
        hand text not null default 'right' check (hand in ('right', 'left'))) strict""",
    "create table stone (id integer primary key, name text not null unique) strict",
    """create table camera (
        id integer primary key, name text not null unique, length real not null,
        width real not null, scene text) strict""",
    """create table session (
        id integer primary key, name text not null, day text not null, sheet text not null,
        camera_id integer references camera (id), folder text not null unique,
        stale integer not null default 1) strict""",
    """create table film (
        id integer primary key, session_id integer not null references session (id),
        place integer not null, name text not null, file text not null,
        size integer not null, received integer not null default 0,
        state text not null default 'waiting', said text not null default '',
        clock real, unique (session_id, place)) strict""",
    """create table throw (
        id integer primary key, session_id integer not null references session (id),
        number integer not null, film_id integer references film (id), part integer not null,
        clock real not null default 0, seen_stone integer not null default 0,
        athlete_id integer references athlete (id), stone_id integer references stone (id),
        called text not null default '', made integer, note text not null default '',
        unique (session_id, film_id, part)) strict""",
    """create table target (
        id integer primary key, name text not null unique, x real not null, y real not null)
        strict""",
    """create table note (
        id integer primary key, session_id integer not null references session (id),
        text text not null, written text not null) strict""",
    """create table job (
        id integer primary key, kind text not null,
        session_id integer not null references session (id),
        state text not null default 'waiting', share real not null default 0,
        says text not null default '', left real, problem text,
        given text not null default '') strict""",
)

_SECOND = tuple(
    f"alter table {table} add column removed text"
    for table in ("session", "film", "throw", "target")
)

_THIRD = ("alter table film add column camera_id integer references camera (id)",)

_FOURTH = (
    "alter table throw add column settled integer not null default 1",
    "alter table throw add column measures blob",
    "alter table throw add column measured_of text not null default ''",
    "alter table film add column marks text",
    "alter table session add column ice_of text",
    # Numbers of what is removed are not reserved yet.
    """update throw set settled = 0 where removed is not null
        or film_id in (select id from film where removed is not null)""",
)

_FIFTH = (
    *(
        f"alter table session add column {name} text not null default ''"
        for name in ("lineup", "drill", "pebble", "temperature", "humidity", "scrape", "draws")
    ),
    "alter table session add column live blob",
    "alter table session add column live_rests integer not null default 0",
    "alter table session add column live_film integer not null default 0",
    "alter table throw add column swept text not null default ''",
    """create table answer (
        name text primary key, of text not null, content blob not null) strict""",
    """create table position (
        id integer primary key, name text not null unique, address text not null) strict""",
)

_SIXTH = (
    # Throws of the first versions are measured at the next start.
    "update session set stale = 1 "
    "where id in (select session_id from throw where measures is null)",
    "delete from job where kind = 'measure'",
    "alter table session drop column draws",
)

VERSIONS = (_FIRST, _SECOND, _THIRD, _FOURTH, _FIFTH, _SIXTH)
"""The statements of each version, oldest first."""
