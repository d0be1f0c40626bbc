"""Athletes of a club, from what was worked out of its sessions."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from threading import Lock

from agents.app.club import Club, Job, Session
from agents.app.club.planned_ice import believed_ice, sessions_with_causes
from agents.app.work.causes import ComingError, Kept, causes_of
from agents.app.work.jobs import OPEN
from agents.coaching import AthleteErrors, athlete_errors

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
    with _ONE_AT_A_TIME:
        kept = club.answer(f"athletes {digest}", list[AthleteErrors])
        if kept is not None:
            return list(kept[0]), coming
        if only_kept:
            return [], coming
        errors = athlete_errors([one.found for one in found[::-1]])  # in the order of time
        club.keep_answer(f"athletes {digest}", digest, errors)
    return errors, coming


def prepare_errors(club: Club, session: Session) -> None:
    """Work out how athletes throw, in one session and in the latest ones, before someone asks."""
    errors_of(club, [session])
    errors_of(club, sessions_with_causes(club))
    club.database.write(
        "delete from answer where name like 'athletes %' and rowid not in "
        "(select rowid from answer where name like 'athletes %' order by rowid desc limit ?)",
        MOST,
    )
