"""The reward of a throw at a target: named parts, then one weighted sum.

Everything works on one throw or on arrays of many.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.sheet import HOUSE_RADIUS

FARTHEST = 10.0
"""Distance beyond which a miss counts no worse [m]."""
PRECISION = 0.5
"""Distance at which the bonus for precision has fallen to 1/e [m]."""

Values = float | NDArray[np.float64]
"""One for a throw, or one for each of many throws."""


@dataclass(frozen=True, kw_only=True)
class RewardParts:
    """What a throw earned, before weighting.

    Parameters
    ----------
    distance : minus the distance from target to stone, in radii of the house
    precision : 1 on the target, falling within half a metre
    in_house : 1 if the stone rests in the house
    out_of_play : -1 if it does not stay in play
    """

    distance: Values
    precision: Values
    in_house: Values
    out_of_play: Values

    def as_dict(self) -> dict[str, Values]:
        """The parts by name."""
        return {name: getattr(self, name) for name in PARTS}


PARTS = tuple(part.name for part in fields(RewardParts))
"""Names of the parts."""


@dataclass(frozen=True, kw_only=True)
class RewardWeights:
    """How much each part of the reward counts; see `RewardParts`."""

    distance: float = 1.0
    precision: float = 1.0
    in_house: float = 0.25
    out_of_play: float = 2.0

    def __post_init__(self) -> None:
        for part in fields(self):
            value = getattr(self, part.name)
            if not abs(value) < float("inf"):
                raise InputError(f"the weight of {part.name} must be finite, got {value}")

    def total(self, parts: RewardParts) -> Values:
        """The reward."""
        return sum(getattr(self, name) * getattr(parts, name) for name in PARTS)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What came of a throw at a target.

    Parameters
    ----------
    distance_m : from the target to where the stone ended [m]
    in_house : whether it stayed in play and touches the house
    parts : of the reward
    """

    distance_m: Any
    in_house: Any
    parts: RewardParts


def judge(place: Any, target: Any, in_play: Any, radius: float) -> Verdict:
    """Judge where stones ended.

    Parameters
    ----------
    place : (..., 2) where each stone ended, delivery frame [m]
    target : (..., 2) where it was to end [m]
    in_play : (...) whether it stayed in play
    radius : of a stone [m]
    """
    miss = place - target
    distance_m = np.hypot(miss[..., 0], miss[..., 1])
    in_house = in_play & (np.hypot(place[..., 0], place[..., 1]) <= HOUSE_RADIUS + radius)
    return Verdict(
        distance_m=distance_m,
        in_house=in_house,
        parts=RewardParts(
            distance=-np.minimum(distance_m, FARTHEST) / HOUSE_RADIUS,
            precision=np.where(in_play, np.exp(-distance_m / PRECISION), 0.0),
            in_house=in_house * 1.0,
            out_of_play=in_play * 1.0 - 1.0,
        ),
    )
