"""Meaning of an ice's standard errors: sampled ices, and the spread of places of rest on them.

An ice file has σ of the friction in every cell and of the parameters of effects. It may also state
common errors of parameters and of the level of the friction; otherwise errors are independent.
Errors of neighbouring cells beyond the level's are assumed to be correlated over
`MAP_ERROR_LENGTH`. Effects of the measurement are unchanged, because they do not act on a stone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from statistics import NormalDist

import numpy as np

from curling_env.analysis.tuning import (
    DRAWN_FRICTION,
    MAP_ERROR_LENGTH,
    MIN_RESTED_SHARE,
    REST_ICES,
)
from curling_env.errors import InputError
from curling_env.ice import MAX_FRICTION, ActiveEffect, FrictionMap, Ice
from curling_env.physics.batch import release_table, throw_batch
from curling_env.physics.effects import EffectCard, catalogue
from curling_env.physics.slides import SlideEnd
from curling_env.throw import Release
from curling_env.typing import Floats

_NORMAL = NormalDist()
_MIN_PROBABILITY = 1e-12
"""Distance from 0 and 1 below which probabilities are not drawn, to keep the Gaussian's quantiles
finite.
"""


def is_uncertain(ice: Ice) -> bool:
    """Return whether an ice has standard errors that matter to a stone."""
    return bool(ice.friction.sigma.any()) or bool(_uncertain_parameters(ice))


def plausible_ices(
    ice: Ice, n: int, rng: np.random.Generator, *, effects: bool = True
) -> list[Ice]:
    """Sample n ices within the standard errors of an ice; return only the ice itself if all are
    zero.

    Errors come in pairs of opposite sign. Those of the map are Gaussian with its σ in every cell:
    that of its level is the same factor everywhere, and the rest has the correlation
    exp(-(d/ℓ)²/2), ℓ = `MAP_ERROR_LENGTH`. Those of a parameter are Gaussian within the bounds of
    its effect's card, and spread evenly over the quantiles. Parameters and level are correlated as
    stated in the ice.

    Parameters
    ----------
    effects : draw the parameters of effects too, or only the map as if they were known

    Raises
    ------
    InputError : an effect that is not in the catalogue, or parameters its card does not allow
    """
    uncertain = _uncertain_parameters(ice) if effects else []
    if not ice.friction.sigma.any() and not uncertain:
        return [ice]
    shared = _common_errors(ice, -(-n // 2), rng, drawn=effects)
    maps = _drawn_maps(ice, shared, rng)[:n]
    drawn = _drawn_effects(ice, uncertain, shared, rng)[:n]
    return [replace(ice, friction=f, effects=those) for f, those in zip(maps, drawn, strict=True)]


def rest_spread(ice: Ice, release: Release, *, seed: int = 0) -> tuple[float, float] | None:
    """Return standard deviations of a lone stone's place of rest, across and along the sheet [m].

    They follow from those of the ice. None for ice without standard errors, and for a stone that
    may not come to rest on the ice.
    """
    ices = plausible_ices(ice, REST_ICES, np.random.default_rng(seed))
    if len(ices) == 1:
        return None
    table = release_table([release])
    rests = throw_batch(ices, np.repeat(table, len(ices)), which=np.arange(len(ices)))
    rested = rests.end == SlideEnd.REST
    if rested.mean() < MIN_RESTED_SHARE:
        return None
    return float(rests.x[rested].std()), float(rests.y[rested].std())


def smooth_field(
    rng: np.random.Generator, rows: Floats, columns: Floats, along: float, across: float
) -> Floats:
    """Draw a Gaussian field of variance 1, (rows, columns), with the correlation exp(-d²/2).

    Parameters
    ----------
    rows, columns : places of the rows and columns of a table [m]
    along, across : correlation lengths from row to row and from column to column [m]
    """
    left, right = smooth_factors(rows, columns, along, across)
    return left @ rng.standard_normal((left.shape[1], right.shape[1])) @ right.T


def smooth_factors(
    rows: Floats, columns: Floats, along: float, across: float
) -> tuple[Floats, Floats]:
    """Return matrices L and R such that L·Z·Rᵀ is a `smooth_field` of standard normal numbers Z."""
    return _correlation_root(tuple(rows), along), _correlation_root(tuple(columns), across)


@lru_cache(maxsize=16)
def _correlation_root(places: tuple[float, ...], length: float) -> Floats:
    """Return a matrix that, times its transpose, is the correlation of places.

    Its columns begin with positive numbers: the signs of eigenvectors otherwise depend on the
    LAPACK in use, and the same seed would give different fields.
    """
    apart = np.subtract.outer(places, places) / length
    values, vectors = np.linalg.eigh(np.exp(-0.5 * apart**2))
    kept = values > 1e-6 * values[-1]
    return vectors[:, kept] * np.copysign(np.sqrt(values[kept]), vectors[0, kept])


# --- what errors have in common ------------------------------------------------------------------


def _common_errors(ice: Ice, pairs: int, rng: np.random.Generator, *, drawn: bool) -> Floats:
    """Return the common errors of the first of each pair, (pairs, e), spread evenly over the
    quantiles.

    They are zero if no effect is drawn: the part of the level that is common with known effects is
    then known too.
    """
    level = ice.friction.level
    counts = [len(parts) for effect in ice.effects for parts in effect.common.values()]
    count = max([*counts, 0 if level is None else len(level.common)])
    shared = np.zeros((pairs, count))
    for k in range(count if drawn else 0):
        shared[:, k] = _even_normals(pairs, rng)
    return shared


def _even_normals(pairs: int, rng: np.random.Generator) -> Floats:
    """Return standard normal numbers, (pairs,): evenly spread over the quantiles with their
    opposites.
    """
    upper = 0.5 + 0.5 * (rng.permutation(pairs) + rng.random(pairs)) / pairs
    first = np.where(rng.random(pairs) < 0.5, upper, 1.0 - upper)
    return np.array([_quantile(share) for share in first.tolist()])


def _quantile(share: float) -> float:
    return _NORMAL.inv_cdf(min(max(share, _MIN_PROBABILITY), 1.0 - _MIN_PROBABILITY))


def _together(parts: Sequence[float], shared: Floats, own: Floats) -> Floats:
    """Combine common and independent errors, in standard deviations."""
    known = np.asarray(parts)
    rest = float(np.sqrt(max(1.0 - known @ known, 0.0)))
    return shared[:, : len(known)] @ known + rest * own


# --- the map -------------------------------------------------------------------------------------


def _drawn_maps(ice: Ice, shared: Floats, rng: np.random.Generator) -> list[FrictionMap]:
    """Draw two maps for each pair."""
    friction, level, pairs = ice.friction, ice.friction.level, len(shared)
    if not friction.sigma.any():
        return [friction] * (2 * pairs)
    rows, columns = ice.sheet.y_centres, ice.sheet.x_centres
    # No cell is more certain than its σ, whatever the error of the level.
    common = np.minimum(0.0 if level is None else level.sigma * friction.mu, friction.sigma)
    rest = np.sqrt(friction.sigma**2 - common**2)
    levels = np.zeros(pairs)
    if level is not None:
        levels = _together(level.common, shared, _even_normals(pairs, rng))
    low, high = (share * friction.mu for share in DRAWN_FRICTION)
    maps: list[FrictionMap] = []
    for whole in levels.tolist():
        field = smooth_field(rng, rows, columns, MAP_ERROR_LENGTH, MAP_ERROR_LENGTH)
        for sign in (1.0, -1.0):
            mu = np.clip(friction.mu + sign * (common * whole + rest * field), low, high)
            maps.append(replace(friction, mu=np.minimum(mu, MAX_FRICTION)))
    return maps


# --- the effects ---------------------------------------------------------------------------------


def _uncertain_parameters(ice: Ice) -> list[tuple[int, str]]:
    """Return the index of an effect of the ice and the name of a parameter, for each with a σ."""
    return [
        (k, name)
        for k, effect in enumerate(ice.effects)
        if any(effect.sigma.values()) and _card_of(effect).is_physical
        for name, sigma in effect.sigma.items()
        if sigma > 0.0
    ]


def _card_of(effect: ActiveEffect) -> EffectCard:
    """Return the card of an effect, which must allow its parameters."""
    card = catalogue().get(effect.name)
    if card is None:
        raise InputError(
            f"unknown effect {effect.name!r}; expected one of {', '.join(catalogue())}"
        )
    card.theta(effect.parameters)
    unknown = sorted(effect.sigma.keys() - {parameter.name for parameter in card.parameters})
    if unknown:
        raise InputError(
            f"effect {effect.name} has a sigma of {unknown[0]!r}, which is not one of its "
            "parameters"
        )
    return card


def _drawn_effects(
    ice: Ice, uncertain: list[tuple[int, str]], shared: Floats, rng: np.random.Generator
) -> list[tuple[ActiveEffect, ...]]:
    """Draw two sets of effects for each pair."""
    drawn = [
        {k: dict(ice.effects[k].parameters) for k, _ in uncertain} for _ in range(2 * len(shared))
    ]
    for k, name in uncertain:
        effect = ice.effects[k]
        errors = _together(effect.common.get(name, ()), shared, _even_normals(len(shared), rng))
        for those, value in zip(drawn, _draws(effect, name, errors), strict=True):
            those[k][name] = value
    return [
        tuple(
            replace(effect, parameters=_in_order(effect, those[k])) if k in those else effect
            for k, effect in enumerate(ice.effects)
        )
        for those in drawn
    ]


def _draws(effect: ActiveEffect, name: str, errors: Floats) -> list[float]:
    """Return two values of a parameter for each error in standard deviations, from opposite
    quantiles.
    """
    parameter = _card_of(effect).parameter(name)
    value, sigma = effect.parameters.get(name, parameter.default), effect.sigma[name]
    assert value is not None  # the card allows the parameters
    low, high = (_NORMAL.cdf((b - value) / sigma) for b in (parameter.low, parameter.high))
    shares = [_NORMAL.cdf(error) for error in errors.tolist()]
    quantiles = [quantile for share in shares for quantile in (share, 1.0 - share)]
    drawn = [value + sigma * _quantile(low + quantile * (high - low)) for quantile in quantiles]
    return [min(max(value, parameter.low), parameter.high) for value in drawn]


def _in_order(effect: ActiveEffect, parameters: dict[str, float]) -> dict[str, float]:
    """Return the parameters, with the sides of an area in order."""
    area = _card_of(effect).search.area or ()
    for low, high in zip(area[::2], area[1::2], strict=True):
        parameters[low], parameters[high] = sorted((parameters[low], parameters[high]))
    return parameters
