"""Results of ends of mixed doubles: those of a table and those of `search` against itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2_contingency

from agents.playing.match import Match
from agents.playing.search import SearchPlayer
from agents.shots.table import RULES, ShotTable
from curling_env.game import GameSimulator
from curling_env.game.rules import Team
from curling_env.throw import Skill
from curling_env.typing import Indices, Progress, no_progress

CLASSES = (*range(-3, 5),)
"""Points of the team with the hammer; the first and the last class include larger scores."""
BUDGET = 200
"""Simulated throws of the search before each delivery."""


@dataclass(frozen=True, kw_only=True)
class EndsComparison:
    """Two distributions of the results of ends.

    Parameters
    ----------
    real, played : number of ends with each of `CLASSES`
    """

    real: Indices
    played: Indices

    @property
    def shares(self) -> list[tuple[int, float, float]]:
        """Return points, share of real ends and share of simulated ones [%]."""
        real, played = (100 * one / one.sum() for one in (self.real, self.played))
        return list(zip(CLASSES, real.tolist(), played.tolist(), strict=True))

    @property
    def worst(self) -> float:
        """Maximum difference of two shares [percentage points]."""
        return max(abs(real - played) for _, real, played in self.shares)

    @property
    def chi_squared(self) -> tuple[float, int, float]:
        """χ² of homogeneity over the classes that have ends, degrees of freedom and p."""
        both = np.array([self.real, self.played])[:, self.real + self.played > 0]
        found: Any = chi2_contingency(both, correction=False)
        return float(found.statistic), int(found.dof), float(found.pvalue)


def real_ends(table: ShotTable) -> Indices:
    """Return the number of ends with each of `CLASSES`, as written."""
    return _counts(
        [
            (end.score[0] - end.score[1]) * (1 if end.hammer is Team.HOME else -1)
            for end in table.ends
            if end.score is not None
        ]
    )


def played_ends(
    skill: Skill,
    *,
    ends: int = 200,
    budget: int = BUDGET,
    seed: int = 0,
    progress: Progress = no_progress,
) -> Indices:
    """Return the number of ends with each of `CLASSES` in games of `search` against itself.

    Parameters
    ----------
    skill : hands of both teams
    ends : number of ends, or a few more: games are played to their end
    budget : simulated throws of the search before each delivery
    seed : seed of the first game; the others count up
    progress : called after every game
    """
    simulator = GameSimulator("standard", rules=RULES, skills=skill)
    player = SearchPlayer(budget)
    points: list[int] = []
    while len(points) < ends:
        match = Match(simulator, (player, player), seed=seed)
        for _ in match:
            pass
        game = match.game
        for score, hammer in zip(game.line_score, game.hammers, strict=True):
            points.append(score[hammer] - score[hammer.other])
        seed += 1
        progress("playing", min(len(points), ends), ends)
    return _counts(points)


def _counts(points: Sequence[int]) -> Indices:
    kept = np.clip(np.asarray(points, dtype=np.intp), CLASSES[0], CLASSES[-1]) - CLASSES[0]
    return np.bincount(kept, minlength=len(CLASSES))
