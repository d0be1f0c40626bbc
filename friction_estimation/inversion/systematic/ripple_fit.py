"""A ripple of the camera, looked for beside the map and fitted with it where the throws show one.

How it is judged is in bias_search.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.inversion.level_fit import Progress
from friction_estimation.inversion.map_fit import (
    SLOWEST_NOISE,
    FittedMap,
    MapState,
    Sought,
    gather_evidence,
)
from friction_estimation.inversion.noise import Noise, estimate_noise
from friction_estimation.inversion.prior import Belief, Evidence
from friction_estimation.inversion.systematic.bias_search import (
    CLEAR_GAIN,
    CLEAR_LIKENESS,
    LEAST_RIPPLE,
    LEAST_THROWS,
    LEAST_VARIETY,
    BiasSearch,
    likeness,
    seen_from,
    split_throws,
    variety,
)
from friction_estimation.inversion.throw.camera_bias import USUAL_RIPPLE, bias_over
from friction_estimation.inversion.throw.fitted import Ridden, residuals_of
from friction_estimation.inversion.throw.free_effects import with_rivals
from friction_estimation.inversion.throw.linearised import LinearThrow

ROUNDS = 5
"""Gauss–Newton rounds of map and ripple together."""


def search_ripple(
    without: FittedMap, sought: Sought, *, scatter: bool, must: bool, progress: Progress
) -> tuple[FittedMap, BiasSearch]:
    """A ripple of the camera, looked for from the map that was fitted without one.

    Parameters
    ----------
    without : that map
    sought : what was asked for, and known before
    scatter : whether each throw may have a μ of its own about the ice's
    must : whether a ripple is fitted even where it is not clear that there is one
    progress : told how far the fit is

    Returns
    -------
    the map with the ripple, or the one without where none is fitted; and what came of it
    """
    throws, belief = without.state.throws, without.posterior.belief
    apart = _variety(throws)
    if len(throws) < LEAST_THROWS or apart < LEAST_VARIETY:
        return without, BiasSearch(outcome="inseparable", variety=apart)
    bias = bias_over([k.passenger.course.at(k.measured[k.keep])[:, 1] for k in throws])
    start = replace(without.state, bias=bias)
    other = _fit_ripple(replace(without, state=start), sought, scatter=scatter, progress=progress)
    if other is None:
        usual = _beside_rivals(start, [without.noise], sought)[0].all()
        clear_from = seen_from(usual, belief)
        return without, BiasSearch(outcome="none", variety=apart, seen_from=clear_from)
    # A noise that was estimated beside a ripple may favour it, so that a map without one is also
    # tried with that.
    now, usual = _beside_rivals(other.state, [other.noise, without.noise], sought, throws)
    found = other.posterior.belief
    evidence, before = now.all(), usual.all()
    plain = evidence.best_belief(replace(found, ripple=0.0), scatter=found.scatter > 0.0)
    best = min(evidence.misfit(plain) + evidence.constant, before.misfit(belief) + before.constant)
    gain = best - evidence.misfit(found) - evidence.constant
    declined = BiasSearch(
        outcome="none", variety=apart, seen_from=seen_from(evidence, found), gain=gain
    )
    if gain < CLEAR_GAIN and not must:
        return without, declined
    witnesses = now.state.throws
    halves = split_throws(np.array([k.speed for k in witnesses]), _directions(witnesses))
    like = likeness(evidence, [now.of(half) for half in halves], found)
    if like < CLEAR_LIKENESS and not must:
        return without, replace(declined, likeness=like)
    return other, replace(declined, outcome="found", likeness=like, bias=other.state.bias)


def _fit_ripple(
    start: FittedMap, sought: Sought, *, scatter: bool, progress: Progress
) -> FittedMap | None:
    """Map and ripple of the camera together, from a map without one; None if there is none."""
    state, noise = start.state, start.noise
    gate = noise
    scatter = scatter and sought.played + len(state.throws) >= 3
    belief: Belief | None = None
    number = 0
    while True:
        state, linear = state.linearise(gate, noise)
        evidence = gather_evidence(state, linear, sought)
        final = number == ROUNDS - 1
        if belief is None:
            near = replace(start.posterior.belief, ripple=USUAL_RIPPLE)
            belief = evidence.best_belief(near, scatter=scatter, coarse=True)
            if belief.ripple >= LEAST_RIPPLE:
                belief = evidence.first_belief(scatter=scatter, ripple=USUAL_RIPPLE)
        else:
            belief = evidence.best_belief(belief, scatter=scatter, coarse=not final)
        if belief.ripple < LEAST_RIPPLE:
            return None
        posterior = evidence.posterior(belief, sought.observed.ravel())
        state = state.step(linear, posterior, sought).ride(gate)
        number += 1
        progress("a ripple of the camera", number / ROUNDS)
        if final:
            return FittedMap(state=state, noise=noise, evidence=evidence, posterior=posterior)
        noise = gate = estimate_noise(
            residuals_of(state.throws), slowest=SLOWEST_NOISE, start=noise
        )


def _directions(throws: Sequence[Ridden]) -> Floats:
    """Signs of the throws' travel along the sheet."""
    return np.array([np.sign(throw.passenger.course.heading[0, 1]) for throw in throws])


def _variety(throws: Sequence[Ridden]) -> float:
    """How unlike the throws passed the same places; see `bias_search.variety`."""
    places: list[Floats] = []
    squares: list[Floats] = []
    for throw, way in zip(throws, _directions(throws), strict=True):
        ridden = throw.measured - throw.left
        onward = slice(None, None, int(way))
        places.append(throw.passenger.course.at(ridden)[onward, 1])
        squares.append(way * np.gradient(ridden, throw.t)[onward] ** 2)
    return variety(places, squares)


@dataclass(frozen=True, kw_only=True)
class _Witnesses:
    """Throws linearised with a camera's ripple free, and effects that bend throws in a like way."""

    state: MapState
    linear: Sequence[LinearThrow]
    sought: Sought

    def all(self) -> Evidence:
        """What all throws say."""
        return gather_evidence(self.state, self.linear, self.sought)

    def of(self, rows: Sequence[int]) -> Evidence:
        """What some of them say, forgetting earlier ones."""
        state = replace(self.state, throws=[self.state.throws[k] for k in rows])
        linear = [self.linear[k] for k in rows]
        return gather_evidence(state, linear, replace(self.sought, before=None))


def _beside_rivals(
    state: MapState,
    noises: Sequence[Noise],
    sought: Sought,
    others: Sequence[Ridden] | None = None,
) -> list[_Witnesses]:
    """The throws of a map as witnesses for a ripple of the camera, once for each noise.

    All are judged by the same rows: those kept here and, where `others` are given, there.
    """
    free = with_rivals(state.free, state.throws)
    state = replace(state if others is None else state.kept_with(others), free=free)
    spacing = max(noise.spacing for noise in noises)
    return [
        _Witnesses(state=state, linear=state.linear(replace(noise, spacing=spacing)), sought=sought)
        for noise in noises
    ]
