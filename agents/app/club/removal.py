"""Taking sessions, films and throws away, and bringing them back.

What is removed is no longer shown and no longer in the files that commands read; it stays on the
disk, with all that a coach has entered, until it is deleted for good.
"""

from __future__ import annotations

import datetime
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from agents.app.club.club import Club
from agents.app.club.database import rows_of
from agents.app.club.records import Film, Session, Throw
from agents.app.club.session_files import finish_files, part_path

Kind = Literal["session", "film", "throw"]
KINDS: tuple[Kind, ...] = ("session", "film", "throw")


@dataclass(frozen=True, kw_only=True)
class Removed:
    """Something that was removed.

    Parameters
    ----------
    name : what people know it by
    when : when it was removed
    """

    kind: Kind
    id: int
    name: str
    when: str


def remove(club: Club, kind: Kind, number: int) -> None:
    """Take something away, so that `bring_back` brings it back as it was."""
    _mark(club, kind, number, datetime.datetime.now().isoformat(" ", "minutes"))


def bring_back(club: Club, kind: Kind, number: int) -> None:
    """Show again what was removed."""
    _mark(club, kind, number, None)


def removed_sessions(club: Club) -> list[Removed]:
    """Sessions that were removed, the latest first."""
    with club.database.reading() as connection:
        query = "select * from session where removed is not null order by removed desc"
        found = rows_of(connection, Session, query)
    return [
        Removed(kind="session", id=one.id, name=f"{one.name}, {one.day}", when=one.removed or "")
        for one in found
    ]


def removed_in(club: Club, session: Session) -> list[Removed]:
    """Films and throws of a session that were removed, in the order of play."""
    with club.database.reading() as connection:
        query = "select * from film where session_id = ? and removed is not null order by place"
        films = rows_of(connection, Film, query, (session.id,))
        query = (
            "select throw.* from throw left join film on film.id = throw.film_id "
            "where throw.session_id = ? and throw.removed is not null and film.removed is null "
            "order by throw.number, throw.id"
        )
        throws = rows_of(connection, Throw, query, (session.id,))
        names = dict(connection.execute("select id, name from athlete").fetchall())
    shown = {film.id: film.name for film in club.films(session)}
    found = [
        Removed(kind="film", id=one.id, name=one.name, when=one.removed or "") for one in films
    ]
    for one in throws:
        about = (names.get(one.athlete_id), one.called, shown.get(one.film_id or 0))
        name = ", ".join(filter(None, (f"throw that was number {one.number + 1}", *about)))
        found.append(Removed(kind="throw", id=one.id, name=name, when=one.removed or ""))
    return found


def delete_for_good(club: Club, kind: Kind, number: int) -> None:
    """Delete what was removed, with its files; what was not removed first stays.

    A throw is a part of its film's tracks, which stay; so only sessions and films are deleted.
    """
    with club.database.writing() as connection:
        table = {"session": Session, "film": Film}.get(kind)
        if table is None:
            return
        query = f"select * from {kind} where id = ? and removed is not null"
        found = rows_of(connection, table, query, (number,))
        if not found:
            return
        films = found if kind == "film" else _films_of(connection, number)
        for film in films:
            connection.execute("delete from throw where film_id = ?", (film.id,))
            connection.execute("delete from film where id = ?", (film.id,))
        if kind == "session":
            for row in ("throw", "note", "job"):
                connection.execute(f"delete from {row} where session_id = ?", (number,))
            connection.execute("delete from session where id = ?", (number,))
    # Only now: a row without its file would be worse than a file without its row.
    for one in found:
        if isinstance(one, Session):
            shutil.rmtree(club.folder_of(one), ignore_errors=True)
        else:
            _delete_files(club, one)


def _films_of(connection: sqlite3.Connection, session: int) -> list[Film]:
    return rows_of(connection, Film, "select * from film where session_id = ?", (session,))


def _delete_files(club: Club, film: Film) -> None:
    """A film's file, if it was sent here, and what was found in it."""
    with club.database.reading() as connection:
        query = "select * from session where id = ?"
        (session,) = rows_of(connection, Session, query, (film.session_id,))
    part = part_path(club, session, film)
    for path in (part, part.with_suffix(".json"), *_own_file(club, session, film)):
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _own_file(club: Club, session: Session, film: Film) -> Iterator[Path]:
    """The file of a film in its session's folder; one that somebody put elsewhere is theirs."""
    path = club.path(film.file)
    if path.is_relative_to(club.folder_of(session)):
        yield path
        yield path.with_name(path.name + ".part")


def _mark(club: Club, kind: Kind, number: int, when: str | None) -> None:
    with club.database.writing() as connection:
        connection.execute(f"update {kind} set removed = ? where id = ?", (when, number))
        if kind != "session":
            connection.execute(
                f"update session set stale = 1 where id = (select session_id from {kind} "
                "where id = ?)",
                (number,),
            )
    finish_files(club)
