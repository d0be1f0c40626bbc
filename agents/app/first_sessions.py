"""Sessions that are begun as the app starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path

from agents.app.club import Club
from agents.app.demo import begin_evening
from agents.app.take_in import begin_from, is_in
from agents.app.work.jobs import submit


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
