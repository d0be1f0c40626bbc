"""Long work as rows of the club's database: what was requested, and how far it is."""

from __future__ import annotations

from agents.app.club import Club, Job, Session
from agents.app.club.club import added
from agents.app.club.database import row_of
from agents.app.club.records import State

CAUSES, COPY = "causes", "copy"
"""Kinds of work that a page requests when someone looks at it."""
OPEN = (State.WAITING, State.RUNNING)
"""States of work that has not ended."""


def submit(club: Club, kind: str, session: Session, given: str = "") -> Job:
    """Request work, unless the same work is waiting already.

    Parameters
    ----------
    kind : a name of `KINDS` in `work.kinds`
    given : argument of the work, besides the session
    """
    with club.database.writing() as connection:
        query = (
            "select * from job where kind = ? and session_id = ? and given = ? "
            "and state = 'waiting'"
        )
        found = row_of(connection, Job, query, (kind, session.id, given))
        if found is None:
            number = added(connection, "job", kind=kind, session_id=session.id, given=given)
            found = row_of(connection, Job, "select * from job where id = ?", (number,))
    assert found is not None
    return found


def latest(club: Club, kind: str, session: Session, given: str) -> Job | None:
    """The latest request for a kind of work; None if there was none."""
    with club.database.reading() as connection:
        query = "select * from job where kind = ? and session_id = ? and given = ? order by id desc"
        return row_of(connection, Job, query, (kind, session.id, given))
