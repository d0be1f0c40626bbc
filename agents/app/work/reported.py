"""Progress of a job, written into the database."""

from __future__ import annotations

import time

from agents.app.club import Club

PAUSE = 0.5
"""Interval between two updates [s]."""
ENOUGH = 0.02
"""Minimum share done before the remaining time is estimated."""


class Reported:
    """A `Progress` that writes into the database how much of a job is done.

    Parameters
    ----------
    club, number : the job's
    """

    def __init__(self, club: Club, number: int) -> None:
        self._club, self._number = club, number
        self._began = self._wrote = time.monotonic()
        self._first: float | None = None
        self._pieces, self._piece = 1, 0

    def piece(self, number: int, count: int) -> None:
        """What follows is a piece of the whole: shares count within it."""
        self._piece, self._pieces = number, max(count, 1)

    def __call__(self, what: str, done: float, total: float = 1.0, /) -> None:
        """See `Progress`."""
        now = time.monotonic()
        if now - self._wrote < PAUSE:
            return
        within = min(done / total, 1.0) if total else 0.0
        share = (self._piece + within) / self._pieces
        if self._first is None:  # what an earlier process has done took no time now
            self._first = share
        gained, left = share - self._first, None
        if gained > ENOUGH:
            left = (1 - share) * (now - self._began) / gained
        self._wrote = now
        with self._club.database.writing() as connection:
            connection.execute(
                "update job set share = ?, says = ?, left = ? where id = ?",
                (share, what, left, self._number),
            )
