"""What coaching tells of a club's sessions: once for each state of their files.

The functions are those of `agents.coaching`; here is only which files they are asked about.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from threading import RLock

from agents.app.club import Club, Job, Session
from agents.app.club.club import ICE, TRACKS
from agents.app.club.planned_ice import believed_ice, has_causes
from agents.app.work.causes import ComingError, causes_of
from agents.app.work.jobs import OPEN
from agents.coaching import (
    AthleteErrors,
    SessionCauses,
    StoneMatch,
    athlete_errors,
    match_stones,
)
from curling_env.ice import load_ice
from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside

MOST = 64
"""Answers that are kept in mind."""

_ONE_AT_A_TIME = RLock()
"""Who asks while an answer is worked out waits for it, and does not work it out too."""


def errors_of(club: Club, sessions: Sequence[Session]) -> list[AthleteErrors]:
    """How every athlete throws, from the throws of some sessions.

    Raises
    ------
    ComingError : why the throws of one of them missed is being worked out
    """
    told: list[SessionCauses] = []
    coming: list[Job] = []
    for session in sessions:
        try:
            found = causes_of(club, session, believed_ice(club, session))
        except ComingError as error:
            # What has failed says so on its own page.
            coming += [job for job in error.jobs if job.state in OPEN]
        else:
            told += [] if found is None else [found]
    if coming:
        raise ComingError(coming)
    with _ONE_AT_A_TIME:
        return list(_errors(tuple(told[::-1])))  # in the order of time


def stones_of(club: Club, session: Session) -> StoneMatch | None:
    """The stones of a session against each other; None while it has no tracks or no ice.

    Raises
    ------
    InputError : fewer than two stones, or no throw that tells of its stone
    """
    if not has_causes(club, session):
        return None
    folder = club.folder_of(session)
    with _ONE_AT_A_TIME:
        return _stones(folder, _state(folder))


@lru_cache(maxsize=MOST)
def _errors(told: tuple[SessionCauses, ...]) -> list[AthleteErrors]:
    return athlete_errors(told)


@lru_cache(maxsize=MOST)
def _stones(folder: Path, _of: tuple[int, ...]) -> StoneMatch:
    tracks = folder / TRACKS
    return match_stones(load_tracks(tracks), load_ice(folder / ICE), throws_beside(tracks))


def _state(folder: Path) -> tuple[int, ...]:
    return tuple(_changed(folder / name) for name in (TRACKS, ICE, THROW_LIST))


def _changed(path: Path) -> int:
    """When a file was changed last; 0 where there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
