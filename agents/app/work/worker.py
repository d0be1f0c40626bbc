"""A job in a separate process, and its result in the database."""

from __future__ import annotations

from pathlib import Path

import cv2

from agents.app.club import Club, Job
from agents.app.club.records import State
from agents.app.work.kinds import do
from agents.app.work.reported import Reported
from curling_env.errors import CurlingError


def do_job(folder: Path, number: int) -> None:
    """Do a job and write how it ended.

    Parameters
    ----------
    folder : the club's
    number : of the job
    """
    cv2.setNumThreads(1)
    club = Club(folder)
    job = club.database.row(Job, "select * from job where id = ?", number)
    session = None if job is None else club.session(job.session_id)
    if job is None:
        return
    if session is None:  # it was removed
        club.change("job", number, state=State.CANCELLED)
        return
    problem = None
    try:
        do(job.kind, club, session, Reported(club, number), job.given)
    except CurlingError as error:
        problem = str(error)
    except Exception as error:  # an internal error is reported, not retried
        problem = f"a mistake of this program: {type(error).__name__}: {str(error)[:200]}"
    state, share = ("done", 1.0) if problem is None else ("failed", 0.0)
    query = (
        "update job set state = ?, share = ?, left = null, says = '', problem = ? "
        "where id = ? and state = 'running'"
    )
    club.database.write(query, state, share, problem, number)
