"""Athletes of a club, from what was worked out of its sessions."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from threading import Lock

import msgspec

from agents.app.club import Club, Job, Session
from agents.app.club.planned_ice import believed_ice, sessions_with_causes
from agents.app.club.session_files import as_array, as_list
from agents.app.work.causes import ComingError, Kept, causes_of
from agents.app.work.jobs import OPEN
from agents.coaching import AthleteErrors, athlete_errors
from curling_env.infrastructure.files.writing import atomic_path, make_directory

FOLDER = "athletes"
"""Of the answers, in the club folder; they are worked out again where they are missing."""
MOST = 100
"""Answers that are kept."""

_ONE_AT_A_TIME = Lock()
"""Several requests for one answer wait for the first, which works it out."""


def errors_of(
    club: Club, sessions: Sequence[Session], *, only_kept: bool = False
) -> tuple[list[AthleteErrors], list[Job]]:
    """Return how every athlete throws, from some sessions, and the work on newer answers.

    Parameters
    ----------
    only_kept : return nothing rather than work for a second

    Raises
    ------
    ComingError : none of these sessions is worked out yet
    """
    found: list[Kept] = []
    coming: list[Job] = []
    for session in sessions:
        try:
            answer = causes_of(club, session, believed_ice(club, session))
        except ComingError as error:
            coming += error.jobs
        else:
            if answer is not None:
                found.append(answer.kept)
                coming += [] if answer.job is None else [answer.job]
    coming = [job for job in coming if job.state in OPEN]  # a failure is shown on its own page
    if coming and not found:
        raise ComingError(coming)
    digest = hashlib.sha256(" ".join(one.of for one in found).encode()).hexdigest()[:24]
    path = club.folder / FOLDER / f"{digest}.msgpack"
    with _ONE_AT_A_TIME:
        if not path.exists():
            if only_kept:
                return [], coming
            errors = athlete_errors([one.found for one in found[::-1]])  # in the order of time
            make_directory(path.parent)
            with atomic_path(path) as draft:
                draft.write_bytes(msgspec.msgpack.encode(errors, enc_hook=as_list))
        return list(_read(path)), coming


def prepare_errors(club: Club, session: Session) -> None:
    """Work out how athletes throw, in one session and in the latest ones, before someone asks."""
    errors_of(club, [session])
    errors_of(club, sessions_with_causes(club))
    kept = sorted((club.folder / FOLDER).glob("*.msgpack"), key=lambda one: -one.stat().st_mtime)
    for path in kept[MOST:]:
        path.unlink(missing_ok=True)


@lru_cache(maxsize=16)
def _read(path: Path) -> list[AthleteErrors]:
    return msgspec.msgpack.decode(path.read_bytes(), type=list[AthleteErrors], dec_hook=as_array)
