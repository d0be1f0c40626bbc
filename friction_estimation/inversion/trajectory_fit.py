"""Friction by matching trajectories: all throws and all cells at once.

Each throw follows its measured path under the force law. Its start and speed are its own and are
projected out. What remains of the residuals is explained by the friction of the cells, jointly for
all throws, under a smooth prior and with noise estimated from the residuals. The motion is exact,
and is repeated about each new estimate (Gauss–Newton). The effects of the starting ice stay in the
law throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from curling_env.ice import FrictionMap, Ice
from curling_env.typing import Progress, no_progress
from friction_estimation.inversion.friction.information import StoredInformation
from friction_estimation.inversion.friction.map_fit import FittedMap, MapProblem, MapState, fit_map
from friction_estimation.inversion.friction.uniform_fit import UniformFit, fit_uniform
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.systematic.camera_bias_evidence import CameraBiasSearch
from friction_estimation.inversion.systematic.camera_bias_fit import search_camera_bias
from friction_estimation.inversion.systematic.stated_error import error_of_level, error_of_map
from friction_estimation.inversion.throw.fitted import (
    FittedThrow,
    crossed_cells,
    initial_level,
    initialise_throw,
)
from friction_estimation.inversion.throw.forward import LawOnMap
from friction_estimation.inversion.throw.free_effects import no_effects
from friction_estimation.tracks.free_slide import FreeSlide

CameraBiasChoice = Literal["auto", "on", "off"]


@dataclass(frozen=True, kw_only=True)
class TrajectoryFit:
    """The result of a trajectory fit.

    Parameters
    ----------
    ice : the estimate; effects of the start kept
    mu, sigma : level of μ over the crossed cells and its standard error
    scatter : standard deviation of ln μ from throw to throw
    noise : noise of a measured distance
    throws : throws as fitted
    resolved : number of independent numbers that the data determine in the map; 1 for one friction
    information : information to which later throws can be added; holds the hyperparameters
    bias_search : result of the search for a bias of the camera; None without a search
    """

    ice: Ice
    mu: float
    sigma: float
    scatter: float
    noise: Noise
    throws: tuple[FittedThrow, ...]
    resolved: float
    information: StoredInformation
    bias_search: CameraBiasSearch | None = None


def fit_trajectories(
    slides: Sequence[FreeSlide],
    start: Ice,
    *,
    uniform: bool = False,
    scatter: bool = True,
    prior: FrictionMap | None = None,
    earlier: StoredInformation | None = None,
    camera_bias: CameraBiasChoice = "off",
    progress: Progress = no_progress,
) -> TrajectoryFit:
    """Estimate the friction of an ice from the free slides of its throws.

    Parameters
    ----------
    slides : free slides in order of play
    start : sheet, stone, effects and a first guess of the friction
    uniform : whether to fit one μ instead of a map
    scatter : whether each throw may have a μ of its own about the ice's
    prior : an earlier map of this sheet; its pattern holds within its sigma and what the throws
        show to have changed, its level need not
    earlier : information of earlier throws on the ice, to which these are added
    camera_bias : when to fit a bias of the camera with the map: ``auto``, if the throws clearly
        show one; ``on``, if they could show one; ``off``, never
    progress : called as the fit advances
    """
    # The matrices are too small to share: more threads of linear algebra only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        law = LawOnMap.of(start)
        before = 0 if earlier is None else earlier.throws
        throws = [initialise_throw(slide, before + order) for order, slide in enumerate(slides)]
        level = float(np.median([initial_level(throw, start) for throw in throws]))
        one = fit_uniform(throws, law, level, scatter, earlier if uniform else None, progress)
        if uniform:
            return _uniform_result(one, earlier)
        problem = _map_problem(one, start, prior, earlier)
        free = no_effects(start)
        field = problem.first_field
        law = law.with_field(problem.level, field)
        state = MapState(throws=one.throws, law=law, field=field, free=free)
        found = fit_map(state, problem, one.noise, scatter=scatter, progress=progress)
        search: CameraBiasSearch | None = None
        if camera_bias != "off":
            found, search = search_camera_bias(
                found, problem, scatter=scatter, force=camera_bias == "on", progress=progress
            )
        return replace(_map_result(found, problem, start), bias_search=search)


def _uniform_result(one: UniformFit, earlier: StoredInformation | None) -> TrajectoryFit:
    """The result of a fit of one friction."""
    start = one.law.ice
    mu = float(np.exp(one.level))
    systematic = error_of_level(one, earlier)
    sigma = one.sigma
    if systematic is not None:
        weights = 1.0 / (1.0 / one.information + one.scatter**2)
        share = (weights / weights.sum()) @ (systematic / one.information[:, None])
        sigma = float(np.hypot(sigma, np.linalg.norm(share)))
    friction = FrictionMap.uniform(mu, start.sheet, sigma=mu * sigma)
    return TrajectoryFit(
        ice=replace(start, friction=friction),
        mu=mu,
        sigma=mu * sigma,
        scatter=one.scatter,
        noise=one.noise,
        throws=tuple(one.throws),
        resolved=1.0,
        information=StoredInformation(
            reference=0.0,
            cells=np.empty(0, dtype=np.intp),
            matrix=np.diag(one.information),
            vector=one.vector,
            observed=friction.observed,
            mu=friction.mu,
            noise=one.noise,
            hyperparameters=None,
            systematic=systematic,
        ),
    )


def _map_problem(
    one: UniformFit, start: Ice, prior: FrictionMap | None, earlier: StoredInformation | None
) -> MapProblem:
    """The map that is asked for after one friction was fitted."""
    observed = crossed_cells(one.throws, start)
    zero = np.zeros(observed.size)
    if earlier is not None:
        return MapProblem(
            level=earlier.reference,
            prior_mean=zero if earlier.prior_mean is None else earlier.prior_mean,
            prior_sd=earlier.prior_sd,
            observed=observed | earlier.observed,
            earlier=earlier,
        )
    if prior is None:
        return MapProblem(level=one.level, prior_mean=zero, prior_sd=None, observed=observed)
    mean = np.log(prior.mu.ravel())
    mean -= mean[observed.ravel()].mean()
    sd = (prior.sigma / prior.mu).ravel()
    return MapProblem(level=one.level, prior_mean=mean, prior_sd=sd, observed=observed)


def _map_result(found: FittedMap, problem: MapProblem, start: Ice) -> TrajectoryFit:
    """The result of a fit of a map."""
    equations, posterior = found.equations, found.posterior
    systematic = error_of_map(found, problem)
    if systematic is not None:
        posterior = equations.with_systematic_error(posterior, systematic, problem.observed.ravel())
    free, hyper = found.state.free, posterior.hyperparameters
    matrix, vector, systematic = equations.without_effects(free.values, hyper, systematic)
    shape = start.sheet.shape
    cells = np.exp(problem.level + posterior.field.reshape(shape))
    friction = replace(
        start.friction,
        mu=cells,
        sigma=cells * posterior.field_sigma.reshape(shape),
        observed=problem.observed,
    )
    mu = float(np.exp(problem.level + posterior.level))
    return TrajectoryFit(
        ice=replace(start, friction=friction, effects=free.fitted_effects(posterior.effects_sigma)),
        mu=mu,
        sigma=mu * posterior.level_sigma,
        scatter=hyper.scatter,
        noise=found.noise,
        throws=tuple(found.state.throws),
        resolved=posterior.resolved,
        information=StoredInformation(
            reference=problem.level,
            cells=equations.cells,
            matrix=matrix,
            vector=vector,
            observed=problem.observed,
            mu=cells,
            noise=found.noise,
            hyperparameters=replace(hyper, bias_sd=0.0),  # another session, another camera bias
            prior_mean=None if problem.prior_sd is None else problem.prior_mean,
            prior_sd=problem.prior_sd,
            systematic=systematic,
        ),
    )
