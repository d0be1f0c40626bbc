"""How likely a game is won from the score, the ends to come and the hammer.

Computed backwards from the extra end. What an end's scores are worth follows from the table of one
end fewer; how often each is made, by players who play for just that worth, is what the network of
`worth` says of a sheet before the first stone. So a team that needs two plays for two.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from agents.playing.search.worth import SCORES
from curling_env.rules import RuleSet

Floats = NDArray[np.float64]

FURTHEST = 15
"""Leads beyond are as good as this one."""
LEADS = np.arange(-FURTHEST, FURTHEST + 1)
EXTRA_ROUNDS = 8
"""Rounds in which the worth of a blanked extra end, which is followed by another, settles."""


class Winning:
    """Chances to win.

    Parameters
    ----------
    rules : of the game
    chances : from what scores are worth to the hammer team, (n, 13), to how often they are made
    """

    def __init__(self, rules: RuleSet, chances: Callable[[Floats], Floats]) -> None:
        self._blank_keeps, self._chances = rules.blank_keeps_hammer, chances
        self._tables = [self._after_the_last(0.75)]
        for _ in range(EXTRA_ROUNDS):
            extra = self._one_more(self._tables[0])[FURTHEST]
            self._tables[0] = self._after_the_last(float(extra))

    def of_scores(self, lead: int, ends_left: int) -> Floats:
        """Chance of the hammer team for each of `SCORES` in the end in play, (13,).

        Parameters
        ----------
        lead : of the hammer team before the end
        ends_left : scheduled ends not complete, the one in play among them; 0 in an extra end
        """
        return self._of_scores(np.array([lead]), self._table(max(ends_left - 1, 0)))[0]

    def with_hammer(self, lead: int, ends_left: int) -> float:
        """Chance of the team that has the hammer in the first of so many ends to come."""
        return float(self._table(ends_left)[_places(np.array(lead))])

    def _table(self, ends: int) -> Floats:
        """Chance with the hammer for each of `LEADS`, with so many ends to play."""
        while len(self._tables) <= ends:
            self._tables.append(self._one_more(self._tables[-1]))
        return self._tables[ends]

    def _after_the_last(self, extra: float) -> Floats:
        return np.where(LEADS > 0, 1.0, np.where(LEADS < 0, 0.0, extra))

    def _one_more(self, after: Floats) -> Floats:
        worth = self._of_scores(LEADS, after)
        table = (self._chances(worth) * worth).sum(axis=1)
        return np.maximum.accumulate(table)  # a larger lead is never worse

    def _of_scores(self, leads: NDArray[np.int64], after: Floats) -> Floats:
        """Chance of the hammer team by lead and score, (n, 13)."""
        keeps = (SCORES < 0) | ((SCORES == 0) & self._blank_keeps)
        new = leads[:, None] + SCORES
        return np.where(keeps, after[_places(new)], 1 - after[_places(-new)])


def _places(leads: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.clip(leads, -FURTHEST, FURTHEST) + FURTHEST
