"""Draws to the tee down the centre line of an ice: their weight and ice, compared with another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agents.coaching.lane_draws import LaneDraw, lane_draws
from curling_env.ice import Ice
from curling_env.sheet import HOG_TO_FAR_TEE, Direction
from curling_env.units import short_length
from friction_estimation.reports.keen_and_heavy import SIGMAS

SAME_WEIGHT = 0.05
"""Change of the time between the hog lines that no one feels [s]."""


@dataclass(frozen=True, kw_only=True)
class Centre:
    """Draws to the tee, with errors: mean time [s], time to each end [s], ice by handle [m]."""

    seconds: float
    seconds_sigma: float
    ends: dict[str, tuple[float, float]]
    ice: dict[str, tuple[float, float]]


def centre_of(ice: Ice) -> Centre | None:
    """Draws down the centre line of an ice; None where none comes to rest on the tee line."""
    return centre_of_draws([d for end in Direction for d in lane_draws(ice, end, lanes=(0.0,))])


def centre_of_draws(draws: Sequence[LaneDraw]) -> Centre | None:
    """Mean of those draws that go down the centre line; None without them."""
    own = [d for d in draws if d.lane == 0.0 and d.description.hog_to_hog_s is not None]
    if not own:
        return None

    def time(some: Sequence[LaneDraw]) -> tuple[float, float]:
        return (
            float(np.mean([d.description.hog_to_hog_s or 0.0 for d in some])),
            float(np.mean([d.seconds_sigma or 0.0 for d in some])),
        )

    ends = {end.name.lower(): [d for d in own if d.direction is end] for end in Direction}
    ice: dict[str, tuple[float, float]] = {}
    for handle in ("in-turn", "out-turn"):
        those = [d for d in own if d.description.right_hander == handle]
        if those:
            ice[handle] = (
                float(np.mean([d.description.ice_m for d in those])),
                float(np.mean([d.ice_sigma or 0.0 for d in those])),
            )
    seconds, sigma = time(own)
    return Centre(
        seconds=seconds,
        seconds_sigma=sigma,
        ends={end: time(some) for end, some in ends.items() if some},
        ice=ice,
    )


def compared_in_words(centre: Centre | None, then: Centre | None) -> str:
    """Compare two ices by draws to the tee: weight towards each end, and the ice to give."""
    ends = centre.ends.keys() & then.ends.keys() if centre is not None and then is not None else ()
    if centre is None or then is None or not ends:
        return "no draw comes to rest on one of the two"
    changes = {end: _weight_in_words(centre.ends[end], then.ends[end]) for end in sorted(ends)}
    if len({*changes.values()}) == 1:
        words = [*changes.values()][:1]
    else:
        words = [f"to the {end} end {change}" for end, change in changes.items()]
    for handle in sorted(centre.ice.keys() & then.ice.keys()):
        (now, a), (before, b) = centre.ice[handle], then.ice[handle]
        if abs(now - before) > max(SIGMAS * float(np.hypot(a, b)), 0.1):
            more = "more" if now > before else "less"
            words.append(f"{short_length(now - before)} {more} ice for the {handle}")
    return "; ".join(words)


def _weight_in_words(now: tuple[float, float], then: tuple[float, float]) -> str:
    """Compare two draw weights, each with its error [s]."""
    change = now[0] - then[0]
    error = max(SIGMAS * float(np.hypot(now[1], then[1])), 0.01)
    if abs(change) < SAME_WEIGHT:
        return "of the same weight"
    # A stone of the same speed slides as much further as the friction is less.
    carry = 2 * change / then[0] * HOG_TO_FAR_TEE
    far = f"a stone of the same speed {short_length(carry)} {'further' if carry > 0 else 'shorter'}"
    longer = f"{abs(change):.2f} s {'longer' if change > 0 else 'shorter'} hog to hog, {far}"
    if abs(change) <= error:
        return f"no clear change: {longer}, ± {error:.2f} s"
    return f"{'keener' if change > 0 else 'heavier'} today: {longer}"
