"""Long work: rows of the club's database, the kinds of it, doing it, and its progress."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from importlib import import_module
from pathlib import Path
from time import monotonic

from agents.app.club import Club, Job, Session
from agents.app.club.club import added
from agents.app.club.database import row_of
from agents.app.club.records import State
from curling_env.errors import CurlingError
from curling_env.units import shown_in

CAUSES, COPY, REPORT = "causes", "copy", "report"
"""Kinds of work that a page requests when someone looks at it."""
OPEN = (State.WAITING, State.RUNNING)
"""States of work that has not ended."""


def submit(club: Club, kind: str, session: Session, given: str = "") -> Job:
    """Request work, unless the same work is waiting already.

    Parameters
    ----------
    kind : a name of `KINDS`
    given : argument of the work, in addition to the session
    """
    with club.database.writing() as connection:
        query = (
            "select * from job where kind = ? and session_id = ? and given = ? "
            "and state = 'waiting'"
        )
        found = row_of(connection, Job, query, (kind, session.id, given))
        if found is None:
            if kind == CAUSES:  # this request replaces those for an earlier state
                connection.execute(
                    "delete from job where kind = ? and session_id = ? and state = 'waiting' "
                    "and given like ?",
                    (kind, session.id, f"{given.partition(' ')[0]} %"),
                )
            number = added(connection, "job", kind=kind, session_id=session.id, given=given)
            found = row_of(connection, Job, "select * from job where id = ?", (number,))
    assert found is not None
    return found


def jobs(club: Club, session: Session | None = None) -> list[Job]:
    """Return the work on a session, or all, the latest first."""
    number = None if session is None else session.id
    query = "select * from job where coalesce(session_id = ?, true) order by id desc"
    return club.database.rows(Job, query, number)


def jobs_by_number(club: Club, numbers: Collection[int]) -> list[Job]:
    """Return work by its numbers, the latest first."""
    marks = ", ".join("?" * len(numbers))
    query = f"select * from job where id in ({marks}) order by id desc"
    return club.database.rows(Job, query, *numbers)


def cancel(club: Club, number: int) -> None:
    """Cancel work; the queue stops its process. Files that it has written stay."""
    query = "update job set state = 'cancelled', left = null where id = ? and state in (?, ?)"
    club.database.write(query, number, *OPEN)


def retry(club: Club, number: int) -> None:
    """Run work again that failed or was cancelled."""
    query = (
        "update job set state = 'waiting', share = 0, problem = null "
        "where id = ? and state in ('failed', 'cancelled')"
    )
    club.database.write(query, number)


def running(club: Club, kind: str, session: Session) -> Job | None:
    """Return work of a kind on a session that has not ended; None if there is no such work."""
    query = (
        "select * from job where kind = ? and session_id = ? "
        "and state in ('waiting', 'running') order by id desc"
    )
    return club.database.row(Job, query, kind, session.id)


def requested(club: Club, kind: str, session: Session, given: str) -> Job:
    """Return the latest request for work, which is made if there was none or it is done."""
    query = "select * from job where kind = ? and session_id = ? and given = ? order by id desc"
    job = club.database.row(Job, query, kind, session.id, given)
    return submit(club, kind, session, given) if job is None or job.state is State.DONE else job


KINDS = {
    "track": ("tracking", "Tracking"),
    "record": ("recording", "Recording"),
    "estimate": ("sessions", "Estimating the ice"),
    "discover": ("sessions", "Looking for effects that the ice map does not explain"),
    CAUSES: ("sessions", "Analysing why throws missed, and how the stones differ"),
    COPY: ("film_copy", "Making a copy that this browser plays"),
    REPORT: ("report", "Making a report with clips"),
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
        problem = f"internal error: {type(error).__name__}: {str(error)[:200]}"
    state, share = ("done", 1.0) if problem is None else ("failed", 0.0)
    query = (
        "update job set state = ?, share = ?, left = null, says = '', problem = ? "
        "where id = ? and state = 'running'"
    )
    club.database.write(query, state, share, problem, number)


PAUSE = 0.5
"""Interval between two updates [s]."""
ENOUGH = 0.03
"""Minimum share done before the remaining time is estimated."""
LEAST_TIME = 5.0
"""Minimum time for which estimates must agree before one is shown [s]."""
AGREEING = 1.6
"""Largest ratio of estimates that agree."""


class Reported:
    """A `Progress` that writes into the database how much of a job is done.

    The remaining time is reported only while its estimates agree: stages of unlike speed
    would else report seconds, then half an hour, then seconds again.

    Parameters
    ----------
    club, number : the job's
    """

    def __init__(self, club: Club, number: int) -> None:
        self._club, self._number = club, number
        self._wrote = monotonic()
        self._pieces, self._piece = 1, 0
        self._stage = (0.0, 0.0)
        """Time at which a stage began, and the share done then."""
        self._share = -1.0
        self._ends: deque[tuple[float, float]] = deque()
        """Times of estimates and the ends that they gave."""

    def piece(self, number: int, count: int) -> None:
        """Begin a piece of the whole: following shares count within it."""
        self._piece, self._pieces = number, max(count, 1)

    def __call__(self, what: str, done: float, total: float = 1.0, /) -> None:
        """See `Progress`."""
        now = monotonic()
        if now - self._wrote < PAUSE:
            return
        within = min(done / total, 1.0) if total else 0.0
        share = (self._piece + within) / self._pieces
        self._wrote = now
        left = self._left(now, share)
        self._club.change("job", self._number, share=share, says=what, left=left)

    def _left(self, now: float, share: float) -> float | None:
        """Time that the work still takes [s]; None while estimates disagree."""
        if self._share < 0 or share < self._share - 0.01:  # the first, or another stage
            self._stage = (now, share)
            self._ends.clear()
        self._share = share
        began, before = self._stage
        if share - before < ENOUGH:
            return None
        self._ends.append((now, now + (1 - share) * (now - began) / (share - before)))
        while len(self._ends) > 1 and now - self._ends[1][0] >= LEAST_TIME:
            self._ends.popleft()
        lefts = sorted(max(end - now, 1.0) for _, end in self._ends)
        if now - self._ends[0][0] < LEAST_TIME or lefts[-1] > AGREEING * lefts[0]:
            return None
        return lefts[len(lefts) // 2]
