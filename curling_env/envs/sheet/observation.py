"""Observation of `CurlingSheet-v0`: the target, the stones, and the known ice.

Everything is in the delivery frame and scaled to [-1, 1], so that a policy learned towards one end
applies to the other. `names` lists the numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from curling_env.envs.known_ice import ice_names, stone_names
from curling_env.sheet import HOG_TO_TEE
from curling_env.typing import Floats, Singles

LENGTH_SCALE = HOG_TO_TEE + 0.6
"""Distance along the sheet that counts as 1 [m]: from the tee to just before the hog line."""
CLOCK_SCALE = 3600.0
"""Time since the episode began that counts as 1 [s]; later counts as 1 too."""


@dataclass(frozen=True, kw_only=True)
class SheetObservation:
    """Maker of the observations of `CurlingSheet-v0`.

    Parameters
    ----------
    slots : number of places for stones
    width : width of the sheet [m]
    """

    slots: int
    width: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers of the observation, in order."""
        return (
            "target x",
            "target y",
            "throws left",
            "clock",
            *(f"next stone {what}" for what in stone_names()),
            *ice_names(),
            *(f"stone {k + 1} {what}" for k in range(self.slots) for what in stone_names()),
            *(f"stone {k + 1} {what}" for k in range(self.slots) for what in ("team", "x", "y")),
        )

    @cached_property
    def _of_a_stone(self) -> int:
        return len(stone_names())

    @cached_property
    def _scale(self) -> Floats:
        return np.array([self.width / 2, LENGTH_SCALE])

    def scaled(self, xy: ArrayLike) -> Floats:
        """Scale positions (..., 2) in the delivery frame [m] for the observation."""
        return np.asarray(xy, dtype=np.float64) / self._scale

    def vector(
        self,
        *,
        target: Floats,
        throws_left: ArrayLike,
        clock: ArrayLike,
        known: Singles,
        next_stone: Singles | None,
        stones: Floats,
        own: ArrayLike,
        of_stones: Singles | None,
    ) -> Singles:
        """Return the observation of one sheet, or of many with leading dimensions (...).

        Parameters
        ----------
        target : (..., 2) delivery frame [m]
        throws_left : (...) share of the episode's throws still to come
        clock : (...) time since the episode began [s]
        known : (..., m) what is known of the ice, from `KnownIce.features`
        next_stone : (..., b) what is known of the stone to be thrown, from `KnownIce.of_stones`;
            None for usual stones
        stones : (..., k, 2) at most `slots` stones, delivery frame [m]; NaN for missing ones
        own : (..., k) for each stone, whether it is the agent's
        of_stones : (..., k, b) what is known of each stone; None for usual stones

        Returns
        -------
        (..., n) within ±1, in the order of `names`
        """
        one, ice = self._of_a_stone, known.shape[-1]
        own_numbers = 4 + one + ice
        first = own_numbers + one * self.slots
        out = np.zeros((*known.shape[:-1], first + 3 * self.slots), dtype=np.float32)
        out[..., :2] = self.scaled(target)
        out[..., 2] = throws_left
        out[..., 3] = np.asarray(clock) / CLOCK_SCALE
        if next_stone is not None:
            out[..., 4 : 4 + one] = next_stone
        out[..., 4 + one : own_numbers] = known
        there = ~np.isnan(stones[..., 0])
        if there.any():
            shape, count = known.shape[:-1], stones.shape[-2]
            if of_stones is not None:
                of_each = np.where(there[..., None], of_stones, 0.0).reshape(*shape, one * count)
                out[..., own_numbers : own_numbers + one * count] = of_each
            seen = np.empty((*stones.shape[:-1], 3))
            seen[..., 0] = np.where(own, 1.0, -1.0)
            seen[..., 1:] = self.scaled(stones)
            seen[~there] = 0.0
            out[..., first : first + 3 * count] = seen.reshape(*shape, 3 * count)
        np.maximum(out, -1.0, out=out)
        return np.minimum(out, 1.0, out=out)
