"""The quadratic around a point of a fit: its priors, its minimum within bounds, and its variances.

Parameters of single throws are eliminated before, see `linearisation`. The spread of the throws'
frictions and the amplitudes of Gaussian fields are profiled.
"""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.model.minimum import minimum_of, projected
from friction_estimation.discovery.model.model import GLOBALS, Model
from friction_estimation.discovery.tuning import COUPLING_SIGMA, SPREADS


def prior_gram(model: Model, size: int, *, fields: bool = True) -> Floats:
    """Gram matrix of the priors on the shared parameters, (size, size).

    Parameters
    ----------
    model : model
    size : number of shared parameters, and one for the residual
    fields : whether the friction map is among them
    """
    gram = np.zeros((size, size))
    at = GLOBALS.index("ln_coupling")
    gram[at, at] = COUPLING_SIGMA**-2
    gram[at, -1] = gram[-1, at] = -model.ln_coupling / COUPLING_SIGMA**2
    gram[-1, -1] = (model.ln_coupling / COUPLING_SIGMA) ** 2
    for place, field in model.fields:
        if field is model.map_field and not fields:
            continue
        places = np.arange(size)[place]
        precision = field.deviations**-2
        gram[places, places] += precision
        gram[places, -1] = gram[-1, places] = -field.values * precision
        gram[-1, -1] += float(field.values**2 @ precision)
    for at, value, belief in model.beliefs:
        off = (belief.mean - value) / belief.sd
        gram[at, at] += belief.sd**-2
        gram[at, -1] += off / belief.sd
        gram[-1, at] += off / belief.sd
        gram[-1, -1] += off**2
    return gram


def integration_cost(model: Model, total: Floats) -> float:
    """Return the term that integrating over the coefficients of Gaussian fields adds to F.

    It is ln |1 + information of the coefficients|, and the prior of the fields' amplitudes.

    Parameters
    ----------
    model : model with or without fields
    total : Gram matrix of all throws, without priors
    """
    fields = model.fields
    if not fields:
        return 0.0
    sizes = np.concatenate([field.deviations for _, field in fields])
    places = np.concatenate([np.arange(len(total))[place] for place, _ in fields])
    information = total[np.ix_(places, places)] * sizes[:, None] * sizes
    cost = float(np.linalg.slogdet(np.eye(len(sizes)) + information)[1])
    return cost + sum(field.hyperprior for _, field in fields)


def profile_amplitudes(model: Model, total: Floats) -> tuple[Model, float]:
    """Return the model with the amplitudes of its fields that minimise F, and that part of F.

    Parameters
    ----------
    model : model with Gaussian fields
    total : Gram matrix of all throws, without priors, of the shared parameters and the residual
    """
    best, least = model, np.inf
    for _ in range(len(model.fields)):
        for which, (_, field) in enumerate(model.fields):
            mapped = field is best.map_field
            for amplitude in [_map_amplitude(best, total)] if mapped else field.amplitudes:
                other = best.with_amplitude(which, float(amplitude))
                whole = total + prior_gram(other, len(total))
                value = float(minimum_of(whole).value) + integration_cost(other, total)
                if value < least:
                    best, least = other, value
    return best, least


def _map_amplitude(model: Model, total: Floats) -> float:
    """Return the amplitude of the friction map that minimises F.

    All coefficients of the map have the same prior. Once everything else is projected out, F is a
    sum over the eigenvectors of their information, whatever the amplitude.
    """
    field, size = model.map_field, len(total)
    assert field is not None
    own = np.arange(size)[model.map_slice]
    whole = total + prior_gram(model, size, fields=False)
    alone = projected(whole, own)
    values, vectors = np.linalg.eigh(alone[:-1, :-1])
    # As a function of the coefficients themselves, not of a step from the present ones.
    shown = (vectors.T @ (alone[:-1, -1] + alone[:-1, :-1] @ field.values)) ** 2
    others = [np.arange(size)[place] for place, other in model.fields if other is not field]
    beside = np.concatenate([own[:0], *others])
    integrated = np.linalg.eigvalsh(projected(whole, own, beside)[:-1, :-1])

    def cost(amplitude: float) -> float:
        explained = float((shown / (np.maximum(values, 0.0) + amplitude**-2)).sum())
        spread_out = float(np.log1p(amplitude**2 * np.maximum(integrated, 0.0)).sum())
        return spread_out - explained + field.with_amplitude(amplitude).hyperprior

    return min(field.amplitudes.tolist(), key=cost)


def bounded_step(total: Floats, step: Floats, model: Model) -> Floats:
    """Return the step within the parameters' bounds: parameters at a bound stop there, and the
    others adapt.

    Parameters
    ----------
    total : (P + 1, P + 1) Gram matrix of the shared parameters and the residual, priors included
    step : (P,) step that takes no notice of bounds
    model : model that has the bounds
    """
    vector = model.vector
    low, high = (bound - vector for bound in model.bounds)
    stopped = np.zeros(len(step), dtype=bool)
    for _ in range(len(step)):
        outside = ((step < low) | (step > high)) & ~stopped
        if not outside.any():
            break
        stopped |= outside
        step = np.clip(step, low, high)
        free = ~stopped
        right = total[:-1, -1] - total[:-1, :-1] @ np.where(stopped, step, 0.0)
        kept = np.append(free, True)
        part = total[np.ix_(kept, kept)].copy()
        part[:-1, -1] = part[-1, :-1] = right[free]
        step[free] = minimum_of(part).step if free.any() else 0.0
    return np.clip(step, low, high)


def profile_spread(reduced: Floats, ln_factors: Floats, prior: Floats) -> tuple[float, float]:
    """Return the spread that minimises F of the linearised model, and F there.

    With the shared parameters at their best, F is a quadratic of the ln factors of the throws. On
    its axes a spread costs a division.

    Parameters
    ----------
    reduced, ln_factors : as of `eliminate_factor`
    prior : Gram matrix of the priors
    """
    throws, size = len(reduced), len(prior)
    information = reduced[:, 0, 0]
    whole = np.zeros((throws + size, throws + size))
    whole[range(throws), range(throws)] = information
    whole[:throws, throws:] = reduced[:, 0, 1:]
    whole[throws:, :throws] = reduced[:, 0, 1:].T
    whole[throws:, throws:] = reduced[:, 1:, 1:].sum(axis=0) + prior
    own = projected(whole, np.arange(throws))
    inner, slope = 0.5 * (own + own.T)[:-1, :-1], own[:-1, -1]
    values, axes = np.linalg.eigh(inner)
    right = axes.T @ (slope + inner @ ln_factors)
    least = own[-1, -1] + ln_factors @ (2.0 * slope + inner @ ln_factors)

    def deviances(spreads: Floats) -> Floats:
        variance = spreads[:, None] ** 2
        shrunk = right**2 * variance / (1.0 + np.maximum(values, 0.0) * variance)
        return least - shrunk.sum(axis=1) + np.log1p(variance * information).sum(axis=1)

    best = SPREADS[int(np.argmin(deviances(SPREADS)))]
    ratio = SPREADS[1] / SPREADS[0]
    finer = best * np.append(1.0, np.geomspace(1 / ratio, ratio, 13))
    found = deviances(finer)
    return float(finer[int(np.argmin(found))]), float(found.min())
