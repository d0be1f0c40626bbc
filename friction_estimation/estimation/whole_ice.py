"""Ice of a session: its friction map and its effects, each with a standard error. The effects of
every rink (speed-dependent friction, curl, spin drag) have priors with the spread among rinks, and
are fitted together with the map.

Further effects that the throws prove are added as in discovery. A few throws in one direction
therefore give an ice that curls; parameters that they did not measure are marked as believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.physics.effects import catalogue
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Progress, no_progress, part_of_progress
from friction_estimation.camera.scene import Scene
from friction_estimation.discovery.data.gates import gate_slides
from friction_estimation.discovery.data.session import Session, open_session, refuse_too_many_cells
from friction_estimation.discovery.discover import Discovery, ice_of, search_session
from friction_estimation.discovery.model.baseline import base_model, first_friction
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.fit import SessionFit, singular_fit_refused
from friction_estimation.discovery.model.friction_field import CARD as MAP_CARD
from friction_estimation.discovery.model.friction_field import (
    crossed_by,
    field_along,
    fields_to_try,
)
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.search.maps import renew_map
from friction_estimation.discovery.search.ripple import RippleSearch, find_ripple
from friction_estimation.discovery.search.selection import fit_with_noise
from friction_estimation.discovery.tuning import MAP_SHAPES
from friction_estimation.estimation.camera_bias import camera_bias_of
from friction_estimation.estimation.estimate import Estimate
from friction_estimation.tracks.free_slide import free_slides

EffectsChoice = Literal["all", "none"]
CameraBiasChoice = Literal["auto", "off"]
SIDEWAYS = "curl"
"""Effect that bends paths: free in a fit of friction alone, and excluded from its result."""


def estimate_ice(
    tracks: Sequence[Trajectory],
    *,
    effects: EffectsChoice = "all",
    start: Ice | None = None,
    uniform: bool = False,
    prior: Ice | None = None,
    camera_bias: CameraBiasChoice = "auto",
    scene: Scene | None = None,
    seed: int = 0,
    progress: Progress = no_progress,
) -> Estimate:
    """Estimate an ice from the tracks of throws on it: friction per cell, curl, and the rest.

    The tracks may come straight from `curling_env.read_tracks` or from `track_film`. Every number
    has a standard error; parameters that the throws did not measure are marked as believed.

    Parameters
    ----------
    tracks : tracks of one session, in order of play; lead-in, rest and wild rows are found and
        dropped
    effects : ``all``, the map together with the effects; ``none``, the friction alone, the effects
        of `start` being known
    start : sheet and stone, and effects that are expected about their values; the paper's sheet by
        default
    uniform : whether one μ for the sheet is wanted instead of a map; the effects of `start` are
        then taken as known
    prior : the ice of another day instead of `start`: its pattern holds within its sigma and what
        the throws show to have changed since, its level does not
    camera_bias : whether a smooth bias of the camera along the sheet is fitted with the map:
        ``auto``, if the throws clearly show one; ``off``, never
    scene : scene of the camera that filmed the tracks, where it is known
    seed : seed of the choice of held-out throws
    progress : called as the fit advances

    Raises
    ------
    TrackTooShortError : no throw has a free slide that is long enough
    InputError : tracks that lie off the sheet, an effect that is not known, or choices that do not
        go together
    FitError : throws to which no ice can be fitted
    """
    if prior is not None and (start is not None or uniform):
        raise InputError("expected one of a prior map, a uniform ice and another ice to start from")
    first = start or prior or Ice.uniform(0.0082)
    refuse_too_many_cells(first)
    from_map = prior is not None
    progress("reading tracks", 0.0)
    session = open_session(tracks, scene)
    if session.gates is None and not session.turns.any():
        session = session.with_spins_from_curvature()
    # The matrices are too small for several threads of linear algebra.
    with threadpool_limits(limits=1, user_api="blas"), singular_fit_refused():
        if effects == "none" or uniform:
            uniform = uniform or session.gates is not None
            model = known_effects_model(first, session, uniform=uniform, from_map=from_map)
            progress("friction of all throws together", 0.1)
            fitted, search = _fit(model, session, camera_bias, uniform=uniform)
            progress("standard errors", 0.9)
            ice = replace(ice_of(fitted), effects=first.effects, stone=first.stone)
            return _estimate(ice, fitted, search, tracks, uniform=uniform)
        if session.gates is not None:
            # One friction and its dependence on speed: gates do not show differences from place to
            # place.
            fitted = fit_with_noise(believed_model(first, session).without(MAP_CARD.name), session)
            return _estimate(ice_of(fitted), fitted, None, tracks, uniform=True)
        progress("map and effects together", 0.1)
        model = believed_model(first, session, from_map=from_map)
        fitted, search = _fit(model, session, camera_bias)
        found = search_session(
            fitted,
            np.random.default_rng(seed),
            part_of_progress(progress, 0.2, 1.0),
        )
        return _estimate(found.improved_ice(), found.final, search, tracks, discovery=found)


def _fit(
    model: Model, session: Session, camera_bias: CameraBiasChoice, *, uniform: bool = False
) -> tuple[SessionFit, RippleSearch | None]:
    """Fit a model with the most likely map, and with a bias of the camera if there is one."""
    fitted = fit_with_noise(model, session)
    if uniform:
        return fitted, None
    fitted = renew_map(fitted)
    if camera_bias == "off":
        return fitted, None
    search = find_ripple(fitted)
    if search.ripple is None:
        return fitted, search
    rippled = replace(fitted.model, ripple=search.ripple)
    return renew_map(fit_with_noise(rippled, session, fitted.noise)), search


def _estimate(
    ice: Ice,
    fitted: SessionFit,
    search: RippleSearch | None,
    tracks: Sequence[Trajectory],
    *,
    uniform: bool = False,
    discovery: Discovery | None = None,
) -> Estimate:
    """Return a fit as the estimate of an ice."""
    slides_of = free_slides if fitted.session.gates is None else gate_slides
    slides, skipped = slides_of(tracks)
    events = [] if discovery is None else discovery.events
    kept = {*fitted.session.throws.tolist(), *events}
    friction = ice.friction
    seen, level = friction.mu[friction.observed], friction.level
    assert level is not None  # of a fit
    mu = float(friction.mu.flat[0] if uniform else np.exp(np.log(seen).mean()))
    left_out = [reason for reason in fitted.session.left_out if reason not in skipped]
    return Estimate(
        ice=ice,
        method="trajectory",
        uniform=uniform,
        mu=mu,
        sigma=mu * (level.sigma or float("nan")),  # rounding has lost one of zero
        slides=tuple(slide for slide in slides if slide.track.throw in kept),
        skipped=(*skipped, *left_out),
        fit=fitted if discovery is None else discovery.seen,
        camera_bias=None if search is None else camera_bias_of(search, fitted),
        discovery=discovery,
    )


# --- models with which an estimate begins ---------------------------------------------------------


def believed_model(start: Ice, session: Session, *, from_map: bool = False) -> Model:
    """Return the usual model of a rink's ice: a map, and the effects of every ice.

    Parameters
    ----------
    start : ice whose own effects take the place of the usual ones
    session : throws that the model will be fitted to
    from_map : whether the map of `start` holds, but for what has changed since
    """
    usual = tuple(
        ActiveEffect(name=card.name, parameters=card.usual)
        for card in catalogue().values()
        if card.usual and start.effect(card.name) is None
    )
    ice = start if from_map else _level(start, session)
    model = base_model(replace(ice, effects=(*start.effects, *usual)), session)
    return _with_map(model, session, start if from_map else None)


def known_effects_model(
    start: Ice, session: Session, *, uniform: bool = False, from_map: bool = False
) -> Model:
    """Return the model of an ice with known effects and unknown friction.

    Parameters
    ----------
    start : ice whose effects stay as they are
    session, from_map : as of `believed_model`
    uniform : whether the friction is one number
    """
    bends = start.effect(SIDEWAYS) is None
    card = catalogue()[SIDEWAYS]
    beside = (ActiveEffect(name=SIDEWAYS, parameters=card.usual),) if bends else ()
    ice = start if from_map else _level(start, session)
    model = base_model(replace(ice, effects=(*start.effects, *beside)), session)
    held = tuple(
        replace(term, free=card.first if bends and term.name == SIDEWAYS else (), beliefs={})
        for term in model.terms
    )
    model = replace(model, terms=held)
    return model if uniform else _with_map(model, session, start if from_map else None)


def _level(start: Ice, session: Session) -> Ice:
    """Return the ice with a single friction, roughly that of the throws."""
    return replace(start, friction=FrictionMap.uniform(first_friction(session), start.sheet))


def _with_map(model: Model, session: Session, before: Ice | None) -> Model:
    """Return the model with a friction map, starting from an earlier ice if given."""
    paths, sheet = session.paths, model.ice.sheet
    if before is None:
        field = field_along(sheet, crossed_by(sheet, paths), *MAP_SHAPES[2])
    else:
        known: Floats = np.ravel(before.friction.sigma / before.friction.mu)
        tried = fields_to_try(sheet, paths, known)
        field = tried[len(tried) // 2]
    return model.with_terms(Term(card=MAP_CARD, map_field=field))
