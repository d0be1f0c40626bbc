"""What coaching tells of a club's sessions: once for each state of their files.

The functions are those of `agents.coaching`; here is only which files they are asked about.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from threading import RLock

from agents.app.club import Club, Session
from agents.app.club.club import ICE, TRACKS
from agents.coaching import (
    AthleteErrors,
    SessionCauses,
    StoneMatch,
    athlete_errors,
    hand_or_ice,
    match_stones,
)
from agents.coaching.throw_sheet import HANDS_LIST, hands_beside
from curling_env.errors import InputError
from curling_env.ice import load_ice
from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside

MOST = 24
"""Answers that are kept in mind."""
MOST_SESSIONS = 12
"""Sessions, the latest, from which an athlete's errors are told."""

_ONE_AT_A_TIME = RLock()
"""Who asks while an answer is worked out waits for it, and does not work it out too."""

State = tuple[int, ...]
"""When the files of an answer were changed last."""


def causes_of(club: Club, session: Session, believed: Session | None) -> SessionCauses | None:
    """Why the throws of a session missed; None while it has no tracks or no ice.

    Parameters
    ----------
    believed : the session whose ice the team planned with; None if that is not known
    """
    folder = club.folder_of(session)
    if not (folder / TRACKS).exists() or not (folder / ICE).exists():
        return None
    other = None if believed is None else club.ice_of(believed)
    with _ONE_AT_A_TIME:
        return _causes(folder, other, _state(folder), _changed(other))


def believed_ice(club: Club, session: Session) -> Session | None:
    """The session whose ice a team knew before this one: the latest earlier one on its sheet."""
    return next(iter(earlier_sessions(club, session)), None)


def earlier_sessions(club: Club, session: Session) -> list[Session]:
    """Earlier sessions with an ice on the same sheet, the latest first."""
    return [
        other
        for other in club.sessions()
        if (other.day, other.id) < (session.day, session.id)
        and other.sheet == session.sheet
        and club.ice_of(other).exists()
    ]


def sessions_with_causes(club: Club) -> list[Session]:
    """The latest sessions with tracks and an ice, the latest first."""
    found = [
        session
        for session in club.sessions()
        if club.tracks_of(session).exists() and club.ice_of(session).exists()
    ]
    return found[:MOST_SESSIONS]


def errors_of(club: Club, sessions: Sequence[Session]) -> list[AthleteErrors]:
    """How every athlete throws, from the throws of some sessions."""
    kept: list[tuple[Path, Path | None, State, int]] = []
    for session in sessions:
        folder, believed = club.folder_of(session), believed_ice(club, session)
        other = None if believed is None else club.ice_of(believed)
        kept.append((folder, other, _state(folder), _changed(other)))
    with _ONE_AT_A_TIME:
        return list(_errors(tuple(kept)))


def stones_of(club: Club, session: Session) -> StoneMatch | None:
    """The stones of a session against each other; None while it has no tracks or no ice.

    Raises
    ------
    InputError : fewer than two stones, or no throw that tells of its stone
    """
    folder = club.folder_of(session)
    if not (folder / TRACKS).exists() or not (folder / ICE).exists():
        return None
    with _ONE_AT_A_TIME:
        return _stones(folder, _state(folder))


@lru_cache(maxsize=MOST)
def _causes(folder: Path, believed: Path | None, _of: State, _believed: int) -> SessionCauses:
    tracks = folder / TRACKS
    return hand_or_ice(
        load_tracks(tracks),
        load_ice(folder / ICE),
        throws_beside(tracks),
        believed=None if believed is None else load_ice(believed),
        hands=hands_beside(tracks),
    )


@lru_cache(maxsize=MOST)
def _errors(sessions: tuple[tuple[Path, Path | None, State, int], ...]) -> list[AthleteErrors]:
    told: list[SessionCauses] = []
    for one in sessions[::-1]:  # in the order of time
        try:
            told.append(_causes(*one))
        except InputError:
            continue  # its own page says what is wrong with it
    return athlete_errors(told)


@lru_cache(maxsize=MOST)
def _stones(folder: Path, _of: State) -> StoneMatch:
    tracks = folder / TRACKS
    return match_stones(load_tracks(tracks), load_ice(folder / ICE), throws_beside(tracks))


def _state(folder: Path) -> State:
    return tuple(_changed(folder / name) for name in (TRACKS, ICE, THROW_LIST, HANDS_LIST))


def _changed(path: Path | None) -> int:
    """When a file was changed last; 0 where there is none."""
    try:
        return 0 if path is None else path.stat().st_mtime_ns
    except OSError:
        return 0
