"""What to expect of a throw: the hand is not exact, and neither is the map.

A throw is repeated with execution errors, on ices drawn from the map's own standard errors, and
every trial is judged by what was wanted. All trials of all throws go through the batch engine.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.planning.objective import Wanted
from agents.planning.rollouts import SPEED, SPIN, Rollouts, roll_out
from curling_env.ice import FrictionMap, Ice
from curling_env.physics.one_stone.slide import SlideEnd, play_bounds
from curling_env.sheet import Direction
from curling_env.throw import MAX_SPEED, MAX_SPIN, Skill
from curling_env.typing import Floats

MAP_ERROR_LENGTH = 2.0
"""Distance over which errors of a map are taken to be alike [m].

An ice file holds a σ per cell and no correlation. One pass of a stone tells friction over two to
three metres apart, not over less, so errors of an estimated map run together over such a length.
"""
LEAST_SHARE = 0.2
"""A drawn friction is at least this part of the map's own: a Gaussian's tail is no ice."""


@dataclass(frozen=True, kw_only=True)
class Spread:
    """What came of a throw when it was tried many times.

    Parameters
    ----------
    ends : (n, 2) where the thrown stone ended, sheet frame [m]
    miss : (n,) distance of each from the target [m]
    why : (n,) `SlideEnd` of each
    in_play : (n,) whether it stayed in play
    worth, success : (n,) as judged by what was wanted
    stones : (n, k, 2) where the other stones then lie, NaN where one left play [m]
    errors : (n, 3) of the hand: speed [m/s], angle [rad], spin [rad/s]
    """

    ends: Floats
    miss: Floats
    why: NDArray[np.int64]
    in_play: NDArray[np.bool_]
    worth: Floats
    success: NDArray[np.bool_]
    stones: Floats
    errors: Floats

    @property
    def expected_miss(self) -> float:
        """Mean distance from the target [m]."""
        return float(self.miss.mean())

    @property
    def expected_worth(self) -> float:
        """Mean of what it is worth."""
        return float(self.worth.mean())

    def chance(self, end: SlideEnd) -> float:
        """Share of the throws that ended so."""
        return float((self.why == end).mean())

    @property
    def covariance(self) -> Floats:
        """Of the ends of those that stayed in play, (2, 2) [m²]."""
        rested = self.ends[self.in_play]
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
    ices: list[Ice], throws: Floats, wanted: Wanted, skill: Skill, *, n: int, seed: int
) -> list[Spread]:
    """Try each throw n times, with the same errors for all of them.

    Parameters
    ----------
    ices : that are possible; each gets its part of the trials
    throws : (m, 4) or (m, 6) meant throws, see `rollouts.releases_of`
    wanted : of them; it knows the stones that lie there
    skill : of the player
    n : trials of each throw; without any error there is one on each ice
    seed : of the errors
    """
    each = 1 if skill.is_exact else max(-(-n // len(ices)), 1)
    m, columns = throws.shape
    radius = ices[0].stone.radius
    errors = [skill.errors(each, np.random.default_rng((seed, k))) for k in range(len(ices))]
    parts: list[Rollouts] = []
    for ice, error in zip(ices, errors, strict=True):
        trials = np.repeat(throws[:, None, :], each, axis=1)
        trials[:, :, : SPIN + 1] += error
        trials[:, :, SPEED] = np.clip(trials[:, :, SPEED], 1e-3, MAX_SPEED)
        trials[:, :, SPIN] = np.clip(trials[:, :, SPIN], -MAX_SPIN, MAX_SPIN)
        ended = end_in_play(ice, trials.reshape(-1, columns), wanted.direction, wanted.stones)
        parts.append(ended)
    together = Rollouts(**{name: _joined(parts, name, m) for name in ROLLOUT_FIELDS})
    judged = wanted.judge(together, radius)
    count = each * len(ices)
    rows = [slice(i * count, (i + 1) * count) for i in range(m)]
    return [
        Spread(
            ends=together.xy[row],
            miss=judged.miss[row],
            why=together.end[row],
            in_play=together.in_play[row],
            worth=judged.worth[row],
            success=judged.success[row],
            stones=together.stones[row],
            errors=np.concatenate(errors),
        )
        for row in rows
    ]


ROLLOUT_FIELDS = tuple(field.name for field in fields(Rollouts))


def _joined(parts: list[Rollouts], name: str, throws: int) -> NDArray[Any]:
    """A field of rollouts made ice by ice, throw by throw."""
    tables = [getattr(part, name) for part in parts]
    by_throw = [table.reshape(throws, len(table) // throws, *table.shape[1:]) for table in tables]
    whole = np.concatenate(by_throw, axis=1)
    return whole.reshape(throws * whole.shape[1], *whole.shape[2:])


def end_in_play(ice: Ice, throws: Floats, direction: Direction, stones: Floats) -> Rollouts:
    """Throws among resting stones that end where they leave play."""
    bounds = play_bounds(ice, direction)
    return roll_out(ice, throws, direction, bounds=bounds, stones=stones)
