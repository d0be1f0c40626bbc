"""Effects of an ice fitted together with its map.

A parameter of an effect bends a ride as the friction of a cell does. So it is one more column in
the throws' normal equations, and map and parameter are weighed against each other with all that
the data say of both: a friction that falls with speed is not read as ice that is heavy where
stones are slow. Fitted are the strengths of what acts along the travel; what acts across it (curl,
a fall to the side) is invisible to a stone that rides its measured line, and stays as it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.effects import catalogue
from curling_env.physics.law import acceleration
from curling_env.typing import Floats

if TYPE_CHECKING:
    from friction_estimation.inversion.throw.fitted import Ridden


WIDE = 0.25
"""Prior standard deviation of a parameter about the value it has, in the width of its range."""
UNBOUNDED = 1.0
"""Width of a range without an end, in the parameter's unit."""
SMALL = 1e-3
"""Step of a difference quotient, in prior standard deviations."""


@dataclass(frozen=True, kw_only=True)
class Freed:
    """A parameter that is fitted.

    Parameters
    ----------
    effect : index of its effect on the ice
    name : of the parameter
    start : value that the ice gives
    low, high : bounds of its card
    """

    effect: int
    name: str
    start: float
    low: float
    high: float

    @property
    def spread(self) -> float:
        """Prior standard deviation."""
        width = self.high - self.low
        return WIDE * (width if np.isfinite(width) else UNBOUNDED)


@dataclass(frozen=True, kw_only=True)
class FreeEffects:
    """The effects of an ice with some parameters free.

    Parameters
    ----------
    ice : as it was given
    freed : parameters that are fitted
    values : they have now, in prior standard deviations from where they started (p,)
    """

    ice: Ice
    freed: tuple[Freed, ...] = ()
    values: Floats

    def __len__(self) -> int:
        return len(self.freed)

    @cached_property
    def now(self) -> Ice:
        """The ice with the values of the parameters."""
        return self._with(self.values, None)

    def nudged(self, k: int) -> Ice:
        """The ice with the k-th parameter moved by `SMALL` prior standard deviations."""
        step = np.zeros(len(self))
        step[k] = SMALL
        return self._with(self.values + step, None)

    def at(self, values: Floats) -> FreeEffects:
        """With other values, kept within their bounds."""
        within = [
            (np.clip(f.start + v * f.spread, f.low, f.high) - f.start) / f.spread
            for f, v in zip(self.freed, values, strict=True)
        ]
        return replace(self, values=np.array(within, dtype=np.float64))

    def fitted(self, sigma: Floats) -> tuple[ActiveEffect, ...]:
        """The effects with the values found.

        Parameters
        ----------
        sigma : (p,) standard errors, in prior standard deviations
        """
        return self._with(self.values, sigma).effects

    def _with(self, values: Floats, sigma: Floats | None) -> Ice:
        effects = list(self.ice.effects)
        for k, f in enumerate(self.freed):
            old = effects[f.effect]
            effects[f.effect] = replace(
                old,
                parameters={**old.parameters, f.name: f.start + float(values[k]) * f.spread},
                sigma=old.sigma
                if sigma is None
                else {**old.sigma, f.name: float(sigma[k]) * f.spread},
            )
        return replace(self.ice, effects=tuple(effects))


def free_effects(ice: Ice, throws: Sequence[Ridden]) -> FreeEffects:
    """Frees what switches an effect of the ice on or off and acts along the travel of some throws.

    Parameters
    ----------
    ice : whose effects are looked at
    throws : on it
    """
    cards = catalogue()
    freed: list[Freed] = []
    for index, effect in enumerate(ice.effects):
        card = cards.get(effect.name)
        for p in card.parameters if card else ():
            if p.neutral is None:
                continue
            given = effect.parameters.get(p.name, p.default if p.default is not None else p.neutral)
            freed.append(
                Freed(effect=index, name=p.name, start=float(given), low=p.low, high=p.high)
            )
    free = FreeEffects(ice=ice, freed=tuple(freed), values=np.zeros(len(freed)))
    along = np.zeros((2, len(freed)))
    for k in range(len(freed)):
        for throw in throws:
            along[:, k] += _work_of(free.now, free.nudged(k), throw)
    felt = (along[0] > along[1]) & (along[0] > 0.0)
    kept = tuple(f for f, acts in zip(freed, felt, strict=True) if acts)
    return FreeEffects(ice=ice, freed=kept, values=np.zeros(len(kept)))


def no_effects(ice: Ice) -> FreeEffects:
    """The effects of an ice as they are: none of their parameters is free."""
    return FreeEffects(ice=ice, values=np.empty(0))


RIVALS = {"speed_dependent_friction": {"exponent": 0.0}, "slope": {"x": 0.0, "y": 0.0}}
"""Effects that bend all throws alike by speed or direction, as a camera that errs does."""


def with_rivals(free: FreeEffects, throws: Sequence[Ridden]) -> FreeEffects:
    """The free effects and, free too, those that could be taken for an error of the camera."""
    given = {effect.name for effect in free.ice.effects}
    added = tuple(
        ActiveEffect(name=name, parameters=dict(parameters))
        for name, parameters in RIVALS.items()
        if name not in given
    )
    own = len(free.ice.effects)
    ice = replace(free.ice, effects=(*free.ice.effects, *added))
    rivals = tuple(f for f in free_effects(ice, throws).freed if f.effect >= own)
    return FreeEffects(
        ice=ice,
        freed=(*free.freed, *rivals),
        values=np.append(free.values, np.zeros(len(rivals))),
    )


def _work_of(ice: Ice, other: Ice, throw: Ridden) -> Floats:
    """Mean squares of the difference of two laws along and across the travel of a throw."""
    passenger = throw.passenger
    rows = slice(None, None, 15)
    speed = np.maximum(np.gradient(throw.measured, throw.t), 0.05)[rows]
    heading = passenger.course.heading_at(throw.measured[rows])
    states = np.column_stack(
        [
            passenger.course.at(throw.measured[rows]),
            speed[:, None] * heading,
            np.full(len(speed), passenger.spin),
        ]
    )
    swept = bool(len(passenger.sweeps))
    one, two = (
        acceleration(
            law, states, clock=passenger.clock, order=passenger.order, stone=passenger.stone,
            swept=swept,
        )[:, :2]
        for law in (ice, other)
    )  # fmt: skip
    apart = two - one
    ahead = (apart * heading).sum(axis=1)
    aside = apart[:, 1] * heading[:, 0] - apart[:, 0] * heading[:, 1]
    return np.array([(ahead**2).mean(), (aside**2).mean()])
