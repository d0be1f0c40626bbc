"""The map of ln μ, fitted jointly with an offset of each throw and the effects that are free.

Every round follows all throws over the present map, collects their normal equations, and steps to
the map of greatest posterior density (Gauss–Newton).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from curling_env.typing import Flags, Floats, Progress
from friction_estimation.inversion.friction.information import StoredInformation
from friction_estimation.inversion.friction.posterior import NormalEquations, Posterior
from friction_estimation.inversion.noise import Noise, estimate_noise
from friction_estimation.inversion.throw.camera_bias import NO_BIAS, CameraBias
from friction_estimation.inversion.throw.fitted import (
    FittedThrow,
    kept_residuals,
    move_release,
    update_residual,
)
from friction_estimation.inversion.throw.forward import LawOnMap, PathMotion
from friction_estimation.inversion.throw.free_effects import FreeEffects
from friction_estimation.inversion.throw.linearised import LinearThrow, linearise
from friction_estimation.inversion.tuning import (
    MAP_AND_EFFECTS_ROUNDS,
    MAP_ROUNDS,
    MAX_LOG_STEP,
    MAX_NOISE_TIME,
)


@dataclass(frozen=True, kw_only=True)
class MapProblem:
    """The map that is asked for, and what is known of it before these throws.

    Parameters
    ----------
    level : ln μ from which the map is counted
    prior_mean : (cells,) prior mean of ln μ above the level
    prior_sd : (cells,) relative standard error of an earlier map; None without one
    observed : (rows, columns) cells that any throw crossed
    earlier : information of throws that were fitted before
    """

    level: float
    prior_mean: Floats
    prior_sd: Floats | None
    observed: Flags
    earlier: StoredInformation | None = None

    @property
    def first_field(self) -> Floats:
        """The field to start from, (cells,)."""
        if self.earlier is None:
            return self.prior_mean
        return np.log(self.earlier.mu.ravel()) - self.level

    @property
    def earlier_throws(self) -> int:
        """Number of throws that were fitted before."""
        return 0 if self.earlier is None else self.earlier.throws


@dataclass(frozen=True, kw_only=True)
class MapState:
    """Present state of a fit, about which its next round is linear.

    Parameters
    ----------
    throws : throws with their present start, speed and residuals
    law : law on the present map
    field : (cells,) ln μ above the level of the problem
    free : parameters of effects that are fitted
    bias : bias of the camera
    """

    throws: Sequence[FittedThrow]
    law: LawOnMap
    field: Floats
    free: FreeEffects
    bias: CameraBias = NO_BIAS

    def update(self, gate: Noise) -> MapState:
        """The state with new residuals and kept rows of all throws."""
        throws = [update_residual(throw, self.law, gate)[0] for throw in self.throws]
        return replace(self, throws=throws)

    def update_and_linearise(self, gate: Noise, noise: Noise) -> tuple[MapState, list[LinearThrow]]:
        """The updated state, and its throws linearised under a noise."""
        updated = [update_residual(throw, self.law, gate) for throw in self.throws]
        linear = [self._linearise(throw, motion, noise) for throw, motion in updated]
        return replace(self, throws=[throw for throw, _ in updated]), linear

    def linearise(self, noise: Noise) -> list[LinearThrow]:
        """All throws linearised as they are."""
        motions = [self.law.integrate(k.inputs, k.start, k.speed, k.offset) for k in self.throws]
        return [
            self._linearise(throw, motion, noise)
            for throw, motion in zip(self.throws, motions, strict=True)
        ]

    def _linearise(self, throw: FittedThrow, motion: PathMotion, noise: Noise) -> LinearThrow:
        return linearise(throw, motion, self.law, noise, self.free, self.bias)

    def with_common_rows(self, others: Sequence[FittedThrow]) -> MapState:
        """The state with only those rows that another fit of the same throws kept, too."""
        pairs = zip(self.throws, others, strict=True)
        return replace(self, throws=[replace(k, keep=k.keep & j.keep) for k, j in pairs])

    def step(
        self, linear: Sequence[LinearThrow], posterior: Posterior, problem: MapProblem
    ) -> MapState:
        """One Gauss–Newton step of map, offsets, effects, bias and releases."""
        change = posterior.field - self.field
        limit = min(1.0, MAX_LOG_STEP / max(float(np.abs(change).max()), 1e-9))
        effects = limit * (posterior.effects - self.free.values)
        by_bias = limit * (posterior.bias - self.bias.values)
        bias = replace(self.bias, values=self.bias.values + by_bias, sigma=posterior.bias_sigma)
        others = np.concatenate([effects, by_bias])
        moved: list[FittedThrow] = []
        for k, throw in enumerate(self.throws):
            found = posterior.offsets[problem.earlier_throws + k]
            offset = throw.offset + limit * (found - throw.offset)
            own = limit * change[linear[k].crossed] + offset - throw.offset
            after = move_release(throw, linear[k].release_step(own, others), float(offset))
            fitted = throw.measured - throw.shift - throw.residual
            columns = bias.along_path(throw.inputs.path, fitted)
            moved.append(replace(after, shift=columns @ bias.values))
        field = self.field + limit * change
        free = self.free.with_values(self.free.values + effects)
        law = self.law.with_effects(free.current).with_field(problem.level, field)
        return MapState(throws=moved, law=law, field=field, free=free, bias=bias)


@dataclass(frozen=True, kw_only=True)
class FittedMap:
    """A map as it was fitted.

    Parameters
    ----------
    state : state in which the fit ended
    noise : noise of a measured distance
    equations, posterior : normal equations of the last round, and the posterior that followed
    """

    state: MapState
    noise: Noise
    equations: NormalEquations
    posterior: Posterior


def fit_map(
    state: MapState,
    problem: MapProblem,
    uniform_noise: Noise,
    *,
    scatter: bool,
    progress: Progress,
) -> FittedMap:
    """The map of ln μ, jointly with an offset of each throw and free effects.

    Parameters
    ----------
    state : state from which to start
    problem : map that is asked for
    uniform_noise : noise that remains beside one friction for the sheet
    scatter : whether each throw may have a μ of its own about the ice's
    progress : called after every round
    """
    scatter = scatter and problem.earlier_throws + len(state.throws) >= 3
    fit = partial(
        _fit_rounds, state, problem, gate=uniform_noise, scatter=scatter, progress=progress
    )
    if uniform_noise.spacing == 0.0:
        return fit(Noise(white=float(np.median([throw.slide.noise for throw in state.throws]))))
    # Neighbouring rows of a smoothed track differ by far less than they err. The first measure of
    # their noise is what one friction for the sheet leaves of them, and a map may not explain all
    # of that.
    varied = fit(Noise(white=uniform_noise.total, spacing=uniform_noise.spacing))
    # It may even explain next to nothing: the waves that a smoother leaves last for seconds, like
    # those of uneven ice.
    even = fit(uniform_noise, keep_noise=True)
    spacing = max(varied.noise.spacing, even.noise.spacing)
    scores = [
        _minus_two_log_evidence(found, other.state.throws, spacing, problem, scatter=scatter)
        for found, other in ((varied, even), (even, varied))
    ]
    return varied if scores[0] <= scores[1] else even


def _fit_rounds(
    state: MapState,
    problem: MapProblem,
    noise: Noise,
    *,
    gate: Noise,
    scatter: bool,
    progress: Progress,
    keep_noise: bool = False,
) -> FittedMap:
    """The map found from a first noise, which is estimated anew unless it is kept."""
    hyper = None if problem.earlier is None else problem.earlier.hyperparameters
    rounds = MAP_AND_EFFECTS_ROUNDS if len(state.free) else MAP_ROUNDS
    number = 0
    while True:
        state, linear = state.update_and_linearise(gate, noise)
        equations = assemble_equations(state, linear, problem)
        final = number == rounds - 1
        if hyper is None:
            hyper = equations.initial_hyperparameters(scatter=scatter)
        elif final:
            hyper = equations.optimise_hyperparameters(hyper, scatter=scatter)
        posterior = equations.posterior(hyper, problem.observed.ravel())
        state = state.step(linear, posterior, problem).update(gate)
        number += 1
        progress("an even map" if keep_noise else "the friction map", number / rounds)
        if final:
            return FittedMap(state=state, noise=noise, equations=equations, posterior=posterior)
        # After one round the path is still bent by its first linearisation, and hides the noise.
        if 1 < number < rounds and not keep_noise:
            noise = gate = estimate_noise(
                kept_residuals(state.throws), longest=MAX_NOISE_TIME, start=noise
            )


def _minus_two_log_evidence(
    found: FittedMap,
    others: Sequence[FittedThrow],
    spacing: float,
    problem: MapProblem,
    *,
    scatter: bool,
) -> float:
    """−2·ln of the evidence of a map and its noise.

    Parameters
    ----------
    found : the map
    others : the same throws in another fit; only rows that both fits kept count
    spacing : distance in time between the rows that count, the same for all maps compared [s]
    """
    state = found.state.with_common_rows(others)
    linear = state.linearise(replace(found.noise, spacing=spacing))
    equations = assemble_equations(state, linear, problem)
    hyper = equations.optimise_hyperparameters(found.posterior.hyperparameters, scatter=scatter)
    return equations.minus_two_log_evidence(hyper) + equations.constant


def assemble_equations(
    state: MapState, linear: Sequence[LinearThrow], problem: MapProblem
) -> NormalEquations:
    """Normal equations of all throws in crossed cells, offsets, free effects and camera bias."""
    earlier, field, free, bias = problem.earlier, state.field, state.free, state.bias
    cells = [part.crossed for part in linear]
    crossed = np.unique(np.concatenate(cells if earlier is None else [earlier.cells, *cells]))
    m = len(crossed)
    throws_before = problem.earlier_throws
    throw_end = m + throws_before + len(linear)
    size = throw_end + len(free) + len(bias)
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    square = 0.0
    if earlier is not None:
        places = np.append(np.searchsorted(crossed, earlier.cells), m + np.arange(throws_before))
        matrix[np.ix_(places, places)] = earlier.matrix
        vector[places] = earlier.vector
    for k, part in enumerate(linear):
        own = np.append(np.searchsorted(crossed, part.crossed), m + throws_before + k)
        places = np.append(own, np.arange(throw_end, size))
        columns = np.column_stack([part.friction, part.friction.sum(axis=1), part.effects])
        present = np.concatenate(
            [field[part.crossed], [state.throws[k].offset], free.values, bias.values]
        )
        product = columns.T @ columns
        matrix[np.ix_(places, places)] += product
        vector[places] += columns.T @ part.residual + product @ present
        goal = part.residual + columns @ present
        square += float(goal @ goal) + part.log_volume
    return NormalEquations(
        matrix,
        vector,
        crossed,
        state.law.ice.sheet,
        prior_mean=problem.prior_mean,
        prior_sd=problem.prior_sd,
        effects=len(free),
        nodes=bias.nodes,
        square=square,
    )
