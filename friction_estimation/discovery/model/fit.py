"""The fit of a model to a session: shared parameters, with every throw's release projected out.

Gauss–Newton steps on whitened residuals. For each throw the release state is free and the friction
deviates by a random factor, whose logarithm has the spread τ. Both are eliminated, so that only the
shared parameters remain. The fit minimises the deviance, −2 ln of the likelihood with the random
factors integrated out,

    F = Σ_throws [ |whitened residual|² + ln(1 + τ² h) ] + prior,

where h is the information of a throw about its own friction. τ is found with the shared parameters:
the quadratic around the present point is profiled over a grid of τ, because F has more than one
minimum (a spread of zero explains nothing, a free one absorbs every effect between throws). The
amplitude of the systematic error is found likewise, with its coefficients integrated out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from curling_env.physics.state import State
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrix,
    pooled_without_factor,
)
from friction_estimation.discovery.model.model import (
    GLOBALS,
    MEASURED,
    Model,
    predict,
    sensitivities_by_throw,
)
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.tuning import (
    CONVERGED,
    COUPLING_SIGMA,
    LARGEST_LN_FACTOR,
    RELEASE_SIGMA,
    TRIED_SPREADS,
    USUAL_SPIN_SIGMA,
)

FROZEN = 1e14
"""Information that keeps a release state where it is."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionFit:
    """A model fitted to a session.

    Parameters
    ----------
    model : fitted model
    session : throws it was fitted to
    noise : noise that was assumed
    states : (k, 6) release states
    ln_factors : (k,) deviation of ln μ of each throw
    predicted : (rows, 6) states at the measured times, as the camera sees them
    grams : (k, m, m) whitened Gram matrices of [6 states, ln factor, shared, residual]
    deviance : F, which is −2 ln likelihood up to a constant of the data and the noise
    """

    model: Model
    session: Session
    noise: SessionNoise
    states: Floats
    ln_factors: Floats
    predicted: Floats
    grams: Floats
    deviance: float

    @property
    def residuals(self) -> Floats:
        """Measured less predicted x, y, theta, (rows, 3)."""
        return self.session.observed - self.predicted[:, MEASURED]


class Point(NamedTuple):
    """Where a fit has come.

    Parameters
    ----------
    model, states, ln_factors : as of `SessionFit`
    grams : Gram matrices there
    deviance : F with releases and factors at their best
    """

    model: Model
    states: Floats
    ln_factors: Floats
    grams: Floats
    deviance: float


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
    """The term that integrating over the coefficients of Gaussian fields adds to F.

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
    """The model with those amplitudes of its fields that minimise F, and that part of F.

    Parameters
    ----------
    model : model with Gaussian fields
    total : Gram matrix of all throws, without priors, of the shared parameters and the residual
    """
    best, least = model, np.inf
    for _ in range(len(model.fields)):
        for which, (_, field) in enumerate(model.fields):
            if field is best.map_field:
                amplitude, value = _profile_map(best, total)
                if value < least:
                    best, least = best.with_amplitude(which, amplitude), value
                continue
            for amplitude in field.amplitudes:
                other = best.with_amplitude(which, float(amplitude))
                whole = total + prior_gram(other, len(total))
                value = solve_shared(whole)[1] + integration_cost(other, total)
                if value < least:
                    best, least = other, value
    return best, least


def _profile_map(model: Model, total: Floats) -> tuple[float, float]:
    """The amplitude of the friction map that minimises F, and that part of F.

    All coefficients of the map have the same prior. Once everything else is projected out, F is a
    sum over the eigenvectors of their information, whatever the amplitude.
    """
    field, size = model.map_field, len(total)
    assert field is not None
    own = np.arange(size)[model.map_slice]
    whole = total + prior_gram(model, size, fields=False)
    inner, right, least = projected(whole, own, np.setdiff1d(np.arange(size - 1), own))
    # As a function of the coefficients themselves, and not of a step from the present ones.
    least += float(field.values @ (2.0 * right + inner @ field.values))
    right = right + inner @ field.values
    values, vectors = np.linalg.eigh(inner)
    shown = (vectors.T @ right) ** 2
    others = [place for place, other in model.fields if other is not field]
    beside = np.concatenate([np.arange(size)[place] for place in others] or [own[:0]])
    integrated = np.linalg.eigvalsh(projected(whole, own, beside)[0])
    best = (field.amplitude, np.inf)
    for amplitude in field.amplitudes:
        trial = field.with_amplitude(float(amplitude))
        value = least - float((shown / (np.maximum(values, 0.0) + amplitude**-2)).sum())
        value += float(np.log1p(amplitude**2 * np.maximum(integrated, 0.0)).sum())
        if value + trial.hyperprior < best[1]:
            best = (float(amplitude), value + trial.hyperprior)
    for place, other in model.fields:
        if other is not field:
            sizes, at = other.deviations, np.arange(size)[place]
            information = total[np.ix_(at, at)] * sizes[:, None] * sizes
            cost = float(np.linalg.slogdet(np.eye(len(at)) + information)[1])
            best = (best[0], best[1] + cost + other.hyperprior)
    return best


def projected(whole: Floats, kept: Indices, others: Indices) -> tuple[Floats, Floats, float]:
    """A quadratic in some parameters, at the best of others; the rest stay as they are.

    Parameters
    ----------
    whole : (P + 1, P + 1) Gram matrix of the parameters and the residual
    kept, others : their places

    Returns
    -------
    inner, right, least : the quadratic ``least - 2 right·step + step·inner·step``
    """
    inner, right, least = whole[np.ix_(kept, kept)], whole[kept, -1], float(whole[-1, -1])
    if not len(others):
        return inner, right, least
    scale = 1.0 / np.sqrt(np.maximum(np.diag(whole)[others], 1e-300))
    scaled = whole[np.ix_(others, others)] * scale[:, None] * scale + 1e-10 * np.eye(len(others))
    cross = scale[:, None] * np.column_stack([whole[np.ix_(others, kept)], whole[others, -1]])
    solved = np.linalg.solve(scaled, cross)
    reduction = cross.T @ solved
    return (
        inner - reduction[:-1, :-1],
        right - reduction[:-1, -1],
        least - float(reduction[-1, -1]),
    )


def solve_shared(total: Floats) -> tuple[Floats, float]:
    """Step of the shared parameters that minimises a quadratic, and its minimum.

    Parameters
    ----------
    total : (P + 1, P + 1) Gram matrix of the shared parameters and the residual, priors included
    """
    inner = total[:-1, :-1]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inner), 1e-300))
    scaled = inner * scale[:, None] * scale + 1e-10 * np.eye(len(inner))
    step = scale * np.linalg.solve(scaled, scale * total[:-1, -1])
    return step, float(total[-1, -1] - total[:-1, -1] @ step)


def bounded_step(total: Floats, step: Floats, model: Model) -> Floats:
    """The step within the parameters' bounds: what would leave stops there, and the rest adapts.

    Parameters
    ----------
    total : (P + 1, P + 1) Gram matrix, as of `solve_shared`
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
        step[free] = solve_shared(part)[0] if free.any() else 0.0
    return np.clip(step, low, high)


def profile_spread(
    reduced: Floats, ln_factors: Floats, prior: Floats, spreads: Floats = TRIED_SPREADS
) -> tuple[float, Floats, float]:
    """The spread and the step that together minimise F of the linearised model.

    Parameters
    ----------
    reduced, ln_factors : as of `eliminate_factor`
    prior : Gram matrix of the priors
    spreads : spreads that are tried; around the best of them a finer grid is tried too

    Returns
    -------
    spread, step, F
    """
    tried = np.unique(spreads)
    best = _best_spread(reduced, ln_factors, prior, tried)
    if best[0] > 0.0 and len(spreads) > 1:
        ratio = float(spreads[2] / spreads[1])
        finer = best[0] * np.geomspace(1 / ratio, ratio, 13)
        best = min(best, _best_spread(reduced, ln_factors, prior, finer), key=lambda each: each[2])
    return best


def _best_spread(
    reduced: Floats, ln_factors: Floats, prior: Floats, spreads: Floats
) -> tuple[float, Floats, float]:
    """The best of some spreads with its step and F, as of `profile_spread`."""
    total, log_terms = pooled_without_factor(reduced, ln_factors, spreads)
    total += prior
    diagonal = np.einsum("sjj->sj", total)[:, :-1]
    scale = 1.0 / np.sqrt(np.maximum(diagonal, 1e-300))
    scaled = total[:, :-1, :-1] * scale[:, :, None] * scale[:, None, :]
    scaled += 1e-10 * np.eye(scaled.shape[1])
    right = total[:, :-1, -1]
    steps = scale * np.linalg.solve(scaled, (scale * right)[:, :, None])[:, :, 0]
    values = total[:, -1, -1] - (right * steps).sum(axis=1) + log_terms
    k = int(np.argmin(values))
    return float(spreads[k]), steps[k], float(values[k])


def linearise(
    model: Model, session: Session, noise: SessionNoise, states: Floats, ln_factors: Floats
) -> tuple[Floats, Floats, Floats]:
    """The model linearised at a point.

    Returns
    -------
    predicted : (rows, 6) states
    grams : (k, m, m) Gram matrices, as of `SessionFit`
    reduced : (k, m-6, m-6) the same with the release states projected out
    """
    found = sensitivities_by_throw(model, session, states, ln_factors)
    predicted = found.predicted
    residual = (session.observed - predicted[:, MEASURED])[:, :, None]

    def gram(i: int) -> Floats:
        rows = session.rows(i)
        columns = np.concatenate([found.of_throw(rows, i), residual[rows]], axis=2)
        return gram_matrix(session, noise, i, columns)

    grams = np.array([gram(i) for i in range(len(session))])
    # Without a heading only the last metres show the spin, which eases the drag of the band.
    blind = ~session.turns
    off = session.usual_spins[blind] - states[blind, State.OMEGA]
    grams[blind, State.THETA, State.THETA] += FROZEN
    grams[blind, State.OMEGA, State.OMEGA] += USUAL_SPIN_SIGMA**-2
    grams[blind, State.OMEGA, -1] += off / USUAL_SPIN_SIGMA**2
    grams[blind, -1, State.OMEGA] += off / USUAL_SPIN_SIGMA**2
    grams[blind, -1, -1] += (off / USUAL_SPIN_SIGMA) ** 2
    return predicted, grams, eliminate_states(grams)


def fit(
    model: Model,
    session: Session,
    noise: SessionNoise,
    *,
    states: Floats | None = None,
    ln_factors: Floats | None = None,
    spreads: Floats = TRIED_SPREADS,
    iterations: int = 12,
    shared: bool = True,
) -> SessionFit:
    """Fit the shared parameters of a model, the spread of its throws and their releases.

    Parameters
    ----------
    model : model, at the values from which the fit begins
    session : throws
    noise : noise of the tracks
    states, ln_factors : releases and ln factors from which the fit begins; from the tracks and 0 by
        default
    spreads : throw-to-throw spreads to choose from; a single one stays
    iterations : most steps
    shared : whether the shared parameters are fitted; else only releases and factors are
    """
    states = session.first_states.copy() if states is None else states.copy()
    ln_factors = np.zeros(len(session)) if ln_factors is None else ln_factors.copy()
    present: Point | None = None
    damping = 1.0
    for _ in range(iterations):
        _, grams, reduced = linearise(model, session, noise, states, ln_factors)
        if shared:
            model = replace(model, spread=_likeliest_spread(model, reduced, ln_factors, spreads))
        prior = prior_gram(model, reduced.shape[1] - 1)
        here = _deviance(model, reduced, ln_factors, prior)
        if present is not None and not here < present.deviance + 1e-6:
            damping *= 0.3
            # What is left to gain is no more than was lost, which does not count.
            if damping < 0.02 or here - present.deviance < CONVERGED:
                break
            last = present
        else:
            arrived = present is not None and present.deviance - here < CONVERGED and damping == 1.0
            damping = min(1.0, 3.0 * damping)
            last = Point(model, states, ln_factors, grams, here)
            present = last
            if arrived:
                break
        model, states, ln_factors = _step(last, session, damping, spreads, shared)
    assert present is not None
    # The deviance is that of the best releases; those of the last point are still a step behind.
    model, states, ln_factors, grams, here = present
    _, new_states, new_factors = _step(present, session, 1.0, spreads, False)
    grams = _moved(grams, new_states - states, new_factors - ln_factors)
    states, ln_factors = new_states, new_factors
    predicted = predict(model, session, states, ln_factors)
    return SessionFit(
        model=model,
        session=session,
        noise=noise,
        states=states,
        ln_factors=ln_factors,
        predicted=predicted,
        grams=grams,
        deviance=here,
    )


def refit(fitted: SessionFit, model: Model, *, iterations: int = 12) -> SessionFit:
    """Fit another model to the same session, from the releases and ln factors of a fit."""
    return fit(
        model,
        fitted.session,
        fitted.noise,
        states=fitted.states,
        ln_factors=fitted.ln_factors,
        iterations=iterations,
    )


def fit_to(fitted: SessionFit, session: Session) -> SessionFit:
    """Fit the model of a fit to other throws, some of which it was fitted to.

    Parameters
    ----------
    fitted : the fit, whose releases and ln factors are those from which its throws begin
    session : throws
    """
    states, ln_factors = session.first_states.copy(), np.zeros(len(session))
    known = {throw: i for i, throw in enumerate(fitted.session.throws.tolist())}
    for k, throw in enumerate(session.throws.tolist()):
        if throw in known:
            states[k] = fitted.states[known[throw]]
            ln_factors[k] = fitted.ln_factors[known[throw]]
    return fit(fitted.model, session, fitted.noise, states=states, ln_factors=ln_factors)


def _likeliest_spread(model: Model, reduced: Floats, ln_factors: Floats, spreads: Floats) -> float:
    """The spread that minimises F at the present parameters.

    The spread that a step foresees is that of its end as if all were linear. Where it is nearly
    zero, what is not linear in the step would count a hundredfold, and the step be refused.

    Parameters
    ----------
    model : model, whose own spread is tried too
    reduced, ln_factors, spreads : as of `profile_spread`
    """
    h = reduced[:, 0, 0]
    own = ln_factors + reduced[:, 0, -1] / h
    tried = np.append(spreads, model.spread if len(spreads) > 1 else spreads[0])[:, None]
    values = own**2 / (tried**2 + 1.0 / h) + np.log1p(tried**2 * h)
    return float(tried[int(np.argmin(values.sum(axis=1))), 0])


def _moved(grams: Floats, state_step: Floats, factor_step: Floats) -> Floats:
    """Gram matrices with the residuals that remain after a step of releases and ln factors."""
    move = np.zeros((len(grams), grams.shape[1], 1))
    move[:, :6, 0], move[:, 6, 0] = -state_step, -factor_step
    out = grams.copy()
    change = grams @ move
    out[:, :, -1] += change[:, :, 0]
    out[:, -1, :] += change[:, :, 0]
    out[:, -1, -1] += (np.swapaxes(move, 1, 2) @ change)[:, 0, 0]
    return out


def _deviance(model: Model, reduced: Floats, ln_factors: Floats, prior: Floats) -> float:
    """The deviance at the present parameters, with releases and factors at their best."""
    grams, log_terms = eliminate_factor(reduced, ln_factors, model.spread)
    deviance = float(grams[:, -1, -1].sum() + log_terms.sum() + prior[-1, -1])
    return deviance + integration_cost(model, grams.sum(axis=0))


def _step(
    point: Point, session: Session, damping: float, spreads: Floats, shared: bool
) -> tuple[Model, Floats, Floats]:
    """Model, releases and ln factors after a step from a point."""
    model, states, ln_factors, grams, _ = point
    reduced = eliminate_states(grams)
    prior = prior_gram(model, reduced.shape[1] - 1)
    if shared:
        spread, step, _ = profile_spread(reduced, ln_factors, prior, spreads)
        bands, _ = eliminate_factor(reduced, ln_factors, spread)
        total = bands.sum(axis=0)
        if model.fields:
            model, _ = profile_amplitudes(model, total)
            prior = prior_gram(model, len(total))
            step, _ = solve_shared(total + prior)
        step = damping * bounded_step(total + prior, step, model)
    else:
        spread, step = model.spread, np.zeros(len(model.vector))
    vector = model.vector
    moved = model.at(vector + step)
    step = moved.vector - vector  # as far as the bounds allow
    h = reduced[:, 0, 0]
    right_side = reduced[:, 0, -1] - reduced[:, 0, 1:-1] @ step
    if spread > 0.0:
        shift = (right_side - ln_factors / spread**2) / (h + spread**-2)
    else:
        shift = -ln_factors
    # A step far beyond the linear range must not lead to friction that no ice has.
    shift = np.clip(ln_factors + shift, -LARGEST_LN_FACTOR, LARGEST_LN_FACTOR) - ln_factors
    changes = np.concatenate(
        [shift[:, None], np.broadcast_to(step, (len(session), len(step)))], axis=1
    )
    inner = grams[:, :6, :6] + np.diag(1.0 / RELEASE_SIGMA**2)
    scale = 1.0 / np.sqrt(np.einsum("ijj->ij", inner))
    right = grams[:, :6, -1] - np.einsum("ijk,ik->ij", grams[:, :6, 6:-1], changes)
    scaled = inner * scale[:, :, None] * scale[:, None, :] + 1e-13 * np.eye(6)
    state_step = scale * np.linalg.solve(scaled, (scale * right)[:, :, None])[:, :, 0]
    return replace(moved, spread=spread), states + state_step, ln_factors + shift
