"""The whole ice from one session: its map and its effects, told from each other.

A map alone reads friction that falls with speed as ice that is heavy where stones are slow, and
effects fitted on top of such a map look smaller than they are, or hide. So what acts along the
travel is fitted together with the map (`inversion.refit`) and kept where the throws insist on it.
Discovery then asks what that ice still lacks: what acts across the travel, what belongs to one
stone, to a stretch of sheet, to the camera. Map and strengths are fitted once more with all of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.effects import catalogue
from curling_env.trajectory import Trajectory
from friction_estimation.discovery.discover import Discovery, discover
from friction_estimation.discovery.report import improved_ice
from friction_estimation.inversion import Estimate, estimate_ice

Tell = Callable[[str, float], None]
"""Called with what is being done and the part of it that is done, 0 to 1."""

ALONG = {
    "speed_dependent_friction": ("exponent",),
    "slope": ("y",),
    "air_drag": ("coefficient",),
    "time_drift": ("rate",),
}
"""Effects that slow a stone along its way wherever it is, and the parameter that shows them."""
INSISTS = 4.0
"""Standard errors from nothing at which an effect stays: four candidates are looked at."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WholeIce:
    """What a session told of its ice.

    Parameters
    ----------
    ice : map and effects
    along : effects kept in the first fit, their parameter over its standard error, by name
    dropped : the same of those that were not
    discovery : what the ice still lacked
    estimate : the last fit
    """

    ice: Ice
    along: dict[str, float]
    dropped: dict[str, float]
    discovery: Discovery
    estimate: Estimate


def understand_ice(
    tracks: Sequence[Trajectory],
    *,
    start: Ice | None = None,
    seed: int = 0,
    tell: Tell = lambda what, part: None,
) -> WholeIce:
    """Map and effects of the ice of a session.

    Parameters
    ----------
    tracks : of one session, in order of play
    start : sheet and stone; uniform Coulomb friction on the paper's sheet by default
    seed : of what discovery draws
    tell : of the progress

    Raises
    ------
    TrackTooShortError : no throw slides freely
    """
    base = Ice.uniform(0.0082) if start is None else start
    tell("map and effects along the travel", 0.0)
    fitted, along, dropped = _along_the_travel(tracks, base)
    tell("what it lacks", 0.4)
    found = discover(
        tracks, fitted.ice, seed=seed, progress=lambda what, part: tell(what, 0.4 + 0.5 * part)
    )
    lacked = improved_ice(found)
    kept = tuple(effect for effect in lacked.effects if effect.name in catalogue())
    tell("map and effects", 0.9)
    last = _estimate(tracks, replace(lacked, effects=kept))
    tell("map and effects", 1.0)
    return WholeIce(ice=last.ice, along=along, dropped=dropped, discovery=found, estimate=last)


def _along_the_travel(
    tracks: Sequence[Trajectory], base: Ice
) -> tuple[Estimate, dict[str, float], dict[str, float]]:
    """The map with those effects along the travel that the throws insist on."""
    cards = catalogue()
    candidates = [
        ActiveEffect(
            name=name, parameters={p.name: 0.0 for p in cards[name].parameters if p.neutral == 0.0}
        )
        for name in ALONG
        if base.effect(name) is None
    ]
    dropped: dict[str, float] = {}
    while True:
        fitted = _estimate(tracks, replace(base, effects=(*base.effects, *candidates)))
        shown = {effect.name: _shown(fitted.ice, effect.name) for effect in candidates}
        weak = min(shown, key=lambda name: abs(shown[name]), default=None)
        if weak is None or abs(shown[weak]) >= INSISTS:
            return fitted, shown, dropped
        dropped[weak] = shown[weak]
        candidates = [effect for effect in candidates if effect.name != weak]


def _estimate(tracks: Sequence[Trajectory], start: Ice) -> Estimate:
    return estimate_ice(tracks, start=start, refit=bool(start.effects))


def _shown(ice: Ice, name: str) -> float:
    """An effect's parameter in standard errors."""
    effect = ice.effect(name)
    assert effect is not None  # it was put there
    sizes = [
        effect.parameters[key] / effect.sigma[key] for key in ALONG[name] if effect.sigma.get(key)
    ]
    return max(sizes, key=abs, default=0.0)
