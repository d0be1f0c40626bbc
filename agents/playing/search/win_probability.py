"""How likely a game is won from the score, the ends to come and the hammer.

Computed backwards from the extra end: what an end's scores are worth follows from the table of one
end fewer, and each is made with its usual share.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.playing.search.value_network import SCORES
from curling_env.game.rules import RuleSet
from curling_env.typing import Floats

USUAL_SHARES = (0, 0, 0, 0.01, 0.05, 0.15, 0.20, 0.27, 0.21, 0.08, 0.02, 0.01, 0)
"""How often the hammer team scores each of `SCORES`, −6 to 6: a choice.

When `search` plays itself, scores spread less, and one who is two points behind has lost. A player
who believes that gives games up which weaker opponents would still lose; so these shares spread
about as far as those of games between people.
"""
FURTHEST = 15
"""Leads beyond are as good as this one."""
LEADS = np.arange(-FURTHEST, FURTHEST + 1)


class Winning:
    """Chances to win.

    Parameters
    ----------
    rules : of the game
    shares : (13,) how often the hammer team scores each of `SCORES`
    """

    def __init__(self, rules: RuleSet, shares: ArrayLike = USUAL_SHARES) -> None:
        self._blank_keeps = rules.blank_keeps_hammer
        self._shares = np.asarray(shares, dtype=np.float64) / np.sum(shares)
        # An extra end is won by whoever scores; after a blank follows another.
        wins, blank = self._shares[SCORES > 0].sum(), self._shares[SCORES == 0].sum()
        extra = wins / (1 - blank) if self._blank_keeps else (wins + blank) / (1 + blank)
        self._tables = [np.where(LEADS > 0, 1.0, np.where(LEADS < 0, 0.0, extra))]

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

    def _one_more(self, after: Floats) -> Floats:
        return self._of_scores(LEADS, after) @ self._shares

    def _of_scores(self, leads: NDArray[np.int64], after: Floats) -> Floats:
        """Chance of the hammer team by lead and score, (n, 13)."""
        keeps = (SCORES < 0) | ((SCORES == 0) & self._blank_keeps)
        new = leads[:, None] + SCORES
        return np.where(keeps, after[_places(new)], 1 - after[_places(-new)])


def _places(leads: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.clip(leads, -FURTHEST, FURTHEST) + FURTHEST
