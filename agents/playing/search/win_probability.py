"""Probability of winning a game from the score, the ends to come and the hammer.

Computed backwards from the extra end: the value of each score of an end follows from the table
with one end fewer, and scores come with assumed shares.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from agents.playing.search.positions import SCORES
from agents.playing.search.tuning import DOUBLES_SHARES, MAX_LEAD, POWER_PLAY_SHARES, SCORE_SHARES
from curling_env.game.rules import RuleSet
from curling_env.typing import Floats, Integers

LEADS = np.arange(-MAX_LEAD, MAX_LEAD + 1)


class WinProbability:
    """Tables of win probabilities.

    Parameters
    ----------
    rules : rules of the game
    shares : (13,) frequency of each of `SCORES` for the hammer team; by default as assumed for
        these rules
    """

    def __init__(self, rules: RuleSet, shares: ArrayLike | None = None) -> None:
        if shares is None:
            shares = DOUBLES_SHARES if rules.placed_stones else SCORE_SHARES
        self._blank_keeps = rules.blank_keeps_hammer
        self._shares = np.asarray(shares, dtype=np.float64) / np.sum(shares)
        # The team that scores wins an extra end; a blank is followed by another.
        wins, blank = self._shares[SCORES > 0].sum(), self._shares[SCORES == 0].sum()
        extra = wins / (1 - blank) if self._blank_keeps else (wins + blank) / (1 + blank)
        self._known: dict[tuple[int, bool, bool], Floats] = {}
        self._tables = [np.where(LEADS > 0, 1.0, np.where(LEADS < 0, 0.0, extra))]

    def by_score(self, lead: int, ends_left: int) -> Floats:
        """Return the win probability of the hammer team after each of `SCORES` in the current end,
        (13,).

        Parameters
        ----------
        lead : lead of the hammer team before the end
        ends_left : scheduled ends that are not complete, with the current one; 0 in an extra end
        """
        return self._by_score(np.array([lead]), self._table(max(ends_left - 1, 0)))[0]

    def with_hammer(self, lead: int, ends_left: int) -> float:
        """Return the win probability of the team with the hammer before the first of the ends to
        come.
        """
        return float(self._table(ends_left)[_rows(np.array(lead))])

    def power_play_gain(self, lead: int, ends_left: int, *, opponent: bool) -> float:
        """Return the gain of a power play in the next end over one in a later end.

        Both teams choose the ends of their power plays well; extra ends have none.

        Parameters
        ----------
        lead, ends_left : as in `by_score`
        opponent : true if the opponent has not played its own yet
        """
        now, later = (self._played(ends_left, play, True, opponent) for play in (True, False))
        return float((now - later)[_rows(np.array(lead))])

    def _played(self, ends: int, play: bool, own: bool, opponent: bool) -> Floats:
        """Return the win probability of the hammer team for each of `LEADS`, with or without its
        power play in this end, if each team has one or not.
        """
        own = own and not play
        shares = np.array(POWER_PLAY_SHARES if play else self._shares)
        after = self._best(ends - 1, own, opponent), self._best(ends - 1, opponent, own)
        return self._by_score(LEADS, *after) @ shares / shares.sum()

    def _best(self, ends: int, own: bool, opponent: bool) -> Floats:
        if ends == 0 or not (own or opponent):
            return self._table(ends)
        key = ends, own, opponent
        if key not in self._known:
            choices = [self._played(ends, play, own, opponent) for play in {False, own}]
            self._known[key] = np.max(choices, axis=0)
        return self._known[key]

    def _table(self, ends: int) -> Floats:
        """Return the win probability with the hammer for each of `LEADS`, with a number of ends to
        play.
        """
        while len(self._tables) <= ends:
            self._tables.append(self._by_score(LEADS, self._tables[-1]) @ self._shares)
        return self._tables[ends]

    def _by_score(self, leads: Integers, after: Floats, passed: Floats | None = None) -> Floats:
        """Return the win probability of the hammer team by lead and score, (n, 13).

        Parameters
        ----------
        leads : (n,) leads before the end
        after : probability for each of `LEADS` of a team that keeps the hammer
        passed : the same of its opponent that gets it; by default as `after`
        """
        keeps = (SCORES < 0) | ((SCORES == 0) & self._blank_keeps)
        new = leads[:, None] + SCORES
        return np.where(
            keeps, after[_rows(new)], 1 - (after if passed is None else passed)[_rows(-new)]
        )


def _rows(leads: Integers) -> Integers:
    return np.clip(leads, -MAX_LEAD, MAX_LEAD) + MAX_LEAD
