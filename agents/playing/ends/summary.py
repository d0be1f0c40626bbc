"""What many games tell: scores of ends, grades of shots, and what predictions are worth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from agents.playing.ends.grades import BEST, HIT_TYPES, SHOT_TYPES
from agents.playing.ends.play import EndRecord, GameRecord, ShotRecord
from agents.playing.ends.published import (
    PUBLISHED_ODDS,
    Comparison,
    PublishedOdds,
    class_counts,
    compared,
    score_shares,
)
from agents.playing.search.win_probability import WinProbability
from curling_env.game.rules import RuleSet
from curling_env.typing import Floats

RESAMPLES = 400
"""Resampled sets of games for an interval: what happens within a game hangs together."""
BINS = 10
"""Classes of a predicted probability."""
GROUPS: dict[str, Callable[[ShotRecord], bool]] = {
    "all": lambda shot: True,
    "slow": lambda shot: shot.type not in HIT_TYPES,
    "hits": lambda shot: shot.type in HIT_TYPES,
    **{
        name: lambda shot, k=k: (16 - shot.left) // 4 == k
        for k, name in enumerate(("lead", "second", "third", "skip"))
    },
    "first draw": lambda shot: shot.type == "draw" and shot.left == 16,
    "last draw": lambda shot: shot.type == "draw" and shot.left == 1,
}
"""Groups of shots that published grades are told by; draws as an end's first and last stone."""


@dataclass(frozen=True, kw_only=True)
class Grades:
    """The grades of the shots of a type.

    Parameters
    ----------
    type : one of `GROUPS` or of `grades.SHOT_TYPES`
    shots : how many
    mean, low, high : mean grade in per cent of the best, and its 95 % interval by resampling games
    perfect, missed : shares that were graded 4 and 0
    """

    type: str
    shots: int
    mean: float
    low: float
    high: float
    perfect: float
    missed: float


@dataclass(frozen=True, kw_only=True)
class CalibrationBin:
    """Predictions of about the same probability.

    Parameters
    ----------
    predicted : their mean
    number : how many
    share : of these that came true
    low, high : its 95 % interval by resampling games
    """

    predicted: float
    number: int
    share: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """How predicted probabilities of winning came true.

    Parameters
    ----------
    bins : by predicted probability
    brier : mean square of prediction less outcome
    climate : the same of always predicting one half
    """

    bins: tuple[CalibrationBin, ...]
    brier: float
    climate: float = 0.25

    def as_dict(self) -> dict[str, Any]:
        """The numbers by name, for JSON."""
        return asdict(self)


def ends_of(games: Iterable[GameRecord]) -> list[EndRecord]:
    """The complete ends of games, extra ends too, as result books have them."""
    return [end for game in games for end in game.ends]


def end_comparison(games: Iterable[GameRecord]) -> Comparison:
    """The ends of games beside the published ones."""
    return compared(class_counts([end.score for end in ends_of(games)]))


def grades(games: Sequence[GameRecord], *, seed: int = 0) -> list[Grades]:
    """The grades of the shots of each group and of each type."""
    found: list[Grades] = []
    types = {name: lambda shot, name=name: shot.type == name for name in SHOT_TYPES}
    for kind, belongs in {**GROUPS, **types}.items():
        by_game = [
            [s.grade for s in game.shots if s.grade is not None and belongs(s)] for game in games
        ]
        sums = np.array([[sum(points), len(points)] for points in by_game], dtype=np.float64)
        if not sums[:, 1].sum():
            continue
        low, high = _interval(sums, seed)
        every = [points for game in by_game for points in game]
        found.append(
            Grades(
                type=kind,
                shots=len(every),
                mean=100 * float(np.mean(every)) / BEST,
                low=100 * low / BEST,
                high=100 * high / BEST,
                perfect=float(np.mean(np.array(every) == BEST)),
                missed=float(np.mean(np.array(every) == 0)),
            )
        )
    return found


def course(games: Iterable[GameRecord]) -> list[dict[str, float]]:
    """What the value network expects in the course of an end, over all complete ends.

    Returns
    -------
    before each stone the stones to come (0: what came of it), the mean points of the team with the
    hammer less its opponent's, and the share of blanks
    """
    rows: list[tuple[int, float, float]] = []
    for game in games:
        starts = [k for k, shot in enumerate(game.shots) if shot.left == 16]
        for end, start in zip(game.ends, starts, strict=False):
            shots = game.shots[start : start + 16]
            rows += [(shot.left, shot.expected, shot.blank) for shot in shots]
            rows.append((0, end.score, end.score == 0))
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    return [
        {"left": left, "points": float(here[:, 1].mean()), "blank": float(here[:, 2].mean())}
        for left in range(16, -1, -1)
        for here in [table[table[:, 0] == left]]
        if len(here)
    ]


def calls_calibration(games: Sequence[GameRecord], *, seed: int = 0) -> Calibration:
    """What the chances that `search` saw in its calls were worth."""

    def pairs(game: GameRecord) -> list[tuple[float, bool]]:
        return [_pair(shot) for shot in game.shots]

    return _calibration([pairs(game) for game in games], seed)


def table_calibration(games: Sequence[GameRecord], odds: WinProbability) -> Calibration:
    """What a win table's chances before each end were worth."""

    def pairs(game: GameRecord) -> list[tuple[float, bool]]:
        return [
            (odds.with_hammer(end.lead, end.ends_left), end.won)
            for end in game.ends
            if end.ends_left > 0
        ]

    return _calibration([pairs(game) for game in games], 0)


def odds_of(rules: RuleSet, comparison: Comparison) -> WinProbability:
    """The win table of independent ends with the shares of a comparison."""
    return WinProbability(rules, score_shares(comparison.shares))


def chance(odds: WinProbability, state: PublishedOdds) -> float:
    """The chance to win from a state whose share of wins is published."""
    if state.hammer:
        return odds.with_hammer(state.lead, state.ends_left)
    return 1 - odds.with_hammer(-state.lead, state.ends_left)


def win_table(odds: WinProbability) -> dict[str, float]:
    """The chance to win from each of the published states, by its words."""
    return {state.words: chance(odds, state) for state in PUBLISHED_ODDS}


def shares_won(games: Sequence[GameRecord]) -> list[dict[str, Any]]:
    """How often teams won from the published states in these games.

    Returns
    -------
    for each state its words, how often it occurred, and the share of wins; None where it did not
    """
    found: list[dict[str, Any]] = []
    for state in PUBLISHED_ODDS:
        lead = state.lead if state.hammer else -state.lead
        won = [
            end.won == state.hammer
            for end in ends_of(games)
            if end.lead == lead and end.ends_left == state.ends_left
        ]
        found.append(
            {
                "words": state.words,
                "number": len(won),
                "share": float(np.mean(won)) if won else None,
            }
        )
    return found


def _pair(shot: ShotRecord) -> tuple[float, bool]:
    return shot.predicted, shot.won


def _calibration(by_game: Sequence[Sequence[tuple[float, bool]]], seed: int) -> Calibration:
    both = [np.array(pairs, dtype=np.float64).reshape(-1, 2) for pairs in by_game]
    every = np.concatenate(both)
    place = np.minimum((every[:, 0] * BINS).astype(int), BINS - 1)
    bins: list[CalibrationBin] = []
    for k in range(BINS):
        here = every[place == k]
        if not len(here):
            continue
        sums = np.array(
            [
                [pairs[at, 1].sum(), at.sum()]
                for pairs in both
                for at in [np.minimum((pairs[:, 0] * BINS).astype(int), BINS - 1) == k]
            ]
        )
        low, high = _interval(sums, seed)
        bins.append(
            CalibrationBin(
                predicted=float(here[:, 0].mean()),
                number=len(here),
                share=float(here[:, 1].mean()),
                low=low,
                high=high,
            )
        )
    return Calibration(bins=tuple(bins), brier=float(((every[:, 0] - every[:, 1]) ** 2).mean()))


def _interval(sums: Floats, seed: int) -> tuple[float, float]:
    """95 % interval of a ratio of sums, (games, 2), by resampling games."""
    rng = np.random.default_rng(seed)
    drawn = sums[rng.integers(len(sums), size=(RESAMPLES, len(sums)))].sum(axis=1)
    drawn = drawn[drawn[:, 1] > 0]
    low, high = np.quantile(drawn[:, 0] / drawn[:, 1], [0.025, 0.975])
    return float(low), float(high)
