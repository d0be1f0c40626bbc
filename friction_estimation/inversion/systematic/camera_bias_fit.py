"""A bias of the camera, searched beside the map and fitted with it where the throws show one.

How it is judged is in `camera_bias_evidence`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats, Progress
from friction_estimation.inversion.friction.map_fit import (
    FittedMap,
    MapProblem,
    MapState,
    assemble_equations,
)
from friction_estimation.inversion.friction.posterior import Hyperparameters, NormalEquations
from friction_estimation.inversion.noise import Noise, estimate_noise
from friction_estimation.inversion.systematic.camera_bias_evidence import (
    CameraBiasSearch,
    likeness,
    seen_from,
    split_throws,
    variety,
)
from friction_estimation.inversion.throw.camera_bias import zero_bias_over
from friction_estimation.inversion.throw.fitted import FittedThrow, kept_residuals
from friction_estimation.inversion.throw.free_effects import with_camera_like_effects
from friction_estimation.inversion.throw.linearised import LinearThrow
from friction_estimation.inversion.tuning import (
    CAMERA_BIAS_ROUNDS,
    MAX_NOISE_TIME,
    MIN_CAMERA_BIAS,
    MIN_CAMERA_BIAS_GAIN,
    MIN_HALVES_CORRELATION,
    MIN_SPEED_VARIETY,
    MIN_THROWS_FOR_CAMERA_BIAS,
    USUAL_CAMERA_BIAS,
)


def search_camera_bias(
    without: FittedMap, problem: MapProblem, *, scatter: bool, force: bool, progress: Progress
) -> tuple[FittedMap, CameraBiasSearch]:
    """Search for a bias of the camera, starting from the map that was fitted without one.

    Parameters
    ----------
    without : map fitted without a bias
    problem : map that was asked for
    scatter : whether each throw may have a μ of its own about the ice's
    force : whether a bias is fitted even where it is not clear that there is one
    progress : called after every round

    Returns
    -------
    the map with the bias, or the one without where none is fitted; and the result of the search
    """
    throws, hyper = without.state.throws, without.posterior.hyperparameters
    speed_variety = _speed_variety(throws)
    if len(throws) < MIN_THROWS_FOR_CAMERA_BIAS or speed_variety < MIN_SPEED_VARIETY:
        return without, CameraBiasSearch(outcome="inseparable", variety=speed_variety)
    bias = zero_bias_over([k.inputs.path.at(k.measured[k.keep])[:, 1] for k in throws])
    start = replace(without.state, bias=bias)
    fitted = _fit_bias(replace(without, state=start), problem, scatter=scatter, progress=progress)
    if fitted is None:
        usual = _beside_like_effects(start, [without.noise], problem)[0].equations()
        clear_from = seen_from(usual, hyper)
        return without, CameraBiasSearch(
            outcome="none", variety=speed_variety, seen_from=clear_from
        )
    # A noise that was estimated beside a bias may favour it, so the map without one is also tried
    # with that noise.
    now, usual = _beside_like_effects(fitted.state, [fitted.noise, without.noise], problem, throws)
    found = fitted.posterior.hyperparameters
    equations, before = now.equations(), usual.equations()
    plain = equations.optimise_hyperparameters(
        replace(found, bias_sd=0.0), scatter=found.scatter > 0.0
    )
    best = min(
        equations.minus_two_log_evidence(plain) + equations.constant,
        before.minus_two_log_evidence(hyper) + before.constant,
    )
    gain = best - equations.minus_two_log_evidence(found) - equations.constant
    declined = CameraBiasSearch(
        outcome="none", variety=speed_variety, seen_from=seen_from(equations, found), gain=gain
    )
    if gain < MIN_CAMERA_BIAS_GAIN and not force:
        return without, declined
    judged = now.state.throws
    halves = split_throws(np.array([k.speed for k in judged]), _directions(judged))
    like = likeness(equations, [now.equations_of(half) for half in halves], found)
    if like < MIN_HALVES_CORRELATION and not force:
        return without, replace(declined, likeness=like)
    return fitted, replace(declined, outcome="found", likeness=like, bias=fitted.state.bias)


def _fit_bias(
    start: FittedMap, problem: MapProblem, *, scatter: bool, progress: Progress
) -> FittedMap | None:
    """Map and bias of the camera together, from a map without one; None if there is none."""
    state, noise = start.state, start.noise
    gate = noise
    scatter = scatter and problem.earlier_throws + len(state.throws) >= 3
    hyper: Hyperparameters | None = None
    number = 0
    while True:
        state, linear = state.update_and_linearise(gate, noise)
        equations = assemble_equations(state, linear, problem)
        final = number == CAMERA_BIAS_ROUNDS - 1
        if hyper is None:
            near = replace(start.posterior.hyperparameters, bias_sd=USUAL_CAMERA_BIAS)
            hyper = equations.optimise_hyperparameters(near, scatter=scatter, coarse=True)
            if hyper.bias_sd >= MIN_CAMERA_BIAS:
                hyper = equations.initial_hyperparameters(
                    scatter=scatter, bias_sd=USUAL_CAMERA_BIAS
                )
        else:
            hyper = equations.optimise_hyperparameters(hyper, scatter=scatter, coarse=not final)
        if hyper.bias_sd < MIN_CAMERA_BIAS:
            return None
        posterior = equations.posterior(hyper, problem.observed.ravel())
        state = state.step(linear, posterior, problem).update(gate)
        number += 1
        progress("a bias of the camera", number / CAMERA_BIAS_ROUNDS)
        if final:
            return FittedMap(state=state, noise=noise, equations=equations, posterior=posterior)
        noise = gate = estimate_noise(
            kept_residuals(state.throws), longest=MAX_NOISE_TIME, start=noise
        )


def _directions(throws: Sequence[FittedThrow]) -> Floats:
    """Signs of the throws' travel along the sheet."""
    return np.array([np.sign(throw.inputs.path.heading[0, 1]) for throw in throws])


def _speed_variety(throws: Sequence[FittedThrow]) -> float:
    """How differently the throws passed the same places; see `camera_bias_evidence.variety`."""
    places: list[Floats] = []
    squares: list[Floats] = []
    for throw, direction in zip(throws, _directions(throws), strict=True):
        fitted = throw.measured - throw.residual
        onward = slice(None, None, int(direction))
        places.append(throw.inputs.path.at(fitted)[onward, 1])
        squares.append(direction * np.gradient(fitted, throw.t)[onward] ** 2)
    return variety(places, squares)


@dataclass(frozen=True, kw_only=True)
class _LinearSession:
    """All throws linearised with a bias of the camera and effects that resemble it free."""

    state: MapState
    linear: Sequence[LinearThrow]
    problem: MapProblem

    def equations(self) -> NormalEquations:
        """Normal equations of all throws, and of earlier ones."""
        return assemble_equations(self.state, self.linear, self.problem)

    def equations_of(self, throws: Sequence[int]) -> NormalEquations:
        """Normal equations of some of the throws, without earlier ones."""
        state = replace(self.state, throws=[self.state.throws[k] for k in throws])
        linear = [self.linear[k] for k in throws]
        return assemble_equations(state, linear, replace(self.problem, earlier=None))


def _beside_like_effects(
    state: MapState,
    noises: Sequence[Noise],
    problem: MapProblem,
    others: Sequence[FittedThrow] | None = None,
) -> list[_LinearSession]:
    """The throws of a map linearised once for each noise, effects that resemble a bias free.

    All are judged by the same rows: those kept here and, where `others` are given, also there.
    """
    free = with_camera_like_effects(state.free, state.throws)
    state = replace(state if others is None else state.with_common_rows(others), free=free)
    spacing = max(noise.spacing for noise in noises)
    return [
        _LinearSession(
            state=state, linear=state.linearise(replace(noise, spacing=spacing)), problem=problem
        )
        for noise in noises
    ]
