"""Changes of the ice during a game; every change can be switched off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.errors import InputError
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.wear import with_wear_in_map


@dataclass(frozen=True, kw_only=True)
class IceEvolution:
    """Changes of the ice during a game; zeros mean no change.

    Parameters
    ----------
    wear : relative change of μ under a stone's running band for each pass; negative makes the ice
        keener. It is `along_path` of the effect `pebble_wear`, and adds to that of the ice
    frost : relative change of μ of the whole sheet in an hour; positive makes the ice heavier
    stone_spread : relative standard deviation of μ from stone to stone
    pace : time from one delivery to the next [s]

    Raises
    ------
    InputError : a change out of range

    Source
    ------
    No measurements exist. Assumptions: worn places lose 0.2–0.5 % a pass and about 8 % in a game,
    and matched stones differ by 0.5–1 %. A game of 160 stones takes about two hours and three
    quarters.
    """

    wear: float = 0.0
    frost: float = 0.0
    stone_spread: float = 0.0
    pace: float = 60.0

    def __post_init__(self) -> None:
        limits = {"wear": 0.05, "frost": 1.0, "stone_spread": 0.2}
        for name, limit in limits.items():
            if not abs(getattr(self, name)) <= limit:
                raise InputError(f"{name} must be within ±{limit:g}, got {getattr(self, name)}")
        if self.stone_spread < 0 or not 0 < self.pace < 3600:
            raise InputError(
                "stone_spread must be at least 0, and pace must be above 0 and below 3600 s"
            )


NO_EVOLUTION = IceEvolution()
"""Constant ice, and identical stones."""
TYPICAL_EVOLUTION = IceEvolution(wear=-0.003, frost=0.02, stone_spread=0.0075)
"""Changes of a usual game: the middles of the ranges above."""


def ice_for_game(ice: Ice, evolution: IceEvolution, seed: int, *, sweeping: bool) -> Ice:
    """Return the ice of a game: with the effects of its evolution, and of sweeping if there is any.

    Parameters
    ----------
    ice : ice at the start of the game
    evolution : its changes
    seed : seed of the game; it decides the friction of each stone
    sweeping : allow sweeping; ice without that effect gets the standard one
    """
    effects = list(with_wear_in_map(ice).effects)
    if evolution.wear:
        effects.append(ActiveEffect(name="pebble_wear", parameters={"along_path": evolution.wear}))
    if evolution.frost:
        effects.append(ActiveEffect(name="time_drift", parameters={"rate": evolution.frost / 3600}))
    if evolution.stone_spread:
        rng = np.random.default_rng((seed, 2**32 - 1))
        for stone, deviate in enumerate(rng.standard_normal(2 * STONES_PER_TEAM)):
            factor = float(np.exp(evolution.stone_spread * deviate))
            parameters = {"stone": float(stone), "factor": factor}
            effects.append(ActiveEffect(name="stone_bias", parameters=parameters))
    if sweeping and ice.effect("sweeping") is None:
        effects.append(ActiveEffect(name="sweeping"))
    return replace(ice, effects=tuple(effects))
