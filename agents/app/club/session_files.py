"""A session's files as every command reads them, made from its films' tracks and the database.

The tracks of each film are kept as tracking found them, and measured when they come in. From these,
and from what a coach entered, `tracks.csv`, `throws.csv` and `athletes.csv` are written again
whenever something changes. A session is marked as stale before and as clean after: the next start
finishes what a killed process left undone.
"""

from __future__ import annotations

import fcntl
import hashlib
import sqlite3
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.app.club.club import TRACKS, Club, added, changed, decoded, encoded, named_row
from agents.app.club.database import rows_of
from agents.app.club.records import Film, Session, State, Throw
from agents.app.club.targets import with_places
from agents.coaching.throw_sheet import HANDS_LIST
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.storage import write_json, write_table
from curling_env.infrastructure.files.writing import make_directory, together
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory, read_tracks, write_tracks
from friction_estimation.tracking.stone_numbers import StoneNumbers
from friction_estimation.tracks.throw_list import THROW_LIST
from friction_estimation.tracks.throw_table import ThrowMeasures, rows_until, throw_table

PARTS = "parts"
"""Folder of what was found in each film, in the folder of a session."""
IMPORTED = "imported"
"""Name of the part that came as a tracks file, and comes first in the order of play."""
LONGEST_CELL = 900
"""Longest note in the table of throws; commands read at most 1,000 letters of a cell."""
NOTES_CHANGED = 2
"""State of a session's files in which only what a coach entered has changed since."""
SWEPT = {
    "no": (np.inf, np.inf),
    "first half": (-HOG_LINE_Y, 0.0),
    "second half": (0.0, np.inf),
    "all the way": (-HOG_LINE_Y, np.inf),
}
"""Swept stretches in the words of a coach: from and to, along the way of play [m]."""
SAME_STONE = 0.3
"""Two tracks of a film are of one stone if their median distance is less [m]."""
STOPPED_SECONDS, STOPPED_WITHIN = 1.0, 0.05
"""A stone has stopped once it has moved less than this in this time [s, m]."""
MOVED_ON = 0.4
"""A stone that has stopped and is farther away later was moved, or is another one [m]."""
LEAST_COMMON = 0.5
"""Shortest common time of two such tracks, as a part of the shorter one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """Tracks found in one film.

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
    """Path of the tracks of a film, or of those that were imported."""
    name = IMPORTED if film is None else f"film-{film.id}"
    return club.folder_of(session) / PARTS / f"{name}.csv"


def keep_part(club: Club, session: Session, film: Film | None, part: Part) -> None:
    """Keep the tracks found in a film, and bring the session's files up to date.

    A throw that was found before keeps what a coach entered, whichever place it has in the film
    now. A throw with entries that is no longer found is removed, and can be seen there.
    """
    with alone_in(club, session):
        save_part(club, session, film, part)
        _bring_up_to_date(club, session)


def save_part(club: Club, session: Session, film: Film | None, part: Part) -> None:
    """Keep the tracks found in a film; `write_files` brings the session's files up to date."""
    path = part_path(club, session, film)
    make_directory(path.parent)
    before = load_part(path)
    if film is not None:
        part = _cleaned(part)
    if before is not None and film is not None:
        _move_entries(club, film, before.throws, part.throws)
    with together():
        numbered = enumerate(part.throws)
        write_tracks(path, [replace(k, throw=n) for n, tracks in numbered for k in tracks])
        about = {"handles": [list(k) for k in part.handles], "camera": part.camera}
        write_json(path.with_suffix(".json"), about)


def load_part(path: Path) -> Part | None:
    """Load the part kept of a film; None if absent."""
    if not path.exists():
        return None
    tracks = read_tracks(path)
    throws = [list(group) for _, group in groupby(tracks, key=lambda track: track.throw)]
    beside = path.with_suffix(".json")
    about = read_json(beside) if beside.exists() else {}
    handles = about.get("handles") or [[None] * len(tracks) for tracks in throws]
    return Part(throws=throws, handles=handles, camera=about.get("camera"))


def write_files(club: Club, session: Session) -> None:
    """Number and measure the throws of a session, and write its files."""
    with alone_in(club, session):
        _bring_up_to_date(club, session)


def finish_files(club: Club) -> None:
    """Write the files of all sessions that have changed, or whose writer was killed."""
    for session in club.sessions():
        if session.stale == NOTES_CHANGED:
            with alone_in(club, session):
                _write_notes(club, session)
        elif session.stale:
            write_files(club, session)


def note_change(connection: sqlite3.Connection, which: str, *given: object) -> None:
    """Mark sessions whose tables of throws and athletes `finish_files` has to write.

    Parameters
    ----------
    which : condition on `session`
    """
    query = f"update session set stale = {NOTES_CHANGED} where stale <> 1 and {which}"
    connection.execute(query, given)


@contextmanager
def alone_in(club: Club, session: Session) -> Generator[None]:
    """Keep a session's files for this process; it ends with the process, however that ends."""
    folder = make_directory(club.folder_of(session))
    with (folder / ".writing").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def measures_of(content: bytes | None) -> ThrowMeasures | None:
    """The measurements kept of a throw; None if it is not measured, or too short."""
    return decoded(content, ThrowMeasures) if content else None


class _FoundThrow(NamedTuple):
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

    @property
    def key(self) -> tuple[int | None, int]:
        return (None if self.film is None else self.film.id, self.part)


def _throws_in_parts(club: Club, session: Session) -> list[_FoundThrow]:
    """All throws in order of play, not numbered yet; clocks count from the session's beginning."""
    found: list[_FoundThrow] = []
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
            found.append(_FoundThrow(film, k, tracks[0].clock, numbered))
        clock = end
        if film is None:
            used = 1 + max((track.stone for one in found for track in one.tracks), default=-1)
            numbers.colours.extend([None] * used)
    return sorted(found, key=lambda one: one.tracks[0].clock)


def _bring_up_to_date(club: Club, session: Session) -> None:
    """Number and measure the throws, write the files, and mark the session as clean."""
    found = _throws_in_parts(club, session)
    open_places = [
        film.place
        for film in club.films(session)
        if not film.is_whole or film.state in (State.WAITING, State.RUNNING)
    ]
    first_open = min(open_places, default=10**9)
    with club.database.reading() as connection:
        query = "select * from throw where session_id = ?"
        known = rows_of(connection, Throw, query, (session.id,))
    rows = {(one.film_id, one.part): one for one in known}
    free = 1 + max((one.number for one in known if one.settled), default=-1)
    shown: list[list[Trajectory]] = []
    entered: list[tuple[Throw | None, dict[str, Any]]] = []
    for one in found:
        row = rows.get(one.key)
        number = free if row is None or not row.settled else row.number
        free = max(free, number + 1)
        tracks = [replace(track, throw=number) for track in one.tracks]
        settled = one.film is None or one.film.place <= first_open
        film, part = one.key
        values: dict[str, Any] = {
            "session_id": session.id,
            "film_id": film,
            "part": part,
            "number": number,
            "clock": one.clock,
            "seen_stone": tracks[0].stone,
            "settled": settled or (row is not None and row.settled),
        }
        digest = _digest(tracks)
        if row is None or row.measured_of != digest:
            # Nothing is kept of a throw that is too short.
            table = throw_table(tracks)
            measures = encoded(table[0]) if table else b""
            values |= {"measures": measures, "measured_of": digest}
        entered.append((row, values))
        if row is None or row.removed is None:
            shown.append(tracks if row is None else [_as_swept(tracks[0], row.swept), *tracks[1:]])
    with club.database.writing() as connection:
        for row, values in entered:
            if row is None:
                if values["film_id"] is not None:
                    values |= _called_now(connection, session.id, values["film_id"])
                added(connection, "throw", **values)
            else:
                changed(connection, "throw", row.id, **values)
        changed(connection, "session", session.id, stale=1)
    _write_files(club, session, sorted(shown, key=lambda tracks: tracks[0].throw))


def _called_now(connection: sqlite3.Connection, session: int, film: int) -> dict[str, Any]:
    """Entries of a throw that has just been found: whose turn it was, and the call of the drill."""
    query = "select lineup, drill from session where id = ?"
    lineup, drill = connection.execute(query, (session,)).fetchone()
    first, *others = [name.strip() for name in lineup.split(",")]
    changed(connection, "session", session, lineup=", ".join([*others, first]))
    connection.execute(  # if it is this throw that was seen live
        "update session set live = null, live_rests = 0 where id = ? and live_film <= "
        "(select place from film where id = ?)",
        (session, film),
    )
    return {"called": drill, "athlete_id": named_row(connection, "athlete", first)}


def _as_swept(track: Trajectory, words: str) -> Trajectory:
    """A track swept where a coach noted it; as it is where nothing was noted."""
    if words not in SWEPT:
        return track
    ahead = track.xy[:, 1] * (1.0 if track.xy[-1, 1] >= track.xy[0, 1] else -1.0)
    begin, end = SWEPT[words]
    return replace(track, swept=((ahead >= begin) & (ahead < end)).astype(np.float64))


def _digest(tracks: Sequence[Trajectory]) -> str:
    """A digest of the measured stone's tracks with their numbers."""
    made = hashlib.sha1(usedforsecurity=False)
    for track in tracks:
        made.update(f"{track.throw} {track.stone} {track.clock}".encode())
        for values in (track.t, track.xy, track.theta):
            made.update(np.ascontiguousarray(values).tobytes())
    return made.hexdigest()


def _write_files(club: Club, session: Session, throws: Sequence[Sequence[Trajectory]]) -> None:
    """Write `tracks.csv`, `throws.csv` and `athletes.csv`, and mark the session as clean."""
    if throws:
        with together():
            write_tracks(club.tracks_of(session), [track for tracks in throws for track in tracks])
            _write_notes(club, session)
        return
    for name in (TRACKS, THROW_LIST, HANDS_LIST):  # all of them were removed
        (club.folder_of(session) / name).unlink(missing_ok=True)
    club.change("session", session.id, stale=0)


def _write_notes(club: Club, session: Session) -> None:
    """Write `throws.csv` and `athletes.csv` from a coach's entries."""
    folder = club.folder_of(session)
    entries = [one for one in club.throws(session) if one.part >= 0]
    targets = club.named_targets()
    throwing = {one.athlete: one.hand.value for one in entries if one.athlete}
    if entries:
        with together():
            write_table(
                folder / THROW_LIST,
                {
                    "throw": [one.number for one in entries],
                    "athlete": [one.athlete for one in entries],
                    "stone": [one.stone for one in entries],
                    "called": [with_places(one.called, targets) for one in entries],
                    "note": [_cell(one.note) for one in entries],
                },
            )
            write_table(folder / HANDS_LIST, {"athlete": [*throwing], "hand": [*throwing.values()]})
    club.change("session", session.id, stale=0)


def _cell(note: str) -> str:
    """A note in one line of the table; the database keeps all of a long one."""
    line = " ".join(note.split())
    return line if len(line) <= LONGEST_CELL else f"{line[:LONGEST_CELL]} …"


# --- throws that were found before ------------------------------------------------------------


def _cleaned(part: Part) -> Part:
    """The throws of a film, each until its stone has stopped, without those that were found twice.

    What a track shows of a stone after its rest is a hand that takes it away, or another thing,
    unless another stone has hit it.
    """
    part = replace(part, throws=[_until_stopped(tracks) for tracks in part.throws])
    kept: list[int] = []
    for k, tracks in enumerate(part.throws):
        if not any(_is_same(part.throws[other][0], tracks[0]) for other in kept):
            kept.append(k)
    return replace(
        part, throws=[part.throws[k] for k in kept], handles=[part.handles[k] for k in kept]
    )


def _until_stopped(tracks: Sequence[Trajectory]) -> list[Trajectory]:
    """A throw's tracks, the thrown stone's only until it has stopped."""
    thrown, *others = tracks
    t, xy = thrown.t, thrown.xy
    for k in range(len(t)):
        end = int(np.searchsorted(t, t[k] + STOPPED_SECONDS))
        if end >= len(t):
            break
        if np.hypot(*np.ptp(xy[k:end], axis=0)) < STOPPED_WITHIN:
            away = np.hypot(*(xy[end:] - xy[k]).T)
            near = [np.hypot(*(one.xy - xy[k]).T).min() for one in others]
            if away.max() > MOVED_ON and min(near, default=MOVED_ON) >= MOVED_ON:
                return [rows_until(thrown, float(t[end])), *others]
            break
    return [thrown, *others]


def _is_same(one: Trajectory, other: Trajectory) -> bool:
    """Return whether two tracks of a film are of one stone at one time."""
    first, second = one.clock + one.t, other.clock + other.t
    low, high = max(first[0], second[0]), min(first[-1], second[-1])
    shorter = min(np.ptp(first), np.ptp(second))
    if high - low < LEAST_COMMON * shorter or shorter <= 0:
        return False
    at = np.linspace(low, high, 30)
    apart = [
        np.interp(at, first, one.xy[:, k]) - np.interp(at, second, other.xy[:, k]) for k in (0, 1)
    ]
    return bool(np.median(np.hypot(*apart)) < SAME_STONE)


def _move_entries(
    club: Club,
    film: Film,
    before: Sequence[Sequence[Trajectory]],
    now: Sequence[Sequence[Trajectory]],
) -> None:
    """Let the rows of throws follow them to their places among those found now."""
    moved = _places_now(before, now)
    if all(moved.get(part) == part for part in range(len(before))):
        return
    with club.database.writing() as connection:
        rows = rows_of(connection, Throw, "select * from throw where film_id = ?", (film.id,))
        # Out of the way first: no two rows of a film may have one place.
        connection.execute("update throw set part = -id where film_id = ?", (film.id,))
        for row in rows:
            part = moved.get(row.part)
            if part is not None:
                changed(connection, "throw", row.id, part=part)
            elif any((row.athlete_id, row.stone_id, row.called, row.note, row.made is not None)):
                query = "update throw set removed = datetime('now', 'localtime') where id = ?"
                connection.execute(query, (row.id,))
            else:
                connection.execute("delete from throw where id = ?", (row.id,))


def _places_now(
    before: Sequence[Sequence[Trajectory]], now: Sequence[Sequence[Trajectory]]
) -> Mapping[int, int]:
    """The places of earlier throws among those found now, by the time that they share."""

    def common(one: Trajectory, other: Trajectory) -> float:
        ends = min(one.clock + one.t[-1], other.clock + other.t[-1])
        return float(ends - max(one.clock + one.t[0], other.clock + other.t[0]))

    shared = [
        (common(one[0], other[0]), k, n)
        for k, one in enumerate(before)
        for n, other in enumerate(now)
    ]
    found: dict[int, int] = {}
    for time, k, n in sorted(shared, key=lambda one: -one[0]):
        if time > 0 and k not in found and n not in found.values():
            found[k] = n
    return found
