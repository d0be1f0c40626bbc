"""The reward of a throw at a target: named parts, then one weighted sum."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import exp

from curling_env.errors import InputError
from curling_env.sheet import HOUSE_RADIUS

FARTHEST = 10.0
"""Distance beyond which a miss counts no worse [m]."""
PRECISION = 0.5
"""Distance at which the bonus for precision has fallen to 1/e [m]."""


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

    distance: float
    precision: float
    in_house: float
    out_of_play: float

    def as_dict(self) -> dict[str, float]:
        """The parts by name."""
        return {part.name: getattr(self, part.name) for part in fields(self)}


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

    def total(self, parts: RewardParts) -> float:
        """The reward."""
        return sum(getattr(self, part.name) * getattr(parts, part.name) for part in fields(self))


def reward_parts(distance_m: float, *, in_play: bool, in_house: bool) -> RewardParts:
    """What a throw earned.

    Parameters
    ----------
    distance_m : from the target to where the stone ended [m]
    in_play : whether it stayed in play
    in_house : whether it touches the house
    """
    return RewardParts(
        distance=-min(distance_m, FARTHEST) / HOUSE_RADIUS,
        precision=exp(-distance_m / PRECISION) if in_play else 0.0,
        in_house=float(in_play and in_house),
        out_of_play=0.0 if in_play else -1.0,
    )
