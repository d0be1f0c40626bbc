"""Taking sessions, films and throws away, and bringing them back.

What is removed is no longer shown and no longer in the files that commands read; it stays on the
disk, with all that a coach has entered, until it is deleted for good.
"""

from __future__ import annotations

import datetime
import shutil
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

from agents.app.club.club import PLAYABLE, Club
from agents.app.club.database import row_of, rows_of
from agents.app.club.films import DRAFT
from agents.app.club.records import Film, Session
from agents.app.club.session_files import finish_files, part_path

Kind = Literal["session", "film", "throw"]
KINDS: tuple[Kind, ...] = ("session", "film", "throw")


REMOVED_SESSIONS = """
    select 'session' as kind, id, name || ', ' || day as name, removed as "when" from session
    where removed is not null order by removed desc"""
REMOVED_IN_SESSION = """
    select 'film' as kind, id, name, removed as "when", place as n, 0 as later from film
    where session_id = ? and removed is not null
    union all
    select 'throw', throw.id, 'throw ' || (throw.number + 1) || coalesce(', ' || athlete.name, '')
        || iif(called = '', '', ', ' || called) || coalesce(', ' || film.name, ''),
        throw.removed, throw.number, 1 from throw left join film on film.id = throw.film_id
        left join athlete on athlete.id = throw.athlete_id
    where throw.session_id = ? and throw.removed is not null and film.removed is null
    order by later, n, id"""


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
    return club.database.rows(Removed, REMOVED_SESSIONS)


def removed_in(club: Club, session: Session) -> list[Removed]:
    """Films and throws of a session that were removed, in the order of play."""
    return club.database.rows(Removed, REMOVED_IN_SESSION, session.id, session.id)


def delete_for_good(club: Club, kind: Kind, number: int) -> None:
    """Delete what was removed, with its files; what was not removed first stays.

    A throw is a part of its film's tracks, which stay; so only sessions and films are deleted.
    """
    if kind == "throw":
        return
    with club.database.writing() as connection:
        if kind == "session":
            query = "select * from session where id = ? and removed is not null"
        else:
            query = (
                "select session.* from film join session on session.id = film.session_id "
                "where film.id = ? and film.removed is not null"
            )
        session = row_of(connection, Session, query, (number,))
        if session is None:
            return
        which = "session_id" if kind == "session" else "id"
        films = rows_of(connection, Film, f"select * from film where {which} = ?", (number,))
        for film in films:
            connection.execute("delete from throw where film_id = ?", (film.id,))
            connection.execute("delete from film where id = ?", (film.id,))
        if kind == "session":
            for row in ("throw", "note", "job"):
                connection.execute(f"delete from {row} where session_id = ?", (number,))
            for name in (f"causes {number} %", f"draws {number}"):
                connection.execute("delete from answer where name like ?", (name,))
            connection.execute("delete from session where id = ?", (number,))
    # Only now: a row without its file would be worse than a file without its row.
    for film in films:
        _delete_files(club, session, film)
    if kind == "session":
        shutil.rmtree(club.folder_of(session), ignore_errors=True)


def _delete_files(club: Club, session: Session, film: Film) -> None:
    """Delete what was found in a film, its copy, and the film if it was sent here."""
    part, path = part_path(club, session, film), club.path(film.file)
    paths = [
        part,
        part.with_suffix(".json"),
        *(club.path(f"{PLAYABLE}/film-{film.id}.{kind}") for kind in ("mp4", "jpg")),
    ]
    if path.is_relative_to(club.folder_of(session)):  # a film elsewhere is the user's
        paths += [path, path.with_name(path.name + DRAFT)]
    for one in paths:
        with suppress(OSError):
            one.unlink(missing_ok=True)


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
