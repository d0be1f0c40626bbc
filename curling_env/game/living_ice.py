"""Ice that changes while it is played on; every change can be switched off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.rules.stones import STONES_A_TEAM
from curling_env.sheet import Sheet
from curling_env.trajectory import Trajectory

Floats = NDArray[np.float64]

PATH_FPS = 30.0
"""Samples a second of paths: those that wear the ice, and those that are drawn or recorded."""


WORN_WIDTH = 0.125
"""Width of the track a stone wears, that of its running band [m]."""


@dataclass(frozen=True, kw_only=True)
class LivingIce:
    """How the ice changes during a game; zeros leave it as it is.

    Parameters
    ----------
    wear : relative change of μ where a stone's band ran, for each pass; negative runs keener. A
        cell changes by the share of its width that the band covers
    frost : relative change of μ over the whole sheet in an hour; positive runs heavier
    stone_spread : standard deviation of μ from stone to stone, relative
    pace : seconds from one delivery to the next

    Raises
    ------
    InputError : a change that no ice shows

    Source
    ------
    Wear of 0.2–0.5 % a pass at worn spots and about 8 % over a game are priors, not measurements;
    matched stones differ by 0.5–1 %. A game of 160 stones takes about two hours and three quarters.
    """

    wear: float = 0.0
    frost: float = 0.0
    stone_spread: float = 0.0
    pace: float = 60.0

    def __post_init__(self) -> None:
        limits = {"wear": 0.05, "frost": 1.0, "stone_spread": 0.2}
        for name, limit in limits.items():
            if not abs(getattr(self, name)) <= limit:
                raise InputError(f"{name} must lie within ±{limit:g}, got {getattr(self, name)}")
        if self.stone_spread < 0 or not 0 < self.pace < 3600:
            raise InputError("stone_spread must be at least 0 and pace a time below an hour")


STILL = LivingIce()
"""Ice that stays as it is, and stones that are all alike."""
USUAL = LivingIce(wear=-0.003, frost=0.02, stone_spread=0.0075)
"""A game's usual changes: middles of the ranges known."""


def prepared(ice: Ice, living: LivingIce, seed: int, *, sweeping: bool) -> Ice:
    """The ice as a game finds it: with frost, its own set of stones, and brooms if there are any.

    Parameters
    ----------
    seed : of the game; it decides which stones are keen
    sweeping : whether an ice that does not know sweeping is given its usual effect
    """
    effects = list(ice.effects)
    if living.frost:
        effects.append(ActiveEffect(name="time_drift", parameters={"rate": living.frost / 3600}))
    if living.stone_spread:
        rng = np.random.default_rng((seed, 2**32 - 1))
        for stone, deviate in enumerate(rng.standard_normal(2 * STONES_A_TEAM)):
            factor = float(np.exp(living.stone_spread * deviate))
            parameters = {"stone": float(stone), "factor": factor}
            effects.append(ActiveEffect(name="stone_bias", parameters=parameters))
    if sweeping and ice.effect("sweeping") is None:
        effects.append(ActiveEffect(name="sweeping"))
    return replace(ice, effects=tuple(effects))


def worn(ice: Ice, wear: Floats) -> Ice:
    """An ice whose cells have worn by the logarithms `wear` (rows, columns)."""
    friction = ice.friction
    return replace(
        ice,
        friction=FrictionMap(
            mu=friction.mu * np.exp(wear),
            sigma=friction.sigma,
            observed=friction.observed,
            interpolation=friction.interpolation,
        ),
    )


def wear_of(living: LivingIce, sheet: Sheet, paths: Sequence[Trajectory]) -> Floats:
    """What stones that moved along these paths change in ln μ of every cell, (rows, columns)."""
    passes = np.zeros(sheet.shape)
    for path in paths:
        touched = np.zeros(sheet.shape, dtype=bool)
        touched[sheet.cell_of(path.xy)] = True
        passes += touched
    return living.wear * min(WORN_WIDTH / sheet.cell_size, 1.0) * passes
