"""The whole ice of a session: its friction map and its effects, each with a standard error.

What the ice of every rink has (friction that follows the speed, curl, a drag of the spin) is
believed beforehand, with the spread that rinks have, and fitted together with the map. What else
the throws prove is added as discovery adds it. A few throws one way therefore give an ice that
curls; what they did not measure is marked as believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from threadpoolctl import threadpool_limits

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.effects import catalogue
from curling_env.physics.state import State
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Progress, no_progress, part_of_progress
from friction_estimation.camera.scene import Scene
from friction_estimation.discovery.data.session import Session, open_session
from friction_estimation.discovery.discover import Discovery, search_session
from friction_estimation.discovery.evidence.intervals import level_error
from friction_estimation.discovery.model.baseline import base_model
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.friction_field import CARD as MAP_CARD
from friction_estimation.discovery.model.friction_field import field_along
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.search.selection import fit_with_noise
from friction_estimation.discovery.tuning import USUAL_MAP_SHAPE
from friction_estimation.inversion.estimate import Estimate, estimate_friction
from friction_estimation.inversion.friction.posterior import Hyperparameters
from friction_estimation.inversion.noise import Noise
from friction_estimation.tracks.free_slide import free_slides

EffectsChoice = Literal["all", "none"]


@dataclass(frozen=True, kw_only=True)
class WholeIce(Estimate):
    """An ice with map and effects, as throws show it.

    Parameters
    ----------
    discovery : the inference behind it: the fitted model, its errors, and what stayed open
    """

    discovery: Discovery

    @property
    def hyperparameters(self) -> Hyperparameters | None:
        """Hyperparameters of the map's prior, chosen by the data."""
        field = self.discovery.final.model.map_field
        if field is None:
            return None
        return Hyperparameters(
            spread=field.amplitude,
            length=field.length,
            scatter=self.scatter,
            smoothness=field.smoothness,
        )

    @property
    def leftovers(self) -> list[tuple[Floats, Floats]]:
        """For each throw the times of its fitted rows [s] and what is left along its travel [m]."""
        found = self.discovery.final
        out: list[tuple[Floats, Floats]] = []
        for i in range(len(found.session)):
            rows = found.session.rows(i)
            velocity = found.predicted[rows, State.VX : State.VY + 1]
            travel = velocity / np.maximum(np.hypot(*velocity.T), 1e-6)[:, None]
            along = (found.residuals[rows, :2] * travel).sum(axis=1)
            out.append((found.session.times[rows], along))
        return out

    def _each(self) -> list[dict[str, Any]]:
        found = self.discovery.final
        places = {int(throw): i for i, throw in enumerate(found.session.throws)}
        each: list[dict[str, Any]] = []
        for entry in super()._each():
            i = places.get(entry["throw"])
            if i is not None:
                rows, state = found.session.rows(i), found.states[i]
                entry["speed"] = float(np.hypot(state[State.VX], state[State.VY]))
                entry["mu_factor"] = float(np.exp(found.ln_factors[i]))
                entry["rms_m"] = float(np.sqrt(np.nanmean(found.residuals[rows, :2] ** 2)))
            each.append(entry)
        return each


def estimate_ice(
    tracks: Sequence[Trajectory],
    *,
    effects: EffectsChoice = "all",
    start: Ice | None = None,
    uniform: bool = False,
    scene: Scene | None = None,
    seed: int = 0,
    progress: Progress = no_progress,
) -> Estimate:
    """Estimate an ice from the tracks of throws on it: friction per cell, curl, and the rest.

    The tracks may come straight from `curling_env.read_tracks` or from `track_film`. Every number
    comes with a standard error; what the throws did not measure is marked as believed.

    Parameters
    ----------
    tracks : tracks of one session, in order of play; lead-in, rest and wild rows are found and left
        out
    effects : ``all``, the map together with the effects; ``none``, the map alone, the effects of
        `start` being known
    start : sheet and stone, and effects that are expected about their values; the paper's sheet by
        default
    uniform : whether one μ for the sheet is wanted instead of a map; it goes with no effects
    scene : scene of the camera that filmed the tracks, where it is known
    seed : seed of the choice of held-out throws and of permutations
    progress : called as the fit advances

    Raises
    ------
    TrackTooShortError : no throw has a free slide that is long enough
    InputError : tracks that lie off the sheet, an effect that is not known
    """
    if effects == "none" or uniform:
        return estimate_friction(tracks, start=start, uniform=uniform, progress=progress)
    return fit_whole_ice(tracks, start=start, scene=scene, seed=seed, progress=progress)


def fit_whole_ice(
    tracks: Sequence[Trajectory],
    *,
    start: Ice | None = None,
    scene: Scene | None = None,
    seed: int = 0,
    progress: Progress = no_progress,
) -> WholeIce:
    """Estimate the friction map and all effects of an ice together.

    Parameters
    ----------
    tracks : tracks of one session, in order of play
    start : sheet and stone, and effects that are expected about their values; the paper's sheet by
        default
    scene : scene of the camera that filmed the tracks, where it is known
    seed : seed of the choice of held-out throws and of permutations
    progress : called as the fit advances

    Raises
    ------
    TrackTooShortError : no throw slides freely
    InputError : tracks that lie off the sheet, an effect that is not known
    """
    start = Ice.uniform(0.0082) if start is None else start
    progress("reading tracks", 0.0)
    session = open_session(tracks, scene)
    model = believed_model(start, session)
    if not session.turns.any():
        session = session.with_spins_by_bends()
    progress("map and effects together", 0.1)
    with threadpool_limits(limits=1, user_api="blas"):
        everything = fit_with_noise(model, session)
        found = search_session(
            everything, np.random.default_rng(seed), part_of_progress(progress, 0.2, 1.0)
        )
    return _as_estimate(found, tracks)


def believed_model(start: Ice, session: Session) -> Model:
    """The model of an ice as rinks have it: with a map, and with the effects that every ice has.

    Parameters
    ----------
    start : ice whose own effects take the place of the usual ones
    session : throws that the model will be fitted to
    """
    usual = tuple(
        ActiveEffect(name=card.name, parameters=card.usual)
        for card in catalogue().values()
        if card.usual and start.effect(card.name) is None
    )
    model = base_model(replace(start, effects=(*start.effects, *usual)), session)
    paths = [session.xy[session.rows(i)] for i in range(len(session))]
    field = field_along(start.sheet, paths, *USUAL_MAP_SHAPE)
    return model.with_terms(Term(card=MAP_CARD, map_field=field))


def _as_estimate(found: Discovery, tracks: Sequence[Trajectory]) -> WholeIce:
    """A discovery as the estimate of an ice."""
    slides, skipped = free_slides(tracks)
    kept = set(found.session.throws.tolist()) | set(found.events)
    ice, final = found.improved_ice(), found.final
    field, noise = final.model.map_field, final.noise
    mu = float(np.exp(np.log(ice.friction.mu[ice.friction.observed]).mean()))
    slow = float(np.hypot(*noise.fading[:2]) / np.sqrt(2.0))
    return WholeIce(
        ice=ice,
        method="trajectory",
        uniform=False,
        mu=mu,
        sigma=mu * level_error(final),
        slides=tuple(slide for slide in slides if slide.track.throw in kept),
        skipped=(*skipped, *(r for r in found.session.left_out if r not in skipped)),
        scatter=final.model.spread,
        noise=Noise(
            white=float(np.hypot(*noise.white[:2]) / np.sqrt(2.0)),
            slow=slow,
            time=max(noise.memory[:2]),
        ),
        resolved=1.0 if field is None else _resolved(final.model, found),
        discovery=found,
    )


def _resolved(model: Model, found: Discovery) -> float:
    """Number of independent numbers that the data determine in the map."""
    field = model.map_field
    assert field is not None
    return float(((field.values / field.amplitude) ** 2).sum())
