"""The map and the effects of one session's ice, estimated jointly.

A map alone reads friction that falls with speed as ice that is heavy where stones are slow, and
effects that are fitted on top of such a map look too small, or hide. So the effects that a map
would absorb are fitted together with it, and kept where the throws clearly show them. Discovery
then finds what that ice still lacks: effects across the travel, of one stone, of a stretch of the
sheet, of the camera. At last the map and all strengths are fitted once more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.effects import catalogue, mistaken_for
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress, no_progress, part_of_progress
from friction_estimation.discovery.discover import Discovery, discover
from friction_estimation.discovery.tuning import CLEARLY_SHOWN
from friction_estimation.inversion import Estimate, estimate_ice


@dataclass(frozen=True, kw_only=True, eq=False)
class JointEstimate:
    """The map and the effects of a session's ice.

    Parameters
    ----------
    ice : map and effects
    along : for each effect that was kept in the first fit, its parameter over its standard error
    dropped : the same for those that were not kept
    discovery : what the ice of the first fit lacked
    estimate : last fit
    """

    ice: Ice
    along: dict[str, float]
    dropped: dict[str, float]
    discovery: Discovery
    estimate: Estimate


def estimate_jointly(
    tracks: Sequence[Trajectory],
    *,
    start: Ice | None = None,
    seed: int = 0,
    progress: Progress = no_progress,
) -> JointEstimate:
    """Estimate the map and the effects of a session's ice.

    Parameters
    ----------
    tracks : throws of one session, in order of play
    start : sheet and stone; uniform Coulomb friction on the paper's sheet by default
    seed : seed of discovery
    progress : progress

    Raises
    ------
    TrackTooShortError : no throw slides freely
    """
    base = Ice.uniform(0.0082) if start is None else start
    progress("map and effects along the travel", 0.0)
    fitted, along, dropped = _with_effects_like_maps(tracks, base)
    progress("what it lacks", 0.4)
    found = discover(
        tracks,
        fitted.ice,
        seed=seed,
        progress=part_of_progress(progress, 0.4, 0.9),
    )
    lacked = found.improved_ice()
    cards = catalogue()
    kept = tuple(e for e in lacked.effects if e.name in cards and cards[e.name].is_physical)
    progress("map and effects", 0.9)
    last = _estimate(tracks, replace(lacked, effects=kept))
    progress("map and effects", 1.0)
    return JointEstimate(ice=last.ice, along=along, dropped=dropped, discovery=found, estimate=last)


def _with_effects_like_maps(
    tracks: Sequence[Trajectory], base: Ice
) -> tuple[Estimate, dict[str, float], dict[str, float]]:
    """The map with those effects it would absorb that the throws clearly show."""
    candidates = [
        ActiveEffect(name=card.name, parameters=card.neutral)
        for card in mistaken_for("map")
        if base.effect(card.name) is None
    ]
    dropped: dict[str, float] = {}
    while True:
        fitted = _estimate(tracks, replace(base, effects=(*base.effects, *candidates)))
        shown = {effect.name: _shown(fitted.ice, effect.name) for effect in candidates}
        weak = min(shown, key=lambda name: abs(shown[name]), default=None)
        if weak is None or abs(shown[weak]) >= CLEARLY_SHOWN:
            return fitted, shown, dropped
        dropped[weak] = shown[weak]
        candidates = [effect for effect in candidates if effect.name != weak]


def _estimate(tracks: Sequence[Trajectory], start: Ice) -> Estimate:
    return estimate_ice(tracks, start=start, refit=bool(start.effects))


def _shown(ice: Ice, name: str) -> float:
    """An effect's parameter in standard errors; the largest one if several were fitted."""
    effect = ice.effect(name)
    assert effect is not None  # it was put there
    sizes = [
        effect.parameters[key] / effect.sigma[key]
        for key in catalogue()[name].neutral
        if effect.sigma.get(key)
    ]
    return max(sizes, key=abs, default=0.0)
