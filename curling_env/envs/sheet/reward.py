"""The reward of a throw: named parts, then one weighted sum.

One formula serves a single throw and arrays of many throws.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.sheet import HOUSE_RADIUS
from curling_env.typing import Floats

MAX_MISS = 10.0
"""Maximum distance from the target that counts in the reward [m]."""
PRECISION_LENGTH = 0.5
"""Distance from the target at which the part `precision` has fallen to 1/e [m]."""

Values = float | Floats
"""A number for one throw, or one for each of many throws."""


@dataclass(frozen=True, kw_only=True)
class RewardParts:
    """Reward of a throw, before weighting.

    Parameters
    ----------
    distance : minus the distance from target to stone, in radii of the house
    precision : 1 on the target, falling to 1/e at half a metre; 0 for a stone out of play
    in_house : 1 if the stone rests in the house
    out_of_play : -1 if the stone does not stay in play
    removed : 1 if the target stone left play, else how far it was pushed, in radii of the house
        and at most a half
    success : 1 if the task was done
    """

    distance: Values
    precision: Values
    in_house: Values
    out_of_play: Values
    removed: Values
    success: Values

    def as_dict(self) -> dict[str, Values]:
        """Return the parts by name."""
        return {name: getattr(self, name) for name in PARTS}


PARTS = tuple(part.name for part in fields(RewardParts))
"""Names of the parts."""


@dataclass(frozen=True, kw_only=True)
class RewardWeights:
    """Weight of each part of the reward; see `RewardParts`.

    The defaults are those of a draw. Every task has its own weights, see `tasks`.

    Raises
    ------
    InputError : a weight that is not finite
    """

    distance: float = 1.0
    precision: float = 1.0
    in_house: float = 0.25
    out_of_play: float = 2.0
    removed: float = 0.0
    success: float = 0.0

    def __post_init__(self) -> None:
        for part in fields(self):
            value = getattr(self, part.name)
            if not abs(value) < float("inf"):
                raise InputError(f"the weight of {part.name} must be finite, got {value}")

    def total(self, parts: RewardParts) -> Values:
        """Return the reward: the weighted sum of the parts."""
        return sum(getattr(self, name) * getattr(parts, name) for name in PARTS)


@dataclass(frozen=True, kw_only=True)
class Landing:
    """Final positions of the stones that matter to the task.

    Positions are in the delivery frame [m]. The leading dimensions (...) are those of the throws,
    none for a single throw.

    Parameters
    ----------
    stone : (..., 2) where the delivered stone ended, in play or not
    in_play : (...) whether it stayed in play
    target : (..., 2) where it should have ended
    target_stone : (..., 2) where the task's target stone lies afterwards; NaN where it left play,
        or where the task has none
    target_stone_before : (..., 2) where it lay before the throw
    stone_radius : radius of a stone [m]; (...) where throws are on different ices
    """

    stone: Any
    in_play: Any
    target: Any
    target_stone: Any
    target_stone_before: Any
    stone_radius: Any

    @property
    def distance_m(self) -> Any:
        """Distance of the delivered stone's final position from the target, (...) [m]."""
        return _distance(self.stone, self.target)

    @property
    def in_house(self) -> Any:
        """True if the delivered stone stayed in play and touches the house, (...)."""
        return self.in_play & (_distance(self.stone, 0.0) <= HOUSE_RADIUS + self.stone_radius)

    @property
    def is_out(self) -> Any:
        """True if the target stone left play, (...); False without a target stone."""
        return np.isnan(self.target_stone[..., 0]) & ~np.isnan(self.target_stone_before[..., 0])

    @property
    def pushed(self) -> Any:
        """Distance that the target stone was pushed, (...) [m]; NaN if it left play."""
        return _distance(self.target_stone, self.target_stone_before)

    @property
    def gap(self) -> Any:
        """Gap between the delivered and the target stone, (...) [m]; NaN if one left play."""
        return _distance(self.stone, self.target_stone) - 2 * self.stone_radius


def _distance(places: Any, others: Any) -> Any:
    apart = places - others
    return np.hypot(apart[..., 0], apart[..., 1])


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Evaluation of a throw; each value is one number, or (...) for many throws.

    Parameters
    ----------
    distance_m : distance from the target to where the stone ended [m]
    in_house : whether the stone stayed in play and touches the house
    success : whether the task was done
    parts : the parts of the reward
    """

    distance_m: Any
    in_house: Any
    success: Any
    parts: RewardParts


def judge(landing: Landing, success: Any) -> Verdict:
    """Evaluate the final positions of a throw's stones.

    Parameters
    ----------
    landing : where they ended
    success : (...) whether the task was done
    """
    distance_m, in_house, in_play = landing.distance_m, landing.in_house, landing.in_play
    pushed: Floats = landing.pushed / HOUSE_RADIUS
    return Verdict(
        distance_m=distance_m,
        in_house=in_house,
        success=success,
        parts=RewardParts(
            distance=-np.minimum(distance_m, MAX_MISS) / HOUSE_RADIUS,
            precision=np.where(in_play, np.exp(-distance_m / PRECISION_LENGTH), 0.0),
            in_house=in_house * 1.0,
            out_of_play=in_play * 1.0 - 1.0,
            removed=np.where(np.isnan(pushed), landing.is_out, np.minimum(pushed, 0.5)),
            success=success * 1.0,
        ),
    )
