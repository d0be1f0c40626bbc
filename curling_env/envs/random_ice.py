"""Domain randomisation: random ices to learn on, each known only by an estimate of its map.

`RandomIces` says what differs from ice to ice, and by how much. The defaults are like the sheets
of one event: draw times from hog line to tee within about 0.8 s of each other, heavy and keen areas
of a few per cent, and a map estimated from films.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from curling_env.analysis.ice_uncertainty import smooth_field
from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice
from curling_env.typing import Floats

KNOWLEDGE = ("map", "mean", "nothing")
"""What an agent may know of an ice: its estimated map, only the mean of that map, or nothing."""


@dataclass(frozen=True, kw_only=True)
class RandomIces:
    """Ices like a base ice, each with friction of its own.

    Parameters
    ----------
    base : ice file or preset
    level : standard deviation of the mean of ln μ from ice to ice; 0.06 is 0.75 s of draw time
    areas : standard deviation of ln μ within an ice: heavy and keen areas
    length, breadth : correlation lengths of the areas along and across the sheet [m]
    curl : standard deviation of the logarithm of the strength of curl
    error : standard deviation of the error of the estimated map, in ln μ
    error_length : correlation length of that error [m]
    knows : what the agent knows of each ice, one of `KNOWLEDGE`
    pool : number of ices that are drawn once, of which episodes then take one each; 0 for another
        ice in every episode. Many sheets on few ices are simulated together, and so faster
    pool_seed : seed of these ices

    Raises
    ------
    InputError : a standard deviation is negative or 1 or more, a length is not positive, or an
        unknown kind of knowledge
    """

    base: str = "standard"
    level: float = 0.06
    areas: float = 0.04
    length: float = 3.0
    breadth: float = 1.0
    curl: float = 0.1
    error: float = 0.015
    error_length: float = 2.0
    knows: str = "map"
    pool: int = 0
    pool_seed: int = 0

    def __post_init__(self) -> None:
        for name in ("level", "areas", "curl", "error"):
            value = getattr(self, name)
            if not isinstance(value, int | float) or not 0 <= value < 1:
                raise InputError(f"{name} must lie within 0 and 1, got {str(value)[:40]!r}")
        for name in ("length", "breadth", "error_length"):
            value = getattr(self, name)
            if not isinstance(value, int | float) or not 1e-3 <= value <= 1e4:
                raise InputError(
                    f"{name} must be positive, within 0.001 and 10000 m, got {str(value)[:40]!r}"
                )
        if not isinstance(self.base, str):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError(f"base must name an ice, got {str(self.base)[:40]!r}")
        _check_knowledge(self.knows)
        for name in ("pool", "pool_seed"):
            value: Any = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < 0:
                raise InputError(f"{name} must be a whole number of at least 0, got {value!r}")

    def draw(self, rng: np.random.Generator, knows: str | None = None) -> tuple[Ice, Ice]:
        """Draw an ice and what is known of it.

        Parameters
        ----------
        rng : source of the randomness
        knows : what the agent knows, one of `KNOWLEDGE`; by default as this distribution says

        Returns
        -------
        the ice that is thrown on, and the ice as the agent knows it
        """
        base = load_ice(self.base)
        rows, columns = base.sheet.y_centres, base.sheet.x_centres
        level = self.level * rng.standard_normal()
        areas = self.areas * smooth_field(rng, rows, columns, self.length, self.breadth)
        curl = np.exp(self.curl * rng.standard_normal())
        error = self.error * smooth_field(rng, rows, columns, self.error_length, self.error_length)
        effects = tuple(
            _scaled(effect, "strength", curl) if effect.name == "curl" else effect
            for effect in base.effects
        )
        mu = base.friction.mu * np.exp(level + areas)
        ice = replace(base, effects=effects, friction=_friction(mu, 0.0))
        estimate = replace(ice, friction=_friction(mu * np.exp(error), self.error))
        return ice, self.as_known(estimate, knows or self.knows)

    def as_known(self, estimate: Ice, knows: str) -> Ice:
        """An estimated ice as it is for an agent that knows one of `KNOWLEDGE`."""
        if knows == "nothing":
            return load_ice(self.base)
        if knows == "map":
            return estimate
        mean = np.full_like(estimate.friction.mu, estimate.friction.mu.mean())
        return replace(estimate, friction=_friction(mean, self.error))


def _check_knowledge(knows: str) -> None:
    if knows not in KNOWLEDGE:
        raise InputError(f"knows must be one of {', '.join(KNOWLEDGE)}, got {str(knows)[:40]!r}")


def _friction(mu: Floats, error: float) -> FrictionMap:
    return FrictionMap(mu=mu, sigma=error * mu, observed=np.ones(mu.shape, dtype=np.bool_))


def _scaled(effect: ActiveEffect, parameter: str, factor: float) -> ActiveEffect:
    value = effect.parameters[parameter] * factor
    return replace(effect, parameters={**effect.parameters, parameter: value})
