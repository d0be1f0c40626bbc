"""The reward of a game: named parts, then one weighted sum."""

from __future__ import annotations

from dataclasses import dataclass, fields

from curling_env.errors import InputError
from curling_env.game.rules.delivery import Fault, Ruling
from curling_env.game.rules.game import Game
from curling_env.game.rules.teams import Team


@dataclass(frozen=True, kw_only=True)
class GameRewardParts:
    """Reward of a team since its last delivery, before weighting.

    Parameters
    ----------
    points : points scored less points conceded in an end that was completed
    win : 1 for a game won, -1 for one lost
    fault : -1 for a delivery of the team that broke a rule; a hogged stone is none
    potential : by how much the potential of the position rose, where the environment has one; see
        `potential`
    """

    points: float = 0.0
    win: float = 0.0
    fault: float = 0.0
    potential: float = 0.0

    def as_dict(self) -> dict[str, float]:
        """Return the parts by name."""
        return {part.name: getattr(self, part.name) for part in fields(self)}

    def __add__(self, other: GameRewardParts) -> GameRewardParts:
        if other is NOTHING or self is NOTHING:
            return self if other is NOTHING else other
        return GameRewardParts(
            points=self.points + other.points,
            win=self.win + other.win,
            fault=self.fault + other.fault,
            potential=self.potential + other.potential,
        )


NOTHING = GameRewardParts()
"""Reward of most deliveries."""


@dataclass(frozen=True, kw_only=True)
class GameRewardWeights:
    """Weight of each part of the reward; see `GameRewardParts`.

    Raises
    ------
    InputError : a weight that is not finite
    """

    points: float = 1.0
    win: float = 0.0
    fault: float = 0.0
    potential: float = 1.0

    def __post_init__(self) -> None:
        for part in fields(self):
            value = getattr(self, part.name)
            if not abs(value) < float("inf"):
                raise InputError(f"the weight of {part.name} must be finite, got {value}")

    def total(self, parts: GameRewardParts) -> float:
        """Return the reward: the weighted sum of the parts."""
        return sum(getattr(self, part.name) * getattr(parts, part.name) for part in fields(self))


def concession_parts(conceded: Team, team: Team) -> GameRewardParts:
    """Return the reward of a concession for a team."""
    return GameRewardParts(win=-1.0 if conceded is team else 1.0)


def reward_parts(
    before: Game, after: Game, thrower: Team, ruling: Ruling, team: Team
) -> GameRewardParts:
    """Return the reward of one delivery for a team.

    Parameters
    ----------
    before, after : the game before and after the delivery
    thrower : the team that delivered
    ruling : what the rules made of the delivery
    team : the team that is rewarded
    """
    if after.end is not None and ruling.fault is None:
        return NOTHING
    points = win = 0.0
    if len(after.line_score) > len(before.line_score):
        last = after.line_score[-1]
        points = float(last[team] - last[team.other])
    if after.winner is not None:
        win = 1.0 if after.winner is team else -1.0
    own_fault = thrower is team and ruling.fault not in (None, Fault.HOG_LINE)
    if not (points or win or own_fault):
        return NOTHING
    return GameRewardParts(points=points, win=win, fault=-1.0 if own_fault else 0.0)
