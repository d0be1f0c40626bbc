"""Long work as rows of the club's database: what was requested, and how far it is."""

from __future__ import annotations

from agents.app.club import Club, Job, Session
from agents.app.club.club import added
from agents.app.club.database import row_of
from agents.app.club.records import State

CAUSES, COPY, MEASURE, REPORT = "causes", "copy", "measure", "report"
"""Kinds of work that a page requests when someone looks at it."""
OPEN = (State.WAITING, State.RUNNING)
"""States of work that has not ended."""


def submit(club: Club, kind: str, session: Session, given: str = "") -> Job:
    """Request work, unless the same work is waiting already.

    Parameters
    ----------
    kind : a name of `KINDS` in `work.kinds`
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


def running(club: Club, kind: str, session: Session) -> Job | None:
    """Return work of a kind on a session that has not ended; None if there is no such work."""
    query = (
        "select * from job where kind = ? and session_id = ? "
        "and state in ('waiting', 'running') order by id desc"
    )
    return club.database.row(Job, query, kind, session.id)


def latest(club: Club, kind: str, session: Session, given: str) -> Job | None:
    """The latest request for a kind of work; None if there was none."""
    query = "select * from job where kind = ? and session_id = ? and given = ? order by id desc"
    return club.database.row(Job, query, kind, session.id, given)


def measure_all(club: Club) -> None:
    """Request measuring of the throws that an earlier version of the program kept."""
    with club.database.writing() as connection:
        query = "select distinct session_id from throw where measures is null and part >= 0"
        numbers = [row[0] for row in connection.execute(query)]
        # The job writes their files, too: starting does not wait for it.
        marks = ", ".join("?" * len(numbers))
        connection.execute(f"update session set stale = 0 where id in ({marks})", numbers)
    for number in numbers:
        session = club.session(number)
        if session is not None:
            submit(club, MEASURE, session)
