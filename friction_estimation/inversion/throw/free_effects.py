"""Effects of an ice fitted together with its map.

A parameter of an effect bends a path as the friction of a cell does. So it is one more column in
the normal equations of the throws, and map and parameter are weighed against each other with all
that the data say about both: a friction that falls with speed is not mistaken for ice that is
heavy where stones are slow. Only parameters that act along the travel are fitted. What acts across
it (curl, a slope to the side) cannot be seen by a stone that follows its measured line, and stays
as it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.effects import catalogue, mistaken_for
from curling_env.physics.law import acceleration
from curling_env.typing import Floats
from friction_estimation.inversion.tuning import PARAMETER_PRIOR_SD

if TYPE_CHECKING:
    from friction_estimation.inversion.throw.fitted import FittedThrow

PARAMETER_STEP = 1e-3
"""Step of the difference quotients, in prior standard deviations."""


@dataclass(frozen=True, kw_only=True)
class FreeParameter:
    """A parameter that is fitted.

    Parameters
    ----------
    effect : index of its effect on the ice
    name : name of the parameter
    start : value that the ice gives
    low, high : bounds on the card of the effect
    """

    effect: int
    name: str
    start: float
    low: float
    high: float

    @property
    def prior_sd(self) -> float:
        """Prior standard deviation about the start; a range without an end counts as 1 wide."""
        width = self.high - self.low
        return PARAMETER_PRIOR_SD * (width if np.isfinite(width) else 1.0)


@dataclass(frozen=True, kw_only=True)
class FreeEffects:
    """The effects of an ice, some of their parameters free.

    Parameters
    ----------
    ice : ice with the effects at their start
    parameters : parameters that are fitted
    values : (p,) present values, in prior standard deviations from their starts
    """

    ice: Ice
    parameters: tuple[FreeParameter, ...] = ()
    values: Floats

    def __len__(self) -> int:
        return len(self.parameters)

    @cached_property
    def current(self) -> Ice:
        """The ice with the present values of the parameters."""
        return self._with(self.values, None)

    def perturbed(self, k: int) -> Ice:
        """The ice with the k-th parameter moved by `PARAMETER_STEP` prior standard deviations."""
        step = np.zeros(len(self))
        step[k] = PARAMETER_STEP
        return self._with(self.values + step, None)

    def with_values(self, values: Floats) -> FreeEffects:
        """The same with other values, kept within their bounds."""
        within = [
            (np.clip(p.start + v * p.prior_sd, p.low, p.high) - p.start) / p.prior_sd
            for p, v in zip(self.parameters, values, strict=True)
        ]
        return replace(self, values=np.array(within, dtype=np.float64))

    def fitted_effects(self, sigma: Floats) -> tuple[ActiveEffect, ...]:
        """The effects with the present values and their standard errors.

        Parameters
        ----------
        sigma : (p,) standard errors, in prior standard deviations
        """
        return self._with(self.values, sigma).effects

    def _with(self, values: Floats, sigma: Floats | None) -> Ice:
        effects = list(self.ice.effects)
        for k, p in enumerate(self.parameters):
            old = effects[p.effect]
            effects[p.effect] = replace(
                old,
                parameters={**old.parameters, p.name: p.start + float(values[k]) * p.prior_sd},
                sigma=old.sigma
                if sigma is None
                else {**old.sigma, p.name: float(sigma[k]) * p.prior_sd},
            )
        return replace(self.ice, effects=tuple(effects))


def free_effects(ice: Ice, throws: Sequence[FittedThrow]) -> FreeEffects:
    """Free the parameters that switch an effect on or off and act along the travel of some throw.

    Parameters
    ----------
    ice : ice with the effects
    throws : throws on it
    """
    cards = catalogue()
    candidates: list[FreeParameter] = []
    for index, effect in enumerate(ice.effects):
        card = cards.get(effect.name)
        for p in card.parameters if card and card.is_physical else ():
            if p.neutral is None:
                continue
            given = effect.parameters.get(p.name, p.default if p.default is not None else p.neutral)
            candidates.append(
                FreeParameter(effect=index, name=p.name, start=float(given), low=p.low, high=p.high)
            )
    free = FreeEffects(ice=ice, parameters=tuple(candidates), values=np.zeros(len(candidates)))
    along, across = np.zeros(len(candidates)), np.zeros(len(candidates))
    for k in range(len(candidates)):
        for throw in throws:
            ahead, aside = _difference(free.current, free.perturbed(k), throw)
            along[k] += ahead
            across[k] += aside
    felt = (along > across) & (along > 0.0)
    kept = tuple(p for p, acts in zip(candidates, felt, strict=True) if acts)
    return FreeEffects(ice=ice, parameters=kept, values=np.zeros(len(kept)))


def no_effects(ice: Ice) -> FreeEffects:
    """The effects of an ice with no free parameter."""
    return FreeEffects(ice=ice, values=np.empty(0))


def with_camera_like_effects(free: FreeEffects, throws: Sequence[FittedThrow]) -> FreeEffects:
    """The free effects together with those, also free, that resemble a bias of the camera."""
    given = {effect.name for effect in free.ice.effects}
    added = tuple(
        ActiveEffect(name=card.name, parameters=card.neutral)
        for card in mistaken_for("camera")
        if card.name not in given
    )
    own = len(free.ice.effects)
    ice = replace(free.ice, effects=(*free.ice.effects, *added))
    rivals = tuple(p for p in free_effects(ice, throws).parameters if p.effect >= own)
    return FreeEffects(
        ice=ice,
        parameters=(*free.parameters, *rivals),
        values=np.append(free.values, np.zeros(len(rivals))),
    )


def _difference(ice: Ice, other: Ice, throw: FittedThrow) -> tuple[float, float]:
    """Mean squares of the difference of two laws along and across the travel [m²/s⁴]."""
    inputs = throw.inputs
    rows = slice(None, None, 15)
    speed = np.maximum(np.gradient(throw.measured, throw.t), 0.05)[rows]
    heading = inputs.path.heading_at(throw.measured[rows])
    states = np.column_stack(
        [
            inputs.path.at(throw.measured[rows]),
            speed[:, None] * heading,
            np.full(len(speed), inputs.spin),
        ]
    )
    swept = bool(len(inputs.sweeps))
    one, two = (
        acceleration(
            ice_, states, clock=inputs.clock, order=inputs.order, stone=inputs.stone, swept=swept
        )[:, :2]
        for ice_ in (ice, other)
    )
    apart = two - one
    ahead = (apart * heading).sum(axis=1)
    aside = apart[:, 1] * heading[:, 0] - apart[:, 0] * heading[:, 1]
    return float((ahead**2).mean()), float((aside**2).mean())
