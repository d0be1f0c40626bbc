"""How ends of championships were scored, and how a sample of ends compares with them.

Everything is seen from the team with the hammer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import chi2

from agents.playing.search.positions import MAX_POINTS
from agents.playing.tournament import wilson
from curling_env.typing import Floats, Integers

CLASSES = ("-3", "-2", "-1", "blank", "1", "2", "3+")
"""Classes of the scores of an end: three or more points either way are one class."""
PUBLISHED_SHARES = (0.020, 0.046, 0.143, 0.131, 0.344, 0.230, 0.086)
"""Share of ends in each class."""
PUBLISHED_ENDS, PUBLISHED_GAMES = 37_624, 4_154
PUBLISHED_NET = 0.77
"""Points of the team with the hammer less its opponent's, an end."""
PUBLISHED_SOURCE = "pointsgained, from the published result books of championships"
"""Where these and `PUBLISHED_ODDS` come from."""

PERFECT_SHARES = {"front": 0.80, "takeout": 0.66, "guard": 0.64, "draw": 0.54, "double": 0.42}
"""Share of shots that were graded 4, by type."""
POSITION_POINTS = {"all": 3.1, "lead": 3.3, "second": 3.1, "third": 3.1, "skip": 2.9}
"""Mean points of a shot, 0 to 4, of all and by who threw it."""
WOMEN_SOURCE = (
    "469,067 shots of women's championships, 2002 to 2024 (data of doubletakeout.com, as analysed "
    "in candrews13/womens_curling; read)"
)
"""Where these two come from."""
DRAW_POINTS = {"first draw": 3.65, "last draw": 3.18}
"""Mean points of draws as the first and the last stone of an end, at men's world championships."""
DRAWS_SOURCE = "men's world championships (doubletakeout.com, Exploring shot data; read)"
SHOT_SHARES = {"hits": 838 / 1930, "double": 122 / 1930, "run-back": 44 / 1930}
"""Share of all shots that were hits, double takeouts and promotions, of winning teams."""
SHARES_SOURCE = (
    "1,930 shots of winning teams at the Olympic Games of 2014 (Park & Lee, The characteristic "
    "analysis of winners and losers in curling, table 3; read)"
)


@dataclass(frozen=True, kw_only=True)
class PublishedOdds:
    """How often a team won from a state of the game, before the first stone of an end.

    Parameters
    ----------
    words : the state in words
    lead : lead of the team
    ends_left : scheduled ends to come
    hammer : whether the team has the hammer
    share : share of games that it won
    """

    words: str
    lead: int
    ends_left: int
    hammer: bool
    share: float


PUBLISHED_ODDS = (
    PublishedOdds(words="level, ten ends left", lead=0, ends_left=10, hammer=True, share=0.626),
    PublishedOdds(words="level, one left", lead=0, ends_left=1, hammer=True, share=0.796),
    PublishedOdds(words="one down, five left", lead=-1, ends_left=5, hammer=True, share=0.439),
    PublishedOdds(words="two up, three left", lead=2, ends_left=3, hammer=False, share=0.808),
    PublishedOdds(words="two down, two left", lead=-2, ends_left=2, hammer=True, share=0.129),
)
"""The states that are published, by the same source."""


def class_counts(scores: Sequence[int] | Integers) -> Integers:
    """Number of ends in each of `CLASSES`, (7,).

    Parameters
    ----------
    scores : (n,) score of the team with the hammer, negative for its opponent's
    """
    return np.bincount(np.clip(np.asarray(scores, dtype=np.int64), -3, 3) + 3, minlength=7)


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Ends beside published ones.

    Parameters
    ----------
    counts : (7,) ends in each of `CLASSES`
    shares, low, high : (7,) their shares, with 95 % intervals (Wilson)
    chi_square, p_value : of the null hypothesis that both are samples of the same ends
    net : points of the hammer team less its opponent's, an end, at most three counted
    """

    counts: Integers
    shares: Floats
    low: Floats
    high: Floats
    chi_square: float
    p_value: float
    net: float

    @property
    def largest_difference(self) -> float:
        """Of the shares, in percentage points."""
        return float(100 * np.abs(self.shares - PUBLISHED_SHARES).max())

    def text(self) -> str:
        """A table for people."""
        rows = ["  class   published      here      95 %"]
        for name, want, share, low, high in zip(
            CLASSES, PUBLISHED_SHARES, self.shares, self.low, self.high, strict=True
        ):
            rows.append(
                f"  {name:<7}{100 * want:8.1f} %{100 * share:9.1f} %   "
                f"{100 * low:.1f} to {100 * high:.1f} %"
            )
        rows.append(
            f"  {self.counts.sum()} ends, net {self.net:+.2f} ({PUBLISHED_NET:+.2f}), "
            f"χ² {self.chi_square:.1f} for 6 degrees of freedom, p {self.p_value:.2g}"
        )
        return "\n".join(rows)


def compared(
    counts: ArrayLike,
    shares: ArrayLike = PUBLISHED_SHARES,
    ends: int = PUBLISHED_ENDS,
) -> Comparison:
    """Ends beside published ones, or beside those of other games.

    Parameters
    ----------
    counts : (7,) ends in each of `CLASSES`
    shares : (7,) shares of the other ends
    ends : number of the other ends
    """
    ours = np.asarray(counts, dtype=np.float64)
    theirs = ends * np.asarray(shares, dtype=np.float64) / np.sum(shares)
    n, whole = ours.sum(), ours + theirs
    square = 0.0
    for part in (ours, theirs):
        expected = whole * part.sum() / whole.sum()
        there = expected > 0
        square += float(((part - expected)[there] ** 2 / expected[there]).sum())
    freedom = max(int((whole > 0).sum()) - 1, 1)
    low, high = np.array([wilson(float(k), int(n)) for k in ours]).T
    return Comparison(
        counts=ours.astype(np.int64),
        shares=ours / n,
        low=low,
        high=high,
        chi_square=square,
        p_value=float(chi2.sf(square, freedom)),
        net=float(ours @ np.arange(-3, 4) / n),
    )


def score_shares(shares: ArrayLike = PUBLISHED_SHARES) -> Floats:
    """Shares of the scores −6 to 6 (13,), as `WinProbability` takes them, from those of `CLASSES`.

    Three or more points are taken for three.
    """
    whole = np.zeros(2 * MAX_POINTS + 1)
    whole[MAX_POINTS - 3 : MAX_POINTS + 4] = shares
    return whole / whole.sum()
