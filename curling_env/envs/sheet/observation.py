"""What an agent sees: the target, the stones, and what may be known of the ice.

Everything is in the delivery frame and scaled to about [-1, 1], so that what is learnt towards one
end serves towards the other. `names` says what each number is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from curling_env.ice import Ice
from curling_env.physics.effects import EffectCard, Parameter, catalogue
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, HOG_TO_TEE, TEE_Y, Direction, to_sheet
from curling_env.typing import Floats, Singles

# The layout and the scales of an observation. A change to any of them makes a new version of the
# environments.
BANDS = 8
"""Number of bands of ice from the delivery hog line to the far back line whose μ is observed."""
LANES = ("left", "middle", "right")
"""Thirds of the sheet's width whose μ is observed, seen along the direction of play."""
LENGTH_SCALE = HOG_TO_TEE + 0.6
"""Distance along the sheet that counts as 1 [m]: from the tee to just before the hog line."""
MU_SCALE = 0.01
"""Friction that counts as 0; friction e² times as large counts as 1."""
VARIATION_SCALE = 0.2
"""Relative difference of a band's friction from the mean that counts as 1."""


def observed_parameters() -> list[tuple[EffectCard, Parameter, float]]:
    """The parameters of effects that an agent may observe, as their cards say.

    Returns
    -------
    card, parameter and the value that counts as 1; an effect that the ice does not have reads 0
    """
    cards = sorted(catalogue().values(), key=lambda card: card.observed_order)
    return [
        (card, card.parameter(name), scale)
        for card in cards
        for name, scale in card.observed.items()
    ]


def ice_features(ice: Ice, direction: Direction) -> Singles:
    """What an agent observes of an ice, seen along a direction of play.

    Parameters
    ----------
    ice : the ice as the agent knows it
    direction : the end played to

    Returns
    -------
    (1 + 3 BANDS + parameters,) within ±1: the mean μ, the difference from it in each band and
    lane, the parameters of the effects
    """
    mean, bands = _bands(ice, direction)
    effects: list[float] = []
    for card, parameter, scale in observed_parameters():
        effect = ice.effect(card.name)
        value = float(effect.parameters.get(parameter.name, 0.0)) if effect else 0.0
        # A vector of the sheet frame is seen along the direction of play.
        effects.append(value / scale * (direction if parameter.axis else 1))
    numbers = [np.log(mean / MU_SCALE) / 2, *bands.ravel(), *effects]
    return np.clip(numbers, -1.0, 1.0).astype(np.float32)


def _bands(ice: Ice, direction: Direction) -> tuple[float, Floats]:
    """Mean μ, and scaled relative differences from it, (BANDS, 3)."""
    along = np.linspace(-HOG_LINE_Y, BACK_LINE_Y, BANDS * 8 + 1)
    across = np.linspace(-ice.sheet.width / 2, ice.sheet.width / 2, 3 * 6 + 1)
    y = (along[:-1] + along[1:]) / 2 - TEE_Y
    x = (across[:-1] + across[1:]) / 2
    points = np.stack(np.meshgrid(x, y), axis=-1)
    mu = ice.mu_at(to_sheet(points, direction)).reshape(BANDS, 8, 3, 6).mean(axis=(1, 3))
    return float(mu.mean()), (mu / mu.mean() - 1) / VARIATION_SCALE


@dataclass(frozen=True, kw_only=True)
class SheetObservation:
    """Makes the observations of `CurlingSheet-v0`.

    Parameters
    ----------
    slots : number of places for stones
    width : width of the sheet [m]
    """

    slots: int
    width: float

    @property
    def names(self) -> tuple[str, ...]:
        """What each number of the observation is."""
        return (
            "target x",
            "target y",
            "throws left",
            "mean friction",
            *(f"friction of band {i + 1}, {lane}" for i in range(BANDS) for lane in LANES),
            *(f"{card.name}.{parameter.name}" for card, parameter, _ in observed_parameters()),
            *(f"stone {k + 1} {what}" for k in range(self.slots) for what in ("team", "x", "y")),
        )

    def scaled(self, xy: ArrayLike) -> Floats:
        """Positions (..., 2) in the delivery frame [m] on the scale of the observation."""
        return np.asarray(xy, dtype=np.float64) / np.array([self.width / 2, LENGTH_SCALE])

    def vector(
        self,
        *,
        target: Floats,
        throws_left: ArrayLike,
        known: Singles,
        stones: Floats,
        own: ArrayLike,
    ) -> Singles:
        """The observation of one sheet, or of many with leading dimensions (...).

        Parameters
        ----------
        target : (..., 2) delivery frame [m]
        throws_left : (...) share of the episode's throws still to come
        known : (..., m) what is known of the ice, from `ice_features`
        stones : (..., k, 2) at most `slots` stones, delivery frame [m]; NaN where there is none
        own : (..., k) for each stone, whether it is the agent's

        Returns
        -------
        (..., n) within ±1, in the order of `names`
        """
        first = 3 + known.shape[-1]
        out = np.zeros((*known.shape[:-1], first + 3 * self.slots), dtype=np.float32)
        out[..., :2] = self.scaled(target)
        out[..., 2] = throws_left
        out[..., 3:first] = known
        count = stones.shape[-2]
        if count:
            seen = np.empty((*stones.shape[:-1], 3))
            seen[..., 0] = np.where(own, 1.0, -1.0)
            seen[..., 1:] = self.scaled(stones)
            seen[np.isnan(stones[..., 0])] = 0.0
            out[..., first : first + 3 * count] = seen.reshape(*known.shape[:-1], 3 * count)
        return np.clip(out, -1.0, 1.0, out=out)
