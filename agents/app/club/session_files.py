"""A session's files as every command reads them, made from its films' tracks and the database.

The tracks of each film are kept as tracking found them. From these, and from what a coach entered,
`tracks.csv`, `throws.csv` and `athletes.csv` are written anew whenever something changes. A session
is marked as stale before and as clean after: so what a killed process left undone is done by the
next start.
"""

from __future__ import annotations

import fcntl
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from agents.app.club.club import TRACKS, Club
from agents.app.club.records import Film, Session
from agents.app.club.targets import with_places
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.storage import write_json, write_table
from curling_env.infrastructure.files.writing import make_directory, together
from curling_env.trajectory import Trajectory, read_tracks, write_tracks
from friction_estimation.tracking.stone_numbers import StoneNumbers
from friction_estimation.tracks.throw_list import THROW_LIST

PARTS = "parts"
"""Folder of what was found in each film, in the folder of a session."""
IMPORTED = "imported"
"""Name of the part that came as a tracks file, and comes first in the order of play."""
HANDS_LIST = "athletes.csv"


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """What was found in one film.

    Parameters
    ----------
    throws : for each throw its tracks, the thrown stone's first
    handles : colours of the stones' handles, in the same order
    camera : how the film's camera was solved, as `camera_document` writes it; None where the
        scene is all that is known
    """

    throws: Sequence[Sequence[Trajectory]]
    handles: Sequence[Sequence[str | None]]
    camera: dict[str, Any] | None = None


def part_path(club: Club, session: Session, film: Film | None) -> Path:
    """Where the tracks of a film are kept, or those that were imported."""
    name = IMPORTED if film is None else f"film-{film.id}"
    return club.folder_of(session) / PARTS / f"{name}.csv"


def keep_part(club: Club, session: Session, film: Film | None, part: Part) -> None:
    """Keep what was found in a film so far, and bring the session's files up to date."""
    path = part_path(club, session, film)
    make_directory(path.parent)
    with alone_in(club, session):
        with together():
            numbered = enumerate(part.throws)
            write_tracks(path, [replace(k, throw=n) for n, tracks in numbered for k in tracks])
            about = {"handles": [list(k) for k in part.handles], "camera": part.camera}
            write_json(path.with_suffix(".json"), about)
        _number_throws(club, session)
        _write_files(club, session)


def load_part(path: Path) -> Part | None:
    """What was kept of a film; None where nothing was."""
    if not path.exists():
        return None
    tracks = read_tracks(path)
    throws = [list(group) for _, group in groupby(tracks, key=lambda track: track.throw)]
    beside = path.with_suffix(".json")
    about = read_json(beside) if beside.exists() else {}
    handles = about.get("handles") or [[None] * len(tracks) for tracks in throws]
    return Part(throws=throws, handles=handles, camera=about.get("camera"))


def write_files(club: Club, session: Session) -> None:
    """Write the files of a session as the database and its films' tracks say."""
    with alone_in(club, session):
        _write_files(club, session)


def finish_files(club: Club) -> None:
    """Do what a killed process left undone."""
    for session in club.sessions():
        if session.stale:
            with alone_in(club, session):
                _number_throws(club, session)
                _write_files(club, session)


@contextmanager
def alone_in(club: Club, session: Session) -> Generator[None]:
    """Keep a session's files for this process; it ends with the process, however that ends."""
    folder = make_directory(club.folder_of(session))
    with (folder / ".writing").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


class FoundThrow(NamedTuple):
    """A throw of a session.

    Parameters
    ----------
    film : that shows it; None for one that was imported
    part : its number in the film
    clock : when it begins in the film, or in the session where there is no film [s]
    tracks : the thrown stone's, then those of the others
    """

    film: Film | None
    part: int
    clock: float
    tracks: list[Trajectory]


def session_throws(club: Club, session: Session) -> list[FoundThrow]:
    """All throws in order of play.

    Throws and stones are numbered over the whole session, and clocks count from its beginning.
    """
    found: list[FoundThrow] = []
    numbers, clock = StoneNumbers(), 0.0
    for film in (None, *club.films(session)):
        part = load_part(part_path(club, session, film))
        if part is None:
            continue
        if film is not None and film.clock is not None:
            clock = film.clock
        end = clock
        for k, (tracks, handles) in enumerate(zip(part.throws, part.handles, strict=True)):
            end = max(end, clock + tracks[0].clock + float(tracks[0].t[-1]))
            if film is None:  # its stones have their numbers
                stones = [track.stone for track in tracks]
            else:
                stones = numbers.of(tracks, handles)
            numbered = [
                replace(track, stone=stone, clock=round(clock + track.clock, 3))
                for track, stone in zip(tracks, stones, strict=True)
            ]
            found.append(FoundThrow(film, k, tracks[0].clock, numbered))
        clock = end
        if film is None:
            used = 1 + max((track.stone for one in found for track in one.tracks), default=-1)
            numbers.colours.extend([None] * used)
    removed = _removed(club, session)
    found = [one for one in found if (one.film.id if one.film else None, one.part) not in removed]
    found.sort(key=lambda one: one.tracks[0].clock)
    return [
        one._replace(tracks=[replace(track, throw=number) for track in one.tracks])
        for number, one in enumerate(found)
    ]


def _removed(club: Club, session: Session) -> set[tuple[int | None, int]]:
    """Film and part of the throws that were removed."""
    with club.database.reading() as connection:
        query = "select film_id, part from throw where session_id = ? and removed is not null"
        return {(row["film_id"], row["part"]) for row in connection.execute(query, (session.id,))}


def _number_throws(club: Club, session: Session) -> None:
    """Bring the database's throws up to date; what a coach entered stays with its throw."""
    throws = session_throws(club, session)
    with club.database.writing() as connection:
        for number, one in enumerate(throws):
            values = (number, one.clock, one.tracks[0].stone)
            key = (session.id, None if one.film is None else one.film.id, one.part)
            changed = connection.execute(
                "update throw set number = ?, clock = ?, seen_stone = ? "
                "where session_id = ? and film_id is ? and part = ?",
                (*values, *key),
            ).rowcount
            if not changed:
                connection.execute(
                    "insert into throw (number, clock, seen_stone, session_id, film_id, part) "
                    "values (?, ?, ?, ?, ?, ?)",
                    (*values, *key),
                )
        connection.execute("update session set stale = 1 where id = ?", (session.id,))


def _write_files(club: Club, session: Session) -> None:
    """Write `tracks.csv`, `throws.csv` and `athletes.csv`, and mark the session as clean."""
    throws = session_throws(club, session)
    if not throws:  # all of them were removed
        for name in (TRACKS, THROW_LIST, HANDS_LIST):
            (club.folder_of(session) / name).unlink(missing_ok=True)
    else:
        entries, targets = club.throws(session), club.named_targets()
        athletes = {one.id: one for one in club.athletes()}
        stones = {one.id: one.name for one in club.stones()}
        folder = club.folder_of(session)
        seen = [athletes[one.athlete_id] for one in entries if one.athlete_id is not None]
        throwing = {one.name: one.hand.value for one in seen}
        with together():
            write_tracks(club.tracks_of(session), [track for one in throws for track in one.tracks])
            write_table(
                folder / THROW_LIST,
                {
                    "throw": [one.number for one in entries],
                    "athlete": [
                        "" if one.athlete_id is None else athletes[one.athlete_id].name
                        for one in entries
                    ],
                    "stone": [
                        "" if one.stone_id is None else stones[one.stone_id] for one in entries
                    ],
                    "called": [with_places(one.called, targets) for one in entries],
                    "note": [one.note for one in entries],
                },
            )
            write_table(folder / HANDS_LIST, {"athlete": [*throwing], "hand": [*throwing.values()]})
    with club.database.writing() as connection:
        connection.execute("update session set stale = 0 where id = ?", (session.id,))
