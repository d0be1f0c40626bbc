"""Causes of misses, differences of stones and errors of athletes, before someone asks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from agents.app.club import Club, Session
from agents.app.views.coached import prepare_errors
from agents.app.work.causes import work_out

if TYPE_CHECKING:
    from agents.app.work.reported import Reported


def do_causes(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """See `causes.work_out` and `views.coached`."""
    work_out(club, session, progress, given)
    prepare_errors(club, session)
