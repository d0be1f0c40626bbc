"""Ices to learn on: no two alike, and each known only by an estimate of its map.

What differs from ice to ice, and by how much, is a choice that a configuration states. As they
stand, the numbers are those of sheets at one event: draw times from hog line to tee within about
0.8 s of each other, heavy and keen areas of a few per cent, and a map estimated from films.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice
from curling_env.typing import Floats

KNOWN = ("map", "mean", "nothing")
"""What an agent may be told of an ice: its estimated map, the map's mean alone, or neither."""


@dataclass(frozen=True, kw_only=True)
class RandomIces:
    """Ices like a base ice, each with friction of its own.

    Parameters
    ----------
    base : an ice file or a preset
    level : spread of the mean friction from ice to ice, of ln μ; 0.06 is 0.75 s of draw time
    areas : spread of heavy and keen areas about the mean, of ln μ
    length, breadth : over which areas are alike, along and across the sheet [m]
    curl : spread of the strength of curl, of its logarithm
    error : spread of the errors of the estimated map, of ln μ
    error_length : over which these are alike, both ways [m]

    Raises
    ------
    InputError : a spread that is negative, or a length that is not positive
    """

    base: str = "standard"
    level: float = 0.06
    areas: float = 0.04
    length: float = 3.0
    breadth: float = 1.0
    curl: float = 0.1
    error: float = 0.015
    error_length: float = 2.0

    def __post_init__(self) -> None:
        for name in ("level", "areas", "curl", "error"):
            value = getattr(self, name)
            if isinstance(value, str) or not 0 <= value < 1:
                raise InputError(f"{name} must lie within 0 and 1, got {value!r}")
        for name in ("length", "breadth", "error_length"):
            value = getattr(self, name)
            if isinstance(value, str) or not value > 0:
                raise InputError(f"{name} must be positive, got {value!r}")

    def draw(self, rng: np.random.Generator, knows: str = "map") -> tuple[Ice, Ice]:
        """An ice, and what is known of it.

        Parameters
        ----------
        knows : one of `KNOWN`

        Returns
        -------
        the ice thrown on, and the one that the agent is told of
        """
        base = load_ice(self.base)
        rows, columns = base.sheet.y_centres, base.sheet.x_centres
        level = self.level * rng.standard_normal()
        areas = self.areas * _smooth(rng, rows, columns, self.length, self.breadth)
        curl = np.exp(self.curl * rng.standard_normal())
        error = self.error * _smooth(rng, rows, columns, self.error_length, self.error_length)
        effects = tuple(
            _scaled(effect, "strength", curl) if effect.name == "curl" else effect
            for effect in base.effects
        )
        mu = base.friction.mu * np.exp(level + areas)
        ice = replace(base, effects=effects, friction=_friction(mu, 0.0))
        estimate = replace(ice, friction=_friction(mu * np.exp(error), self.error))
        return ice, self.told(estimate, knows)

    def told(self, estimate: Ice, knows: str) -> Ice:
        """What is left of an estimated ice for an agent that knows one of `KNOWN`."""
        if knows == "nothing":
            return load_ice(self.base)
        if knows == "map":
            return estimate
        mean = np.full_like(estimate.friction.mu, estimate.friction.mu.mean())
        return replace(estimate, friction=_friction(mean, self.error))


def _friction(mu: Floats, error: float) -> FrictionMap:
    return FrictionMap(mu=mu, sigma=error * mu, observed=np.ones(mu.shape, dtype=np.bool_))


def _scaled(effect: ActiveEffect, parameter: str, factor: float) -> ActiveEffect:
    value = effect.parameters[parameter] * factor
    return replace(effect, parameters={**effect.parameters, parameter: value})


def _smooth(
    rng: np.random.Generator, rows: Floats, columns: Floats, along: float, across: float
) -> Floats:
    """A Gaussian field of spread 1 whose correlation falls as exp(-d²/2) in these lengths."""
    left, right = _root(tuple(rows), along), _root(tuple(columns), across)
    return left @ rng.standard_normal((left.shape[1], right.shape[1])) @ right.T


@lru_cache(maxsize=16)
def _root(places: tuple[float, ...], length: float) -> Floats:
    """A matrix whose product with its transpose is the correlation of places."""
    apart = np.subtract.outer(places, places) / length
    values, vectors = np.linalg.eigh(np.exp(-0.5 * apart**2))
    kept = values > 1e-6 * values[-1]
    return vectors[:, kept] * np.sqrt(values[kept])
