"""The map of ln μ, jointly with an offset of each throw and the effects that are free.

Every round rides all throws over the present map, gathers what they ask for about it, and steps to
the map of greatest posterior density (Gauss–Newton).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.inversion.information import Knowledge
from friction_estimation.inversion.level_fit import LONGEST_STEP, Progress
from friction_estimation.inversion.noise import Noise, estimate_noise
from friction_estimation.inversion.prior import Evidence, Posterior
from friction_estimation.inversion.throw.camera_bias import NO_BIAS, CameraBias
from friction_estimation.inversion.throw.fitted import (
    Ridden,
    move_release,
    residuals_of,
    ride_throw,
)
from friction_estimation.inversion.throw.forward import Track
from friction_estimation.inversion.throw.free_effects import FreeEffects
from friction_estimation.inversion.throw.linearised import LinearThrow, linearise

ROUNDS, REFIT_ROUNDS = 4, 6
"""Gauss–Newton rounds; the path is nearly linear in ln μ and two to four are enough, in the
parameters of effects less so."""
SLOWEST_NOISE = 0.5
"""Longest correlation time of noise beside a map [s]: what lasts longer belongs to the ice."""


@dataclass(frozen=True, kw_only=True)
class Sought:
    """The map that is sought, and what is known of it before these throws.

    Parameters
    ----------
    level : ln μ from which the map counts
    ground : (cells,) of ln μ above the level, about which it is believed to vary
    known : (cells,) its relative standard error; None where it is not a measured one
    observed : (rows, columns) cells that any throw crossed
    before : what earlier throws told
    """

    level: float
    ground: Floats
    known: Floats | None
    observed: NDArray[np.bool_]
    before: Knowledge | None = None

    @property
    def first(self) -> Floats:
        """The field to start from, (cells,)."""
        if self.before is None:
            return self.ground
        return np.log(self.before.mu.ravel()) - self.level

    @property
    def played(self) -> int:
        """How many throws are in what was told before."""
        return 0 if self.before is None else self.before.throws


@dataclass(frozen=True, kw_only=True)
class MapState:
    """Where a fit stands: that about which its next round is linear.

    Parameters
    ----------
    throws : as last ridden
    track : the law and the map that they ride on
    field : (cells,) of ln μ above the level of what is sought
    free : parameters of effects that are fitted
    bias : ripple of the camera
    """

    throws: Sequence[Ridden]
    track: Track
    field: Floats
    free: FreeEffects
    bias: CameraBias = NO_BIAS

    def linearise(self, gate: Noise, noise: Noise) -> tuple[MapState, list[LinearThrow]]:
        """The state with all throws ridden once more, and they linearised under the noise."""
        ridden = [ride_throw(throw, self.track, gate) for throw in self.throws]
        linear = [linearise(k, ride, self.track, noise, self.free, self.bias) for k, ride in ridden]
        return replace(self, throws=[throw for throw, _ in ridden]), linear

    def linear(self, noise: Noise) -> list[LinearThrow]:
        """All throws linearised as they are."""
        rides = [self.track.ride(k.passenger, k.start, k.speed, k.offset) for k in self.throws]
        return [
            linearise(throw, ride, self.track, noise, self.free, self.bias)
            for throw, ride in zip(self.throws, rides, strict=True)
        ]

    def kept_with(self, others: Sequence[Ridden]) -> MapState:
        """With those rows alone that are good in the same throws as another fit left them, too."""
        pairs = zip(self.throws, others, strict=True)
        return replace(self, throws=[replace(k, keep=k.keep & j.keep) for k, j in pairs])

    def ride(self, gate: Noise) -> MapState:
        """With the residuals and good rows of all throws up to date."""
        ridden = [ride_throw(throw, self.track, gate)[0] for throw in self.throws]
        return replace(self, throws=ridden)

    def step(self, linear: Sequence[LinearThrow], posterior: Posterior, sought: Sought) -> MapState:
        """One Gauss–Newton step of map, offsets, effects, ripple and releases."""
        change = posterior.field - self.field
        limit = min(1.0, LONGEST_STEP / max(float(np.abs(change).max()), 1e-9))
        effects = limit * (posterior.effects - self.free.values)
        ripple = limit * (posterior.ripple - self.bias.values)
        bias = replace(self.bias, values=self.bias.values + ripple, sigma=posterior.ripple_sigma)
        others = np.concatenate([effects, ripple])
        moved: list[Ridden] = []
        for k, throw in enumerate(self.throws):
            offset = throw.offset + limit * (posterior.offsets[sought.played + k] - throw.offset)
            own = limit * change[linear[k].crossed] + offset - throw.offset
            after = move_release(throw, linear[k].release_step(own, others), float(offset))
            ridden = throw.measured - throw.shift - throw.left
            seen = bias.seen_along(throw.passenger.course, ridden)
            moved.append(replace(after, shift=seen @ bias.values))
        field = self.field + limit * change
        free = self.free.at(self.free.values + effects)
        track = self.track.under(free.now).set_field(sought.level, field)
        return MapState(throws=moved, track=track, field=field, free=free, bias=bias)


@dataclass(frozen=True, kw_only=True)
class FittedMap:
    """A map as it was fitted: where the fit ended, and what it was told in its last round."""

    state: MapState
    noise: Noise
    evidence: Evidence
    posterior: Posterior


def fit_map(
    state: MapState, sought: Sought, one: Noise, *, scatter: bool, progress: Progress
) -> FittedMap:
    """The map of ln μ about the level, jointly with an offset of each throw and free effects.

    Parameters
    ----------
    state : from which to start
    sought : what is asked for, and known before
    one : the noise beside one friction for the sheet
    scatter : whether each throw may have a μ of its own about the ice's
    progress : told how far the fit is
    """
    scatter = scatter and sought.played + len(state.throws) >= 3
    fit = partial(_fit_rounds, state, sought, gate=one, scatter=scatter, progress=progress)
    if one.spacing == 0.0:
        return fit(Noise(white=float(np.median([throw.slide.noise for throw in state.throws]))))
    # The rows of a smoothed track differ by far less than they err: what one friction for the sheet
    # leaves of them is the first measure of their noise, and a map may not explain it all.
    varied = fit(Noise(white=one.total, spacing=one.spacing))
    # It may even explain next to nothing: the waves that a smoother leaves last for seconds, as
    # those do that uneven ice makes.
    even = fit(one, keep=True)
    spacing = max(varied.noise.spacing, even.noise.spacing)
    unlikely = [
        _unlikeliness(found, other.state.throws, spacing, sought, scatter=scatter)
        for found, other in ((varied, even), (even, varied))
    ]
    return varied if unlikely[0] <= unlikely[1] else even


def _fit_rounds(
    state: MapState,
    sought: Sought,
    noise: Noise,
    *,
    gate: Noise,
    scatter: bool,
    progress: Progress,
    keep: bool = False,
) -> FittedMap:
    """The map that is found from a first noise, which is estimated anew unless it is kept."""
    belief = None if sought.before is None else sought.before.belief
    rounds = REFIT_ROUNDS if len(state.free) else ROUNDS
    number = 0
    while True:
        state, linear = state.linearise(gate, noise)
        evidence = gather_evidence(state, linear, sought)
        final = number == rounds - 1
        if belief is None:
            belief = evidence.first_belief(scatter=scatter)
        elif final:
            belief = evidence.best_belief(belief, scatter=scatter)
        posterior = evidence.posterior(belief, sought.observed.ravel())
        state = state.step(linear, posterior, sought).ride(gate)
        number += 1
        progress("an even map" if keep else "the friction map", number / rounds)
        if final:
            return FittedMap(state=state, noise=noise, evidence=evidence, posterior=posterior)
        # After one round the path is still bent by its first linearisation: no noise yet.
        if 1 < number < rounds and not keep:
            noise = gate = estimate_noise(
                residuals_of(state.throws), slowest=SLOWEST_NOISE, start=noise
            )


def _unlikeliness(
    found: FittedMap, others: Sequence[Ridden], spacing: float, sought: Sought, *, scatter: bool
) -> float:
    """−2·ln of the evidence of a map and its noise.

    Parameters
    ----------
    others : the same throws as another fit left them, whose good rows are asked for too
    spacing : between the rows that are asked, alike for all maps that are compared [s]
    """
    state = found.state.kept_with(others)
    linear = state.linear(replace(found.noise, spacing=spacing))
    evidence = gather_evidence(state, linear, sought)
    belief = evidence.best_belief(found.posterior.belief, scatter=scatter)
    return evidence.misfit(belief) + evidence.constant


def gather_evidence(state: MapState, linear: Sequence[LinearThrow], sought: Sought) -> Evidence:
    """Normal equations of all throws in the cells crossed, the throws' offsets, free effects and
    the nodes of the camera's ripple.
    """
    before, field, free, bias = sought.before, state.field, state.free, state.bias
    cells = [part.crossed for part in linear]
    crossed = np.unique(np.concatenate(cells if before is None else [before.cells, *cells]))
    m = len(crossed)
    played = sought.played
    throw_end = m + played + len(linear)
    size = throw_end + len(free) + len(bias)
    information, pull = np.zeros((size, size)), np.zeros(size)
    asked = 0.0
    if before is not None:
        places = np.append(np.searchsorted(crossed, before.cells), m + np.arange(played))
        information[np.ix_(places, places)] = before.information
        pull[places] = before.pull
    for k, part in enumerate(linear):
        own = np.append(np.searchsorted(crossed, part.crossed), m + played + k)
        places = np.append(own, np.arange(throw_end, size))
        columns = np.column_stack([part.friction, part.friction.sum(axis=1), part.effects])
        present = np.concatenate(
            [field[part.crossed], [state.throws[k].offset], free.values, bias.values]
        )
        square = columns.T @ columns
        information[np.ix_(places, places)] += square
        pull[places] += columns.T @ part.left + square @ present
        goal = part.left + columns @ present
        asked += float(goal @ goal) + part.volume
    return Evidence(
        information, pull, crossed, state.track.ice.sheet, ground=sought.ground, known=sought.known,
        effects=len(free), nodes=bias.nodes, asked=asked,
    )  # fmt: skip
