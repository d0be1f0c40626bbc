"""A job in its own process: done by its kind, with how far it is written into the database."""

from __future__ import annotations

import time
from pathlib import Path

import cv2

from agents.app.club import Club, Job
from agents.app.club.database import row_of
from agents.app.work.kinds import KINDS
from curling_env.errors import CurlingError

PAUSE = 0.5
"""Between two writings of how far it is [s]."""
ENOUGH = 0.02
"""From this share on the time left can be told."""


class Reported:
    """A `Progress` that writes into the database how much of a job is done.

    Parameters
    ----------
    club, number : the job's
    """

    def __init__(self, club: Club, number: int) -> None:
        self._club, self._number = club, number
        self._began = self._wrote = time.monotonic()
        self._first: float | None = None
        self._pieces, self._piece = 1, 0

    def piece(self, number: int, count: int) -> None:
        """What follows is a piece of the whole: shares count within it."""
        self._piece, self._pieces = number, max(count, 1)

    def __call__(self, what: str, done: float, total: float = 1.0, /) -> None:
        """See `Progress`."""
        now = time.monotonic()
        if now - self._wrote < PAUSE:
            return
        within = min(done / total, 1.0) if total else 0.0
        share = (self._piece + within) / self._pieces
        if self._first is None:  # what an earlier process has done took no time now
            self._first = share
        gained, left = share - self._first, None
        if gained > ENOUGH:
            left = (1 - share) * (now - self._began) / gained
        self._wrote = now
        with self._club.database.writing() as connection:
            connection.execute(
                "update job set share = ?, says = ?, left = ? where id = ?",
                (share, what, left, self._number),
            )


def do_job(folder: Path, number: int) -> None:
    """Do a job and write how it ended.

    Parameters
    ----------
    folder : the club's
    number : of the job
    """
    cv2.setNumThreads(1)
    club = Club(folder)
    with club.database.reading() as connection:
        job = row_of(connection, Job, "select * from job where id = ?", (number,))
    session = None if job is None else club.session(job.session_id)
    if job is None:
        return
    if session is None:  # it was removed
        with club.database.writing() as connection:
            query = "update job set state = 'cancelled' where id = ?"
            connection.execute(query, (number,))
        return
    problem = None
    try:
        KINDS[job.kind](club, session, Reported(club, number), job.given)
    except CurlingError as error:
        problem = str(error)
    except Exception as error:  # a mistake of the program is told, not retried
        problem = f"a mistake of this program: {type(error).__name__}: {str(error)[:200]}"
    state, share = ("done", 1.0) if problem is None else ("failed", 0.0)
    with club.database.writing() as connection:
        connection.execute(
            "update job set state = ?, share = ?, left = null, says = '', problem = ? "
            "where id = ? and state = 'running'",
            (state, share, problem, number),
        )
