"""Films that come into a session: sent by a browser piece by piece, or there already.

A film that is sent lies beside its place as a draft until all of it has come. How much of it is on
the disk is kept in the database, and never more than is there, so that its sender continues there
after a power cut.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

from agents.app.club.club import FILMS, Club, added, changed, digest_of_file
from agents.app.club.database import row_of
from agents.app.club.records import Camera, Film, Session, State
from curling_env.errors import InputError
from curling_env.infrastructure.files.writing import fitted, make_directory
from friction_estimation.film.video import SUFFIXES, TIMES_SUFFIX

MAX_FILM = 64 * 2**30
"""Largest film [bytes]."""
MAX_FILMS = 500
"""Films of a session."""
SPARE = 2**30
"""Left free on the disk when a film is sent [bytes]."""
DRAFT = ".part"


def begin_film(club: Club, session: Session, name: str, size: int) -> Film:
    """Begin to receive a film, or continue with one of that name and size.

    Parameters
    ----------
    name : of its file, wherever it comes from
    size : in bytes

    Raises
    ------
    InputError : an unsupported file extension, a size of 0 or too large, or too many films
    """
    name = Path(name.replace("\\", "/")).name
    if Path(name).suffix.lower() not in SUFFIXES or len(name) > 200 or not name.isprintable():
        raise InputError(
            f"unsupported file extension; expected one of {', '.join(SUFFIXES)}", source=name[:80]
        )
    if not 0 < size <= MAX_FILM:
        raise InputError(f"expected a film of 1 byte to {MAX_FILM >> 30} GB", source=name[:80])
    folder = make_directory(club.folder_of(session) / "films")
    with club.database.writing() as connection:
        found = film_in(connection, session, name=name, size=size)
        if found is not None:
            return found
        if shutil.disk_usage(folder).free < size + SPARE:
            raise InputError("does not fit on the disk; free some space", source=name[:80])
        return added_film(connection, session, name, size)


def add_piece(club: Club, film: Film, begin: int, piece: bytes) -> Film:
    """Write the next piece of a film that is sent.

    Parameters
    ----------
    begin : where in the film it begins [bytes]; must be where the pieces before it end

    Raises
    ------
    InputError : it begins elsewhere, or ends beyond the film's end
    """
    with club.database.writing() as connection:  # one sender at a time
        now = row_of(connection, Film, "select * from film where id = ?", (film.id,))
        assert now is not None
        if begin != now.received or begin + len(piece) > now.size:
            raise InputError(f"expected the bytes from {now.received} on", source=now.name)
        target = club.path(now.file)
        draft = target.with_name(target.name + DRAFT)
        with draft.open("r+b" if draft.exists() else "x+b") as file:
            file.truncate(begin)  # what a killed server had not counted
            file.seek(begin)
            file.write(piece)
            file.flush()
            os.fsync(file.fileno())
        received = begin + len(piece)
        if received == now.size:
            draft.replace(target)
        changed(connection, "film", now.id, received=received)
    return replace(now, received=received)


def settle_films(club: Club) -> None:
    """Complete what a killed server, or an earlier version of this program, has left undone.

    That is the count of a film's last piece, and the marks with which a film was tracked.
    """
    with club.database.writing() as connection:
        query = "select * from film where received < size"
        for row in connection.execute(query).fetchall():
            target = club.path(row["file"])
            if target.exists() and target.stat().st_size == row["size"]:
                changed(connection, "film", row["id"], received=row["size"])
    for session in club.sessions():
        for film in club.films(session):
            if film.marks is None and film.state is State.DONE:
                club.change("film", film.id, marks=marks_of(club, club.camera_of(session, film)))


def take_film(club: Club, session: Session, path: Path) -> Film:
    """A film that lies in the club folder already.

    Raises
    ------
    InputError : it lies elsewhere, has an unsupported extension, or is in the session already
    """
    file = club.name_of(path)
    inside = club.path(file)
    if not inside.is_file() or inside.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"unsupported file extension; expected one of {', '.join(SUFFIXES)}", source=file[:80]
        )
    size = inside.stat().st_size
    with club.database.writing() as connection:
        if film_in(connection, session, file=file) is not None:
            raise InputError("this film is already in the session", source=file[:80])
        return added_film(connection, session, inside.name, size, file=file, received=size)


def waits(club: Club, session: Session, film: Film) -> bool:
    """Return whether a film is to be tracked: for the first time, or with other marks."""
    return film.is_whole and (
        film.state in (State.WAITING, State.RUNNING) or has_other_marks(club, session, film)
    )


def has_other_marks(club: Club, session: Session, film: Film) -> bool:
    """Return whether a film was tracked with other marks than its camera has now."""
    marks = marks_of(club, club.camera_of(session, film))
    return film.state is State.DONE and None not in (marks, film.marks) and marks != film.marks


def marks_of(club: Club, camera: Camera | None) -> str | None:
    """Return a digest of the marks of a camera; None if it has not been marked."""
    if camera is None or camera.scene is None:
        return None
    return digest_of_file(club.path(camera.scene)) or None


def films_there(club: Club) -> list[str]:
    """Films in the club's folder `films` that no session has yet, by their names from there."""
    with club.database.reading() as connection:
        used = {row[0] for row in connection.execute("select file from film")}
    found = sorted((club.folder / FILMS).rglob("[!.]*"))  # hidden ones may be half-written
    names = [
        club.name_of(k)
        for k in found
        if k.suffix.lower() in SUFFIXES and k.is_file() and k.resolve().is_relative_to(club.folder)
    ]
    return [name for name in names if name not in used]


def film_in(connection: sqlite3.Connection, session: Session, **values: object) -> Film | None:
    """Return the film of a session with these values; None if absent."""
    which = "".join(f" and {name} = ?" for name in values)
    query = f"select * from film where session_id = ? and removed is null{which}"
    return row_of(connection, Film, query, (session.id, *values.values()))


def added_film(
    connection: sqlite3.Connection,
    session: Session,
    name: str,
    size: int,
    *,
    file: str = "",
    **values: object,
) -> Film:
    """Add a film after those of a session.

    Parameters
    ----------
    file : where it lies, from the club folder; by default in the folder of the session
    values : further columns

    Raises
    ------
    InputError : too many films
    """
    query = "select count(*), coalesce(max(place), -1) + 1 from film where session_id = ?"
    count, place = connection.execute(query, (session.id,)).fetchone()
    if count >= MAX_FILMS:
        raise InputError(f"a session has at most {MAX_FILMS} films", source=session.name)
    # Room for the names that are made from it: of its draft, and of a table of its times.
    fitting = fitted(f"{place:03d}-{Path(name).stem}", f"{Path(name).suffix}{TIMES_SUFFIX}")
    number = added(
        connection,
        "film",
        session_id=session.id,
        place=place,
        name=name,
        file=file or f"{session.folder}/films/{fitting.removesuffix(TIMES_SUFFIX)}",
        size=size,
        **values,
    )
    found = row_of(connection, Film, "select * from film where id = ?", (number,))
    assert found is not None
    return found
