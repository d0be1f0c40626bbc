"""What was measured of a session's throws, with the coach's entries: once for each state of it."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from agents.app.club import Club, Session
from agents.app.club.club import TRACKS
from agents.coaching import ThrowSheet, throw_table
from agents.coaching.throw_sheet import HANDS_LIST, hands_beside
from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside

MOST = 8
"""Sessions that are kept in mind."""


def sheets_of(club: Club, session: Session) -> list[ThrowSheet]:
    """The throws of a session, measured; empty while there are none."""
    folder = club.folder_of(session)
    changed = tuple(_changed(folder / name) for name in (TRACKS, THROW_LIST, HANDS_LIST))
    return list(_sheets(folder / TRACKS, changed)) if changed[0] else []


@lru_cache(maxsize=MOST)
def _sheets(tracks: Path, changed: tuple[int, ...]) -> tuple[ThrowSheet, ...]:
    measured = throw_table(load_tracks(tracks), throws_beside(tracks), hands_beside(tracks))
    return tuple(measured)


def _changed(path: Path) -> int:
    """When a file was changed last; 0 where there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
