"""What to expect of a throw: the hand is not exact, and neither is the map.

A throw is repeated with execution errors, on ices drawn from the map's own standard errors. A
stone that touches another, or leaves play, counts as ending there: hitting a guard six metres
short of the target is a miss of six metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agents.planning.rollouts import Rollouts, roll_out
from agents.planning.search import direction_to
from curling_env.ice import FrictionMap, Ice
from curling_env.physics.slide import SlideEnd, play_bounds
from curling_env.sheet import Direction
from curling_env.skill import Skill

Floats = NDArray[np.float64]

MAP_ERROR_LENGTH = 2.0
"""Distance over which errors of a map are taken to be alike [m].

An ice file holds a σ per cell and no correlation. One pass of a stone tells friction over two to
three metres apart, not over less, so errors of an estimated map run together over such a length.
"""
LEAST_SHARE = 0.2
"""A drawn friction is at least this part of the map's own: a Gaussian's tail is no ice."""


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Where a throw ended when it was tried many times.

    Parameters
    ----------
    ends : (n, 2) sheet frame [m]
    miss : (n,) distance of each from the target [m]
    why : (n,) `SlideEnd` of each
    """

    ends: Floats
    miss: Floats
    why: NDArray[np.int64]

    @property
    def expected_miss(self) -> float:
        """Mean distance from the target [m]."""
        return float(self.miss.mean())

    def chance(self, end: SlideEnd) -> float:
        """Share of the throws that ended so."""
        return float((self.why == end).mean())

    @property
    def covariance(self) -> Floats:
        """Of the ends of those that came to rest by themselves, (2, 2) [m²]."""
        rested = self.ends[self.why == SlideEnd.REST]
        return np.cov(rested.T) if len(rested) > 1 else np.zeros((2, 2))


def possible_ices(ice: Ice, n: int, rng: np.random.Generator) -> list[Ice]:
    """Ices that the map's standard errors allow; the ice itself, once, where they are all zero.

    Errors are Gaussian with the map's σ in every cell and a correlation exp(-(d/ℓ)²/2),
    ℓ = `MAP_ERROR_LENGTH`. They come in opposite pairs.
    """
    sigma = ice.friction.sigma
    if not sigma.any():
        return [ice]
    along = _square_root_of_correlation(ice.sheet.y_centres)
    across = _square_root_of_correlation(ice.sheet.x_centres)
    ices: list[Ice] = []
    for _ in range(-(-n // 2)):
        error = sigma * (along @ rng.standard_normal(sigma.shape) @ across.T)
        for sign in (1.0, -1.0):
            mu = np.maximum(ice.friction.mu + sign * error, LEAST_SHARE * ice.friction.mu)
            friction = FrictionMap(
                mu=np.minimum(mu, 1.0),
                sigma=sigma,
                observed=ice.friction.observed,
                interpolation=ice.friction.interpolation,
            )
            ices.append(replace(ice, friction=friction))
    return ices[:n]


def _square_root_of_correlation(places: Floats) -> Floats:
    distance = places[:, None] - places[None, :]
    correlation = np.exp(-0.5 * (distance / MAP_ERROR_LENGTH) ** 2)
    values, vectors = np.linalg.eigh(correlation)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def spreads(
    ices: list[Ice],
    throws: Floats,
    target: Floats,
    skill: Skill,
    stones: Floats,
    *,
    n: int,
    seed: int,
) -> list[Spread]:
    """Try each throw n times, with the same errors for all of them.

    Parameters
    ----------
    ices : that are possible; each gets its part of the trials
    throws : (m, 4) meant throws, see `rollouts.states_of`
    target : (2,) sheet frame [m]
    skill : of the player
    stones : (k, 2) resting stones, sheet frame [m]
    n : trials of each throw; without any error there is one
    seed : of the errors
    """
    if skill.is_exact:
        n = len(ices)
    each = max(-(-n // len(ices)), 1)
    direction = direction_to(target)
    parts: list[Rollouts] = []
    for k, ice in enumerate(ices):
        errors = np.zeros((each, 4))
        errors[:, :3] = skill.errors(each, np.random.default_rng((seed, k)))
        trials = (throws[:, None, :] + errors[None, :, :]).reshape(-1, 4)
        trials[:, 0] = np.clip(trials[:, 0], 1e-3, None)
        parts.append(end_in_play(ice, trials, direction, stones))
    m = len(throws)
    ends = np.concatenate([part.xy.reshape(m, each, 2) for part in parts], axis=1)
    why = np.concatenate([part.end.reshape(m, each) for part in parts], axis=1)
    miss = np.hypot(*np.moveaxis(ends - target, 2, 0))
    return [Spread(ends=ends[i], miss=miss[i], why=why[i]) for i in range(m)]


def end_in_play(ice: Ice, throws: Floats, direction: Direction, stones: Floats) -> Rollouts:
    """Throws (n, 4) that end where they leave play or touch a resting stone."""
    return roll_out(
        ice,
        throws,
        direction,
        bounds=play_bounds(ice, direction),
        stones=stones,
        reach=2 * ice.stone.radius,
    )
