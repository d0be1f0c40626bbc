"""The kinds of long work, each a function of club, session, progress and an argument; and a job.

A process does one piece of work, and loads only the module of that.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from agents.app.club import Club, Job, Session
from agents.app.club.records import State
from agents.app.work.jobs import CAUSES, COPY, MEASURE, REPORT
from curling_env.errors import CurlingError
from curling_env.units import shown_in

if TYPE_CHECKING:
    from agents.app.work.reported import Reported

KINDS = {
    "track": ("tracking", "Tracking"),
    "record": ("recording", "Recording"),
    "estimate": ("sessions", "Estimating the ice"),
    "discover": ("sessions", "Looking for what the ice map leaves unexplained"),
    CAUSES: ("sessions", "Working out why throws missed, and how the stones differ"),
    COPY: ("film_copy", "Making a copy that this browser plays"),
    REPORT: ("report", "Making a report with clips"),
    MEASURE: ("sessions", "Measuring the throws"),
    "import": ("sessions", "Importing files"),
    "make up": ("sessions", "Making up an evening"),
}
"""The module of each in this package, whose function has the name of the kind, and its title."""


def do(kind: str, club: Club, session: Session, progress: Reported, given: str) -> None:
    """Do a piece of work."""
    module = import_module(f"agents.app.work.{KINDS[kind][0]}")
    getattr(module, f"do_{kind.replace(' ', '_')}")(club, session, progress, given)


def do_job(folder: Path, number: int) -> None:
    """Do a job and write how it ended.

    Parameters
    ----------
    folder : the club's
    number : of the job
    """
    import cv2

    from agents.app.work.reported import Reported

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
        with shown_in(club.units):
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
