"""Domain randomisation: random ices for training, each known by an estimate of its map.

`RandomIces` has the spreads of their properties. The defaults resemble the sheets of one event:
draw times from hog line to tee within about 0.8 s of each other, heavy and keen areas of a few per
cent, and a map estimated from films.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from curling_env.analysis.ice_uncertainty import smooth_factors
from curling_env.envs.known_ice import effect_numbers, features_of_maps, ice_features
from curling_env.errors import InputError
from curling_env.ice import FrictionMap, Ice, load_ice
from curling_env.physics.batch import IceFamily, IceVariants
from curling_env.sheet import Direction
from curling_env.typing import Floats, Singles

KNOWLEDGE = ("map", "mean", "nothing")
"""Knowledge of an ice: its estimated map, only the mean of that map, or nothing."""


class DrawnIces(NamedTuple):
    """Ices drawn at once, with an estimate of each map.

    Parameters
    ----------
    ices : the ices that are thrown on
    estimated : (n, rows, columns) friction of the estimated maps
    error : standard deviation of their errors, in ln μ
    """

    ices: IceVariants
    estimated: Floats
    error: float

    def estimate(self, k: int) -> Ice:
        """Return the k-th ice with its estimated map."""
        return replace(self.ices.ice(k), friction=_friction(self.estimated[k], self.error))


@dataclass(frozen=True, kw_only=True)
class RandomIces:
    """Variations of a base ice, each with its own friction.

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
        """Draw an ice and its known ice.

        Parameters
        ----------
        rng : source of the randomness
        knows : what the agent knows, one of `KNOWLEDGE`; by default as this distribution says

        Returns
        -------
        the ice that is thrown on, and the ice as the agent knows it
        """
        drawn = self.draw_many([rng])
        return drawn.ices.ice(0), self.as_known(drawn.estimate(0), knows or self.knows)

    def draw_many(self, rngs: Sequence[np.random.Generator]) -> DrawnIces:
        """Draw an ice from each of some generators, all at once."""
        base = self.family.base
        (left, right), (rough, narrow) = self._factors
        areas, errors = (left.shape[1], right.shape[1]), (rough.shape[1], narrow.shape[1])
        count = areas[0] * areas[1]
        numbers = np.empty((len(rngs), 2 + count + errors[0] * errors[1]))
        for rng, row in zip(rngs, numbers, strict=True):
            rng.standard_normal(out=row)
        level, curl, *_ = numbers.T
        # Computed in place: new arrays of this size cost more than the arithmetic.
        mu = left @ (numbers[:, 2 : 2 + count].reshape(-1, *areas) @ right.T)
        mu += self.level * level[:, None, None]
        np.exp(mu, out=mu)
        mu *= base.friction.mu
        estimated = rough @ (numbers[:, 2 + count :].reshape(-1, *errors) @ narrow.T)
        np.exp(estimated, out=estimated)
        estimated *= mu
        ices = IceVariants(self.family, mu, np.exp(self.curl * curl))
        return DrawnIces(ices, estimated, self.error)

    def features(self, drawn: DrawnIces, direction: Direction) -> Singles:
        """Return the features of known ices, (n, m); see `KnownIce.features`."""
        known_mu = drawn.estimated
        if self.knows == "nothing":
            known = ice_features(self.family.base, direction)
            return np.tile(known, (len(known_mu), 1))
        if self.knows == "mean":
            mean = known_mu.mean(axis=(1, 2), keepdims=True)
            known_mu = np.broadcast_to(mean, known_mu.shape)
        base, slope = self._known_effects[direction]
        effects = base + slope * (drawn.ices.factors[:, None] - 1.0)
        return features_of_maps(self.family.base, known_mu, effects, direction)

    @cached_property
    def _known_effects(self) -> dict[Direction, tuple[Floats, Floats]]:
        """Return numbers of the effects on the base, and their slope with the strength of the
        curl.
        """
        found: dict[Direction, tuple[Floats, Floats]] = {}
        for end in Direction:
            base, half = (effect_numbers(self.family.at(factor), end) for factor in (1.0, 0.5))
            found[end] = base, 2.0 * (base - half)
        return found

    @cached_property
    def family(self) -> IceFamily:
        """Common part of the ices: everything except the map and the strength of the curl."""
        return IceFamily(load_ice(self.base), "curl")

    @cached_property
    def _factors(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """The factors of the areas and of the map's errors, times their standard deviations."""
        sheet = self.family.base.sheet
        places, round_ = (sheet.y_centres, sheet.x_centres), self.error_length
        areas, errors = (
            smooth_factors(*places, *lengths)
            for lengths in ((self.length, self.breadth), (round_, round_))
        )
        return (self.areas * areas[0], areas[1]), (self.error * errors[0], errors[1])

    def as_known(self, estimate: Ice, knows: str) -> Ice:
        """Return the known ice of an agent with one of `KNOWLEDGE`."""
        if knows == "nothing":
            return self.family.base
        if knows == "map":
            return estimate
        mean = np.full_like(estimate.friction.mu, estimate.friction.mu.mean())
        return replace(estimate, friction=_friction(mean, self.error))


def _check_knowledge(knows: str) -> None:
    if knows not in KNOWLEDGE:
        raise InputError(f"knows must be one of {', '.join(KNOWLEDGE)}, got {str(knows)[:40]!r}")


def _friction(mu: Floats, error: float) -> FrictionMap:
    return FrictionMap(mu=mu, sigma=error * mu, observed=np.ones(mu.shape, dtype=np.bool_))
