"""Matching of trajectories: shared parameters, with every throw's release projected out.

Gauss–Newton on whitened residuals. For each throw the release state is free and its friction
deviates by a random ln factor of spread τ; both are eliminated, so that only the shared
parameters remain. What is minimised is −2 ln of the likelihood with the random factors integrated
out,

    F = Σ_throws [ |whitened residual|² + ln(1 + τ² h) ] + prior,

h being the information of a throw about its own friction. τ is found with the shared parameters:
the quadratic around the present point is profiled over a grid of τ, because F has more than one
minimum (a spread of zero explains nothing, a free one swallows every effect between throws). The
amplitude of a misplacement of places is found likewise, its coefficients integrated out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.model import (
    COUPLING_SIGMA,
    GLOBALS,
    Model,
    predict,
    sensitivities,
)
from friction_estimation.discovery.model.noise import Noise, whiten_session

SPREADS = np.concatenate([[0.0], np.geomspace(2e-4, 0.3, 30)])
"""Throw-to-throw spreads of ln μ that are tried."""
FURTHEST = 2.0
"""Largest |ln factor| of a throw's friction that a fit may try: seven times heavier or keener."""
ENOUGH = 0.05
"""Fall of F below which a fit has arrived."""
STATE_PRIOR = np.array([100.0, 100.0, 20.0, 20.0, 1e3, 50.0])
"""Weak prior of the release [m, m/s, rad, rad/s]: keeps a throw without heading solvable."""

SPIN_SIGMA = 0.6
"""Prior standard deviation of |spin| where no heading was measured [rad/s]: one to three turns."""
FROZEN = 1e14
"""Information that keeps a release state where it is."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A model fitted to a session.

    Parameters
    ----------
    model, session, noise : what was fitted to what
    states : (k, 6) release states
    ln_factors : (k,) deviation of ln μ of each throw
    predicted : (rows, 6) states at the measured times, as the camera sees them
    grams : (k, m, m) whitened Gram matrices of [6 states, ln factor, shared, residual]
    deviance : F, −2 ln likelihood up to a constant of the data and noise
    """

    model: Model
    session: Session
    noise: Noise
    states: Floats
    ln_factors: Floats
    predicted: Floats
    grams: Floats
    deviance: float

    @property
    def residuals(self) -> Floats:
        """Measured less predicted x, y, theta, (rows, 3)."""
        return self.session.observed - self.predicted[:, [0, 1, 4]]


def gram_matrices(session: Session, noise: Noise, columns: Floats) -> Floats:
    """Whitened Gram matrices per throw, (k, m, m), of columns (rows, 3, m); the last measured."""
    work = np.ascontiguousarray(columns).copy()
    m = work.shape[2]
    whiten_session(work, session.times, session.sigma, session.starts, noise.table(), np.empty(m))
    out = np.empty((len(session), m, m))
    for i in range(len(session)):
        part = work[session.rows(i)].reshape(-1, m)
        out[i] = part.T @ part
    return out


def eliminate_states(grams: Floats) -> Floats:
    """Gram matrices (k, m-6, m-6) with the release states projected out."""
    states = grams[:, :6, :6] + np.diag(1.0 / STATE_PRIOR**2)
    scale = 1.0 / np.sqrt(np.einsum("ijj->ij", states))
    scaled = states * scale[:, :, None] * scale[:, None, :] + 1e-13 * np.eye(6)
    cross = grams[:, :6, 6:] * scale[:, :, None]
    return grams[:, 6:, 6:] - np.swapaxes(cross, 1, 2) @ np.linalg.solve(scaled, cross)


def eliminate_factor(reduced: Floats, ln_factors: Floats, spread: float) -> tuple[Floats, Floats]:
    """Gram matrices (k, m-7, m-7) with the random factor integrated out, and ln(1 + τ²h).

    Parameters
    ----------
    reduced : (k, m-6, m-6) from `eliminate_states`; factor first, residual last
    ln_factors : (k,) the factors around which the columns were computed
    """
    if spread <= 0.0:
        # Without a spread the factor is one: the residual is that without the present deviation.
        out = reduced[:, 1:, 1:].copy()
        u = ln_factors[:, None]
        out[:, :, -1] += u * reduced[:, 0, 1:]
        out[:, -1, :] += u * reduced[:, 0, 1:]
        out[:, -1, -1] += ln_factors**2 * reduced[:, 0, 0]
        return out, np.zeros(len(reduced))
    h = reduced[:, 0, 0]
    own = h + spread**-2
    cross = reduced[:, 0, 1:].copy()
    cross[:, -1] -= ln_factors / spread**2
    out = reduced[:, 1:, 1:] - cross[:, :, None] * cross[:, None, :] / own[:, None, None]
    out[:, -1, -1] += ln_factors**2 / spread**2
    return out, np.log1p(spread**2 * h)


def prior_gram(model: Model, size: int) -> Floats:
    """Gram matrix of the priors on shared parameters: that on the coupling, (size, size)."""
    gram = np.zeros((size, size))
    at = GLOBALS.index("ln_coupling")
    gram[at, at] = COUPLING_SIGMA**-2
    gram[at, -1] = gram[-1, at] = -model.ln_coupling / COUPLING_SIGMA**2
    gram[-1, -1] = (model.ln_coupling / COUPLING_SIGMA) ** 2
    if model.misplacement:
        own, places = model.misplacement, np.arange(size)[model.misplaced]
        precision = own.deviations**-2
        gram[places, places] += precision
        gram[places, -1] = gram[-1, places] = -own.values * precision
        gram[-1, -1] += float(own.values**2 @ precision)
    return gram


def width_cost(model: Model, total: Floats) -> float:
    """What F pays for integrating over a misplacement's coefficients: ln |1 + their information|.

    Parameters
    ----------
    total : Gram matrix of all throws, without priors
    """
    if not model.misplacement:
        return 0.0
    sizes = model.misplacement.deviations
    information = total[model.misplaced, model.misplaced] * sizes[:, None] * sizes
    return float(np.linalg.slogdet(np.eye(len(sizes)) + information)[1])


def profile_amplitude(model: Model, total: Floats) -> tuple[float, float]:
    """The amplitude of the misplacement that minimises F, and that part of F.

    Parameters
    ----------
    total : Gram matrix of all throws, without priors, of the shared parameters and the residual
    """
    assert model.misplacement is not None
    best = (model.misplacement.amplitude, np.inf)
    for amplitude in model.misplacement.amplitudes:
        other = replace(model, misplacement=replace(model.misplacement, amplitude=float(amplitude)))
        whole = total + prior_gram(other, len(total))
        value = solve_shared(whole)[1] + width_cost(other, total)
        if value < best[1]:
            best = (float(amplitude), value)
    return best


def solve_shared(total: Floats) -> tuple[Floats, float]:
    """Step of the shared parameters that minimises the quadratic, and the quadratic's minimum."""
    inner = total[:-1, :-1]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inner), 1e-300))
    scaled = inner * scale[:, None] * scale + 1e-10 * np.eye(len(inner))
    step = scale * np.linalg.solve(scaled, scale * total[:-1, -1])
    return step, float(total[-1, -1] - total[:-1, -1] @ step)


def bounded_step(total: Floats, step: Floats, model: Model) -> Floats:
    """The step within the parameters' bounds: who would leave stops there, the others adapt."""
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
    reduced: Floats, ln_factors: Floats, prior: Floats, spreads: Floats = SPREADS
) -> tuple[float, Floats, float]:
    """The spread and step that minimise F of the linearised model together.

    Returns
    -------
    spread, step, F
    """
    best: tuple[float, Floats, float] | None = None
    tried: Floats = spreads
    for round_ in range(2):
        for spread in tried:
            grams, log_terms = eliminate_factor(reduced, ln_factors, float(spread))
            step, least = solve_shared(grams.sum(axis=0) + prior)
            value = least + float(log_terms.sum())
            if best is None or value < best[2]:
                best = (float(spread), step, value)
        assert best is not None
        if round_ == 0 and best[0] > 0 and len(spreads) > 1:
            ratio = float(spreads[2] / spreads[1])
            tried = best[0] * np.geomspace(1 / ratio, ratio, 9)
        else:
            break
    assert best is not None
    return best


def linearise(
    model: Model, session: Session, noise: Noise, states: Floats, ln_factors: Floats
) -> tuple[Floats, Floats, Floats]:
    """Prediction, Gram matrices and the Gram matrices without release states."""
    predicted, columns = sensitivities(model, session, states, ln_factors)
    residual = session.observed - predicted[:, [0, 1, 4]]
    grams = gram_matrices(session, noise, np.concatenate([columns, residual[:, :, None]], axis=2))
    # Without a heading only the last metres tell of the spin, which eases the band's drag.
    blind = ~session.turns
    off = session.usual_spins[blind] - states[blind, 5]
    grams[blind, 4, 4] += FROZEN
    grams[blind, 5, 5] += SPIN_SIGMA**-2
    grams[blind, 5, -1] += off / SPIN_SIGMA**2
    grams[blind, -1, 5] += off / SPIN_SIGMA**2
    grams[blind, -1, -1] += (off / SPIN_SIGMA) ** 2
    return predicted, grams, eliminate_states(grams)


def fit(
    model: Model,
    session: Session,
    noise: Noise,
    *,
    states: Floats | None = None,
    ln_factors: Floats | None = None,
    spreads: Floats = SPREADS,
    iterations: int = 12,
    shared: bool = True,
) -> Fit:
    """Fit the shared parameters of a model, the spread of its throws and their releases.

    Parameters
    ----------
    states, ln_factors : where to begin; from the tracks by default
    spreads : to choose from; one only keeps it fixed
    shared : whether the shared parameters are fitted; else only releases and factors are
    """
    states = session.first_states.copy() if states is None else states.copy()
    ln_factors = np.zeros(len(session)) if ln_factors is None else ln_factors.copy()
    present: tuple[Model, Floats, Floats, Floats, Floats, float] | None = None
    damping = 1.0
    for _ in range(iterations):
        predicted, grams, reduced = linearise(model, session, noise, states, ln_factors)
        prior = prior_gram(model, reduced.shape[1] - 1)
        here = _deviance(model, reduced, ln_factors, prior)
        if present is not None and not here < present[5] + 1e-6:
            damping *= 0.3
            if damping < 0.02:
                break
            last = present
        else:
            arrived = present is not None and present[5] - here < ENOUGH and damping == 1.0
            damping = min(1.0, 3.0 * damping)
            last = (model, states, ln_factors, predicted, grams, here)
            present = last
            if arrived:
                break
        model, states, ln_factors = _step(last, session, damping, spreads, shared)
    assert present is not None
    # F is that of the best releases; those of the last point are still a step behind.
    model, states, ln_factors, _, grams, here = present
    _, new_states, new_factors = _step(present, session, 1.0, spreads, False)
    grams = _moved(grams, new_states - states, new_factors - ln_factors)
    states, ln_factors = new_states, new_factors
    predicted = predict(model, session, states, ln_factors)
    return Fit(
        model=model,
        session=session,
        noise=noise,
        states=states,
        ln_factors=ln_factors,
        predicted=predicted,
        grams=grams,
        deviance=here,
    )


def _moved(grams: Floats, state_step: Floats, factor_step: Floats) -> Floats:
    """Gram matrices with the residual column of throws whose own parameters have moved."""
    move = np.zeros((len(grams), grams.shape[1], 1))
    move[:, :6, 0], move[:, 6, 0] = -state_step, -factor_step
    out = grams.copy()
    change = grams @ move
    out[:, :, -1] += change[:, :, 0]
    out[:, -1, :] += change[:, :, 0]
    out[:, -1, -1] += (np.swapaxes(move, 1, 2) @ change)[:, 0, 0]
    return out


def _deviance(model: Model, reduced: Floats, ln_factors: Floats, prior: Floats) -> float:
    """F at the present parameters, with releases and factors at their best."""
    grams, log_terms = eliminate_factor(reduced, ln_factors, model.spread)
    deviance = float(grams[:, -1, -1].sum() + log_terms.sum() + prior[-1, -1])
    return deviance + width_cost(model, grams.sum(axis=0))


def _step(
    point: tuple[Model, Floats, Floats, Floats, Floats, float],
    session: Session,
    damping: float,
    spreads: Floats,
    shared: bool,
) -> tuple[Model, Floats, Floats]:
    model, states, ln_factors, _, grams, _ = point
    reduced = eliminate_states(grams)
    prior = prior_gram(model, reduced.shape[1] - 1)
    if shared:
        spread, step, _ = profile_spread(reduced, ln_factors, prior, spreads)
        bands, _ = eliminate_factor(reduced, ln_factors, spread)
        total = bands.sum(axis=0)
        if model.misplacement:
            amplitude, _ = profile_amplitude(model, total)
            model = replace(model, misplacement=replace(model.misplacement, amplitude=amplitude))
            prior = prior_gram(model, len(total))
            step, _ = solve_shared(total + prior)
        step = damping * bounded_step(total + prior, step, model)
    else:
        spread, step = model.spread, np.zeros(len(model.vector))
    vector = model.vector
    moved = model.at(vector + step)
    step = moved.vector - vector  # what the bounds let through
    h = reduced[:, 0, 0]
    pull = reduced[:, 0, -1] - reduced[:, 0, 1:-1] @ step
    if spread > 0.0:
        shift = (pull - ln_factors / spread**2) / (h + spread**-2)
    else:
        shift = -ln_factors
    # A step far beyond what is linear must not leave what ice can be.
    shift = np.clip(ln_factors + shift, -FURTHEST, FURTHEST) - ln_factors
    changes = np.concatenate(
        [shift[:, None], np.broadcast_to(step, (len(session), len(step)))], axis=1
    )
    inner = grams[:, :6, :6] + np.diag(1.0 / STATE_PRIOR**2)
    scale = 1.0 / np.sqrt(np.einsum("ijj->ij", inner))
    right = grams[:, :6, -1] - np.einsum("ijk,ik->ij", grams[:, :6, 6:-1], changes)
    scaled = inner * scale[:, :, None] * scale[:, None, :] + 1e-13 * np.eye(6)
    state_step = scale * np.linalg.solve(scaled, (scale * right)[:, :, None])[:, :, 0]
    return replace(moved, spread=spread), states + state_step, ln_factors + shift
