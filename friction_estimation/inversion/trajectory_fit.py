"""Friction by matching trajectories: all throws and all cells at once.

Each throw rides its measured course (course.py) under the force law (ride.py). Its start and speed
are its own and are projected out; what is left of the residuals is explained by the friction of
the cells, jointly for all throws, under a smooth prior (prior.py) and with noise estimated from
the residuals (noise.py). The ride is exact and is repeated about each new estimate (Gauss–Newton).

Source
------
Differentiating a track and averaging per cell loses a factor 2 to 18 against this; a joint fit
reaches the Cramér–Rao bound (bound.py). Effects of the starting ice stay in the law throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from curling_env.ice import FrictionMap, Ice
from friction_estimation.inversion.information import Knowledge
from friction_estimation.inversion.level_fit import OneFriction, Progress, fit_level
from friction_estimation.inversion.map_fit import FittedMap, MapState, Sought, fit_map
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.systematic.bias_search import BiasSearch
from friction_estimation.inversion.systematic.ripple_fit import search_ripple
from friction_estimation.inversion.systematic.shared_error import shared_by_level, shared_by_map
from friction_estimation.inversion.throw.fitted import (
    Ridden,
    board_throw,
    crossed_cells,
    first_level,
)
from friction_estimation.inversion.throw.forward import Track
from friction_estimation.inversion.throw.free_effects import free_effects, no_effects
from friction_estimation.tracks.kinematics import FreeSlide

CameraBiasChoice = Literal["auto", "on", "off"]


def _silent(_what: str, _part: float) -> None:
    pass


@dataclass(frozen=True, kw_only=True)
class Fit:
    """What a trajectory fit found.

    Parameters
    ----------
    ice : the estimate, effects of the start kept or refitted
    mu, sigma : level of μ over the crossed cells and its standard error
    scatter : standard deviation of ln μ from throw to throw
    noise : of a measured distance
    throws : as fitted
    resolved : independent numbers that the data determine in the map; 1 for a uniform ice
    knowledge : what the throws told, for later throws to add to; holds the prior's hyperparameters
    bias_search : what came of looking for a ripple of the camera; None where nobody looked
    """

    ice: Ice
    mu: float
    sigma: float
    scatter: float
    noise: Noise
    throws: tuple[Ridden, ...]
    resolved: float
    knowledge: Knowledge
    bias_search: BiasSearch | None = None


def fit_trajectories(
    slides: Sequence[FreeSlide],
    start: Ice,
    *,
    uniform: bool = False,
    scatter: bool = True,
    prior: FrictionMap | None = None,
    before: Knowledge | None = None,
    refit: bool = False,
    camera_bias: CameraBiasChoice = "off",
    progress: Progress = _silent,
) -> Fit:
    """Estimate the friction of an ice from the free slides of its throws.

    Parameters
    ----------
    slides : in order of play
    start : sheet, stone, effects and a first guess of the friction
    uniform : whether one μ is wanted instead of a map
    scatter : whether each throw may have a μ of its own about the ice's
    prior : an earlier map of this sheet: the pattern of its mu holds within its sigma and what
        the throws show to have changed; its level is not held to
    before : what earlier throws on the ice told: these throws are added to them
    refit : whether the strengths of the effects that act along the travel are fitted with the map
    camera_bias : whether a ripple of the camera is fitted with the map: ``auto``, if the throws
        clearly show one; ``on``, if they could show one; ``off``
    progress : told how far the fit is
    """
    # The matrices are too small to share: threads of the linear algebra only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        track = Track(start)
        played = 0 if before is None else before.throws
        throws = [board_throw(slide, played + order) for order, slide in enumerate(slides)]
        level = float(np.median([first_level(throw, start) for throw in throws]))
        one = fit_level(throws, track, level, scatter, before if uniform else None, progress)
        if uniform:
            return _as_level(one, track, before)
        sought = _sought(one, start, prior, before)
        free = free_effects(start, one.throws) if refit else no_effects(start)
        track.set_field(sought.level, sought.first)
        state = MapState(throws=one.throws, track=track, field=sought.first, free=free)
        found = fit_map(state, sought, one.noise, scatter=scatter, progress=progress)
        search: BiasSearch | None = None
        if camera_bias != "off":
            must = camera_bias == "on"
            found, search = search_ripple(
                found, sought, scatter=scatter, must=must, progress=progress
            )
        return replace(_as_map(found, sought, start), bias_search=search)


def _as_level(one: OneFriction, track: Track, before: Knowledge | None) -> Fit:
    """One friction for the sheet, as found."""
    start = track.ice
    mu = float(np.exp(one.level))
    shared = shared_by_level(one, track, before)
    sigma = one.sigma
    if shared is not None:
        weights = 1.0 / (1.0 / one.information + one.scatter**2)
        share = (weights / weights.sum()) @ (shared / one.information[:, None])
        sigma = float(np.hypot(sigma, np.linalg.norm(share)))
    friction = FrictionMap.uniform(mu, start.sheet, sigma=mu * sigma)
    return Fit(
        ice=replace(start, friction=friction),
        mu=mu,
        sigma=mu * sigma,
        scatter=one.scatter,
        noise=one.noise,
        throws=tuple(one.throws),
        resolved=1.0,
        knowledge=Knowledge(
            reference=0.0,
            cells=np.empty(0, dtype=np.intp),
            information=np.diag(one.information),
            pull=one.pull,
            observed=friction.observed,
            mu=friction.mu,
            noise=one.noise,
            belief=None,
            shared=shared,
        ),
    )


def _sought(
    one: OneFriction, start: Ice, prior: FrictionMap | None, before: Knowledge | None
) -> Sought:
    """The map that is asked for after one friction was found, and what is known of it."""
    observed = crossed_cells(one.throws, start)
    if before is not None:
        nothing = np.zeros(observed.size)
        return Sought(
            level=before.reference,
            ground=nothing if before.ground is None else before.ground,
            known=before.known,
            observed=observed | before.observed,
            before=before,
        )
    if prior is None:
        ground, known = np.zeros(observed.size), None
    else:
        ground = np.log(prior.mu.ravel())
        ground -= ground[observed.ravel()].mean()
        known = (prior.sigma / prior.mu).ravel()
    return Sought(level=one.level, ground=ground, known=known, observed=observed)


def _as_map(found: FittedMap, sought: Sought, start: Ice) -> Fit:
    """The map, as found."""
    evidence, posterior = found.evidence, found.posterior
    shared = shared_by_map(found, sought)
    if shared is not None:
        posterior = evidence.blurred(posterior, shared, sought.observed.ravel())
    free, belief = found.state.free, posterior.belief
    information, pull, shared = evidence.without_effects(free.values, belief, shared)
    shape = start.sheet.shape
    cells = np.exp(sought.level + posterior.field.reshape(shape))
    friction = replace(
        start.friction,
        mu=cells,
        sigma=cells * posterior.field_sigma.reshape(shape),
        observed=sought.observed,
    )
    mu = float(np.exp(sought.level + posterior.level))
    return Fit(
        ice=replace(start, friction=friction, effects=free.fitted(posterior.effects_sigma)),
        mu=mu,
        sigma=mu * posterior.level_sigma,
        scatter=belief.scatter,
        noise=found.noise,
        throws=tuple(found.state.throws),
        resolved=posterior.resolved,
        knowledge=Knowledge(
            reference=sought.level,
            cells=evidence.cells,
            information=information,
            pull=pull,
            observed=sought.observed,
            mu=cells,
            noise=found.noise,
            belief=replace(belief, ripple=0.0),  # the next session's camera is another
            ground=None if sought.known is None else sought.ground,
            known=sought.known,
            shared=shared,
        ),
    )
