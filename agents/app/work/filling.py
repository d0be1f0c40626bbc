"""Filling a session: from files, with a made-up evening, or with what is missing of its throws."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from agents.app.club import Club, Session
from agents.app.club.session_files import write_files
from agents.app.take_in import fill_from
from agents.app.work.causes import prepare

if TYPE_CHECKING:
    from agents.app.work.reported import Reported


def do_measure(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Measure the throws of a session that an earlier version of the program kept."""
    write_files(club, session)


def do_import(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Fill a session with the files of the folder that is given."""
    fill_from(club, session, Path(given))
    prepare(club, session)


def do_make_up(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Fill a session with a made-up evening."""
    from agents.app.demo import fill  # it loads what renders films

    fill(club, session, progress=progress)
    prepare(club, session)
