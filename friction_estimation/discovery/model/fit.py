"""Fit of a model to a session: shared parameters, with every throw's release projected out.

Gauss–Newton steps on whitened residuals. For each throw the release state is free and the friction
deviates by a random factor, whose logarithm has the spread τ. Both are eliminated, so that only the
shared parameters remain. The fit minimises the deviance, −2 ln of the likelihood with the random
factors integrated out,

    F = Σ_throws [ |whitened residual|² + ln(1 + τ² h) ] + prior,

where h is the information of a throw about its own friction. τ is found with the shared parameters:
the quadratic around the present point is profiled over a grid of τ, because F has several minima (a
spread of zero explains nothing, a free one absorbs every effect between throws). The amplitude of
the systematic error is found in the same way, with its coefficients integrated out.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from curling_env.errors import FitError
from curling_env.physics.state import State
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.linearisation import Linearisation, release_steps
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.model import Model, predict
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.quadratic import (
    bounded_step,
    prior_gram,
    profile_amplitudes,
    profile_spread,
)
from friction_estimation.discovery.model.response import MEASURED, LinearisedPaths
from friction_estimation.discovery.model.sensitivity import (
    linearised_paths,
    sensitivities,
    sensitivities_by_throw,
)
from friction_estimation.discovery.tuning import (
    CONVERGED,
    LARGEST_LN_FACTOR,
    SPREADS,
    USUAL_SPIN,
    USUAL_SPIN_SIGMA,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionFit:
    """A model fitted to a session.

    Parameters
    ----------
    session : throws it was fitted to
    noise : noise that was assumed
    states : (k, 6) release states
    predicted : (rows, 6) states at the measured times, as the camera sees them
    linear : the session, linear around the fit, with the fitted model
    deviance : F, which is −2 ln likelihood up to a constant of the data and the noise
    only_spread : the one spread of ln μ between throws at which `linear` holds; None where it holds
        at any
    """

    session: Session
    noise: SessionNoise
    states: Floats
    predicted: Floats
    linear: Linearisation
    deviance: float
    only_spread: float | None = None

    @property
    def model(self) -> Model:
        """The fitted model."""
        return self.linear.model

    @property
    def ln_factors(self) -> Floats:
        """Deviation of ln μ of each throw, (k,)."""
        return self.linear.ln_factors

    @property
    def residuals(self) -> Floats:
        """Measured less predicted x, y, theta, (rows, 3)."""
        return self.session.observed - self.predicted[:, MEASURED]

    @property
    def columns(self) -> Floats:
        """Derivatives of x, y and heading at the fit, (rows, 3, 7 + P), as in `sensitivities`."""
        return _columns_of(self)

    @property
    def paths(self) -> LinearisedPaths:
        """Paths of the fit with their response to pushes."""
        return _paths_of(self)

    def linear_in(self, model: Model, columns: Floats, residual: Floats) -> Linearisation:
        """Return the session, linear around the fit, by the parameters of another model.

        Parameters
        ----------
        model : model; the spread is that of the fit
        columns, residual : (rows, 3, 7 + P), (rows, 3) as of `sensitivities`, and what is left
        """
        whole = np.concatenate([columns, residual[:, :, None]], axis=2)
        return Linearisation.of(
            self.session,
            self.noise,
            replace(model, spread=self.model.spread),
            self.states,
            self.ln_factors,
            np.split(whole, self.session.starts[1:-1]),
        )

    def linear_with(self, *terms: Term) -> Linearisation:
        """Return the session, linear around the fit, by its parameters and those of more terms."""
        model = self.model.with_terms(*terms)
        return linearise(model, self.session, self.noise, self.states, self.ln_factors)[1]

    def worst_throw(self) -> str:
        """Name the throw with the largest residuals, for an error message."""
        session = self.session
        distance = np.nan_to_num(np.hypot(*self.residuals[:, :2].T), nan=np.inf)
        turn = np.nan_to_num(np.abs(self.residuals[:, 2]))
        largest = [
            (float(distance[rows].max()), float(turn[rows].max()))
            for rows in map(session.rows, range(len(session)))
        ]
        # A radian is weighted by the movement of a stone's rim.
        rim = self.model.ice.stone.radius
        k = int(np.argmax([metres + rim * radians for metres, radians in largest]))
        metres, radians = largest[k]
        return f"throw {session.throws[k]} fits worst, by {metres:.3g} m and {radians:.3g} rad"


@lru_cache(maxsize=2)
def _columns_of(fitted: SessionFit) -> Floats:
    """Cached for the last fits only: a table of many throws takes a hundred megabytes."""
    return sensitivities(fitted.model, fitted.session, fitted.states, fitted.ln_factors)[1]


@lru_cache(maxsize=2)
def _paths_of(fitted: SessionFit) -> LinearisedPaths:
    return linearised_paths(fitted.model, fitted.session, fitted.states, fitted.ln_factors)


@contextmanager
def singular_fit_refused() -> Generator[None]:
    """Report equations without a solution as throws that cannot be fitted.

    Raises
    ------
    FitError : a matrix of the fit is singular
    """
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise FitError(
            "no ice can be fitted to these throws: their positions, times or headings make the "
            f"equations singular ({error})"
        ) from error


class Point(NamedTuple):
    """Current state of a fit: releases, the linearised session, and F with optimal releases."""

    states: Floats
    linear: Linearisation
    deviance: float


def linearise(
    model: Model, session: Session, noise: SessionNoise, states: Floats, ln_factors: Floats
) -> tuple[Floats, Linearisation]:
    """Return the model linearised at a point.

    Returns
    -------
    predicted : (rows, 6) states
    linear : the session around them
    """
    predicted, of_throw = sensitivities_by_throw(model, session, states, ln_factors)
    residual = (session.observed - predicted[:, MEASURED])[:, :, None]
    columns = (of_throw(i, residual[session.rows(i)]) for i in range(len(session)))
    linear = Linearisation.of(session, noise, model, states, ln_factors, columns)
    return predicted, linear


def fit(
    model: Model,
    session: Session,
    noise: SessionNoise,
    *,
    states: Floats | None = None,
    ln_factors: Floats | None = None,
    iterations: int = 12,
    shared: bool = True,
    goal: float = np.inf,
) -> SessionFit:
    """Fit the shared parameters of a model, the spread of its throws and their releases.

    Parameters
    ----------
    model : model, at the values from which the fit begins
    session : throws
    noise : noise of the tracks
    states, ln_factors : releases and ln factors from which the fit begins; from the tracks and 0 by
        default
    iterations : most steps
    shared : whether the shared parameters are fitted; else only releases and factors are
    goal : deviance that the fit must reach to be of use; it ends where all further steps, as large
        as the last, would not
    """
    states = session.first_states.copy() if states is None else states.copy()
    ln_factors = np.zeros(len(session)) if ln_factors is None else ln_factors.copy()
    present: Point | None = None
    damping, arrives, least = 1.0, False, np.inf
    falls: list[float] = []
    for number in range(1, iterations + 1):
        # In too large a step stones may diverge until numbers overflow; such a step is rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            _, linear = linearise(model, session, noise, states, ln_factors)
            if shared:
                spread = _most_likely_spread(linear)
                linear = replace(linear, model=replace(model, spread=spread))
            here = linear.deviance()
        if present is not None and not here < present.deviance + 1e-6:
            rise, promised = here - present.deviance, present.deviance - least
            # The parabola through this rise, with the promised slope, is least at a shorter step.
            damping *= max(0.1, 1.0 / (2.0 + rise / max(damping * promised, 1e-9)))
            # Releases alone have no shorter step. Otherwise the gain is below the tolerance.
            if not shared or damping < 0.02 or rise < CONVERGED:
                break
        else:
            falls.append(present.deviance - here if present is not None else np.inf)
            arrived = falls[-1] < CONVERGED and damping == 1.0
            damping = min(1.0, 3.0 * damping)
            present = Point(states, linear, here)
            if arrived or here - (iterations - number) * falls[-1] > goal:
                break
        model, states, ln_factors, least = _step(present, session, damping, shared)
        arrives = damping == 1.0 and _behind(linear) + here - least < CONVERGED
        if arrives:
            break
    assert present is not None
    # A step that hardly improves needs no other linearisation. Otherwise the releases take one: the
    # deviance assumes the best, and those of the last point are one step behind.
    model, states, ln_factors, least = _step(present, session, 1.0, arrives and shared)
    return SessionFit(
        session=session,
        noise=noise,
        states=states,
        predicted=predict(model, session, states, ln_factors),
        linear=_moved(present, model, states, ln_factors),
        deviance=least,
    )


def refit(
    fitted: SessionFit, model: Model, *, iterations: int = 12, goal: float = np.inf
) -> SessionFit:
    """Fit another model to the same session, from the releases and ln factors of a fit."""
    return fit(
        model,
        fitted.session,
        fitted.noise,
        states=fitted.states,
        ln_factors=fitted.ln_factors,
        iterations=iterations,
        goal=goal,
    )


def fit_to(fitted: SessionFit, session: Session) -> SessionFit:
    """Fit the model of a fit to other throws, which may include those of the fit.

    Parameters
    ----------
    fitted : the fit, whose releases and ln factors are those from which its throws begin
    session : throws
    """
    states, ln_factors = releases_near(session, fitted)
    return fit(fitted.model, session, fitted.noise, states=states, ln_factors=ln_factors)


def releases_near(session: Session, *fits: SessionFit) -> tuple[Floats, Floats]:
    """Releases and ln factors from which the throws of a session may begin.

    Parameters
    ----------
    session : throws
    fits : fits of some of them; the later goes first

    Returns
    -------
    states : (k, 6) those of the fits, and of the tracks where no fit knows the throw
    ln_factors : (k,) those of the fits, and 0 elsewhere
    """
    states, ln_factors = session.first_states.copy(), np.zeros(len(session))
    for fitted in fits:
        known = {slide: i for i, slide in enumerate(fitted.session.slides)}
        for k, slide in enumerate(session.slides):
            if slide in known:
                states[k] = fitted.states[known[slide]]
                ln_factors[k] = fitted.ln_factors[known[slide]]
    return states, ln_factors


def _most_likely_spread(linear: Linearisation) -> float:
    """Return the spread that minimises F at the present parameters.

    The spread that a step predicts assumes linearity. If it is nearly zero, the nonlinear part of
    the step would count a hundredfold, and the step would be rejected.
    """
    h, reduced = linear.reduced[:, 0, 0], linear.reduced
    own = linear.ln_factors + reduced[:, 0, -1] / h
    tried = np.append(SPREADS, linear.model.spread)[:, None]
    values = own**2 / (tried**2 + 1.0 / h) + np.log1p(tried**2 * h)
    return float(tried[int(np.argmin(values.sum(axis=1))), 0])


def _behind(linear: Linearisation) -> float:
    """Fall of F that better releases and ln factors promise at a point."""
    spread, grams = linear.model.spread, linear.grams
    present = grams[:, -1, -1].sum()
    if spread > 0.0:
        present += ((linear.ln_factors / spread) ** 2).sum()
    return float(present - linear.each()[0][:, -1, -1].sum())


def _moved(point: Point, model: Model, states: Floats, ln_factors: Floats) -> Linearisation:
    """Return the linearisation of a point with the residuals that remain after a step."""
    before, grams = point.linear, point.linear.grams.copy()
    move = np.zeros(grams.shape[:2])
    move[:, :6], move[:, 6] = point.states - states, before.ln_factors - ln_factors
    move[:, 7:-1] = before.model.vector - model.vector
    change = np.einsum("kij,kj->ki", grams, move)
    grams[:, :, -1] += change
    grams[:, -1, :] += change
    grams[:, -1, -1] += (move * change).sum(axis=1)
    return Linearisation(model=model, ln_factors=ln_factors, grams=grams)


def _part_of_the_way(model: Model, foreseen: Model, part: float) -> Model:
    """Return the model with amplitudes of its fields interpolated like a shortened step.

    Coefficients that are still large are improbable at the small amplitude of the full step, so
    that each shorter step would be rejected.
    """
    if part == 1.0:
        return foreseen
    for which, (_, field) in enumerate(model.fields):
        ratio = foreseen.fields[which][1].amplitude / field.amplitude
        model = model.with_amplitude(which, field.amplitude * ratio**part)
    return model


def _step(
    point: Point, session: Session, damping: float, shared: bool
) -> tuple[Model, Floats, Floats, float]:
    """Model, releases and ln factors after a step from a point, and F to first order there."""
    states, linear, least = point
    model, reduced, ln_factors = linear.model, linear.reduced, linear.ln_factors
    if shared:
        spread, least = profile_spread(reduced, ln_factors, linear.prior)
        grams, log_terms = linear.each(spread)
        total = grams.sum(axis=0)
        foreseen, with_fields = profile_amplitudes(model, total)
        if model.fields:
            least = with_fields + float(log_terms.sum())
        whole = total + prior_gram(foreseen, len(total))
        model = _part_of_the_way(model, foreseen, damping)
        step = damping * bounded_step(whole, minimum_of(whole).step, model)
    else:
        spread, step = model.spread, np.zeros(len(model.vector))
    vector = model.vector
    if model.map_field is not None:
        patterns = model.map_field.patterns[model.map_field.crossed]
        change = float(np.abs(patterns @ step[model.map_slice]).max())
        step = step * min(1.0, LARGEST_LN_FACTOR / max(change, 1e-300))
    moved = model.at(vector + step)
    step = moved.vector - vector  # as far as the bounds allow
    h = reduced[:, 0, 0]
    right_side = reduced[:, 0, -1] - reduced[:, 0, 1:-1] @ step
    if spread > 0.0:
        shift = (right_side - ln_factors / spread**2) / (h + spread**-2)
    else:
        shift = -ln_factors
    # A step far beyond the linear range must not lead to impossible friction.
    shift = np.clip(ln_factors + shift, -LARGEST_LN_FACTOR, LARGEST_LN_FACTOR) - ln_factors
    changes = np.column_stack([shift, np.broadcast_to(step, (len(shift), len(step)))])
    states = states + release_steps(linear.grams, changes[None])[0]
    blind = ~session.turns
    side = np.sign(session.usual_spins[blind])
    slowest = USUAL_SPIN - 2.0 * USUAL_SPIN_SIGMA
    spins = np.maximum(side * states[blind, State.OMEGA], slowest)
    states[blind, State.OMEGA] = side * spins
    return replace(moved, spread=spread), states, ln_factors + shift, least
