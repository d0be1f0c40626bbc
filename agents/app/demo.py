"""Sessions that are begun as the app starts, among them a made-up evening to look around."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import date, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

from agents.app.club import Club, Session
from agents.app.take_in import begin_from, fill_from, is_in
from agents.app.work.jobs import submit
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
    from agents.closed_loop.made_up_evening import write_evening  # it loads what renders films

    with TemporaryDirectory() as made:
        believed = write_evening(Path(made), seed=seed, progress=progress)
        fill_from(club, session, Path(made))
    day = (date.fromisoformat(session.day) - timedelta(days=7)).isoformat()
    if not any(one.name == BEFORE and one.day == day for one in club.sessions()):
        before = club.add_session(BEFORE, day, SHEET, None)
        save_ice(believed, club.ice_of(before))  # what the team takes it for
    return session


def begin_sessions(
    club: Club, folders: Sequence[Path], *, demo: bool, remark: Callable[[str], object]
) -> None:
    """Begin sessions from folders, and a made-up evening; both are filled while the app runs.

    Parameters
    ----------
    club : the club
    folders : folders with tracks; one that the club has already is skipped, with a remark
    demo : also begin a made-up evening
    remark : called with what the person at the terminal should know

    Raises
    ------
    InputError : see `take_in.look_through`
    """
    today = date.today().isoformat()
    for folder in folders:
        if is_in(club, folder):
            remark(f"{folder}: is in this club already")
            continue
        session = begin_from(club, folder, name=folder.resolve().name, day=today, sheet="")
        submit(club, "import", session, str(folder.resolve()))
    evening = begin_evening(club, today) if demo else None
    if evening is not None:
        submit(club, "make up", evening)
