"""Sessions of a club that have an ice, and the ice that a team knew before a session."""

from __future__ import annotations

from agents.app.club.club import Club
from agents.app.club.records import Session

MOST_SESSIONS = 12
"""Maximum number of sessions, the latest, from which an athlete's errors are computed."""


def earlier_sessions(club: Club, session: Session) -> list[Session]:
    """Earlier sessions with an ice on the same sheet, the latest first."""
    return [
        other
        for other in club.sessions()
        if (other.day, other.id) < (session.day, session.id)
        and other.sheet == session.sheet
        and club.ice_of(other).exists()
    ]


def believed_ice(club: Club, session: Session) -> Session | None:
    """The session whose ice a team knew before this one: the latest earlier one on its sheet."""
    return next(iter(earlier_sessions(club, session)), None)


def has_causes(club: Club, session: Session) -> bool:
    """Return whether a session has the data that explain misses: tracks and an ice."""
    return club.tracks_of(session).exists() and club.ice_of(session).exists()


def sessions_with_causes(club: Club) -> list[Session]:
    """The latest sessions with tracks and an ice, the latest first."""
    return [session for session in club.sessions() if has_causes(club, session)][:MOST_SESSIONS]
