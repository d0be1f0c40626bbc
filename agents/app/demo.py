"""A made-up evening and the ice of the week before, to look at every screen."""

from __future__ import annotations

from datetime import date, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

from agents.app.club import Club, Session
from agents.app.take_in import fill_from
from agents.closed_loop.made_up_evening import write_evening
from curling_env.ice import save_ice
from curling_env.typing import Progress, no_progress

NAME, BEFORE, SHEET = "A made-up evening", "The week before", "Sheet 2"


def begin_evening(club: Club, day: str) -> Session | None:
    """The session of the made-up evening, still empty; None where the club has one.

    Parameters
    ----------
    day : of the evening, as ``2026-11-22``
    """
    if any(session.name == NAME for session in club.sessions()):
        return None
    return club.add_session(NAME, day, SHEET, None)


def fill(
    club: Club, session: Session, *, seed: int = 0, progress: Progress = no_progress
) -> Session:
    """Fill a session with the made-up evening; one that was filled in part is filled up.

    Parameters
    ----------
    session : of the evening
    seed, progress : see `write_evening`
    """
    with TemporaryDirectory() as made:
        believed = write_evening(Path(made), seed=seed, progress=progress)
        fill_from(club, session, Path(made))
    day = (date.fromisoformat(session.day) - timedelta(days=7)).isoformat()
    if not any(one.name == BEFORE and one.day == day for one in club.sessions()):
        before = club.add_session(BEFORE, day, SHEET, None)
        save_ice(believed, club.ice_of(before))  # what the team takes it for
    return session
