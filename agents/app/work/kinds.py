"""The kinds of long work: each a function of club, session, progress, and what it was given.

A process does one piece of work, and loads only the module of that.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from agents.app.club import Club, Session
from agents.app.work.jobs import CAUSES, COPY, MEASURE, REPORT

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
