"""How likely a game is won from the score, the ends to come and the hammer.

Computed backwards from the last end: each end is scored by chance, with the shares that were found
when `search` played itself (`scripts/learn_worth.py` prints them).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from agents.playing.search.worth import MOST, SCORES
from curling_env.rules import RuleSet

Floats = NDArray[np.float64]

FURTHEST = 15
"""Leads beyond are as good as this one."""
CHANCES = (0, 0, 0, 0.01, 0.04, 0.16, 0.22, 0.23, 0.23, 0.08, 0.02, 0.01, 0)
"""How often the hammer team scores each of `SCORES`, −6 to 6, in an end of a level game."""
EXTRA_END = 0.72
"""How often the hammer team wins an extra end that is not blanked."""


def worth_of_scores(rules: RuleSet, lead: int, ends_left: int) -> Floats:
    """Chance of the hammer team to win the game for each of `SCORES` in the end in play, (13,).

    Parameters
    ----------
    lead : of the hammer team before the end
    ends_left : scheduled ends not complete, the one in play among them; 0 in an extra end
    """
    after = max(ends_left - 1, 0)
    table = _table(rules.blank_keeps_hammer, after)
    worth = np.empty(len(SCORES))
    for k, score in enumerate(SCORES.tolist()):
        keeps = score < 0 or (score == 0 and rules.blank_keeps_hammer)
        place = _place(lead + score)
        worth[k] = table[place] if keeps else 1 - table[_place(-lead - score)]
    return worth


def chance_to_win(rules: RuleSet, lead: int, ends_left: int) -> float:
    """Chance of the team with the hammer in the next end, with so many ends to play."""
    return float(_table(rules.blank_keeps_hammer, ends_left)[_place(lead)])


def _place(lead: int) -> int:
    return int(np.clip(lead, -FURTHEST, FURTHEST)) + FURTHEST


@cache
def _table(blank_keeps: bool, ends: int) -> Floats:
    """Chance to win with the hammer for each lead from -FURTHEST on, with so many ends to play."""
    leads = np.arange(-FURTHEST, FURTHEST + 1)
    if ends == 0:
        return np.where(leads > 0, 1.0, np.where(leads < 0, 0.0, EXTRA_END))
    after = _table(blank_keeps, ends - 1)
    chances = np.array(CHANCES) / sum(CHANCES)
    table = np.zeros(len(leads))
    for score, chance in zip(range(-MOST, MOST + 1), chances, strict=True):
        keeps = score < 0 or (score == 0 and blank_keeps)
        there = np.clip(leads + score, -FURTHEST, FURTHEST) + FURTHEST
        other = np.clip(-leads - score, -FURTHEST, FURTHEST) + FURTHEST
        table += chance * (after[there] if keeps else 1 - after[other])
    return table
