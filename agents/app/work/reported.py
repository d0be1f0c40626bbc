"""Progress of a job, written into the database."""

from __future__ import annotations

import time
from collections import deque

from agents.app.club import Club

PAUSE = 0.5
"""Interval between two updates [s]."""
ENOUGH = 0.03
"""Minimum share done before the remaining time is estimated."""
LEAST_TIME = 5.0
"""Minimum time for which estimates must agree before one is shown [s]."""
AGREEING = 1.6
"""Largest ratio of estimates that agree."""


class Reported:
    """A `Progress` that writes into the database how much of a job is done.

    The remaining time is reported only while its estimates agree: stages of unlike speed
    would else report seconds, then half an hour, then seconds again.

    Parameters
    ----------
    club, number : the job's
    """

    def __init__(self, club: Club, number: int) -> None:
        self._club, self._number = club, number
        self._wrote = time.monotonic()
        self._pieces, self._piece = 1, 0
        self._stage = (0.0, 0.0)
        """Time at which a stage began, and the share done then."""
        self._share = -1.0
        self._ends: deque[tuple[float, float]] = deque()
        """Times of estimates and the ends that they gave."""

    def piece(self, number: int, count: int) -> None:
        """Begin a piece of the whole: following shares count within it."""
        self._piece, self._pieces = number, max(count, 1)

    def __call__(self, what: str, done: float, total: float = 1.0, /) -> None:
        """See `Progress`."""
        now = time.monotonic()
        if now - self._wrote < PAUSE:
            return
        within = min(done / total, 1.0) if total else 0.0
        share = (self._piece + within) / self._pieces
        self._wrote = now
        left = self._left(now, share)
        self._club.change("job", self._number, share=share, says=what, left=left)

    def _left(self, now: float, share: float) -> float | None:
        """Time that the work still takes [s]; None while estimates disagree."""
        if self._share < 0 or share < self._share - 0.01:  # the first, or another stage
            self._stage = (now, share)
            self._ends.clear()
        self._share = share
        began, before = self._stage
        if share - before < ENOUGH:
            return None
        self._ends.append((now, now + (1 - share) * (now - began) / (share - before)))
        while len(self._ends) > 1 and now - self._ends[1][0] >= LEAST_TIME:
            self._ends.popleft()
        lefts = sorted(max(end - now, 1.0) for _, end in self._ends)
        if now - self._ends[0][0] < LEAST_TIME or lefts[-1] > AGREEING * lefts[0]:
            return None
        return lefts[len(lefts) // 2]
