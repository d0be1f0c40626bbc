"""The colours of a stone that was hit, learnt from all pictures of its way.

Where a stone lies, one picture shows its handle, perhaps the wrong way round, and its colours then
are wrong as well. On its way it turns, and only the right colours explain how it does.
"""

from __future__ import annotations

from collections.abc import Sequence

from curling_env.typing import Floats
from friction_estimation.appearance import Appearance, Crop, heading_costs
from friction_estimation.tracking import tuning
from friction_estimation.tracking.joint.heading import HeadingViews, likeliest_turn
from friction_estimation.tracking.joint.own_look import coloured, own_look


def views_on_the_way(
    pictures: Sequence[Crop], look: Appearance, thrown: Appearance, t: Floats, speed: Floats
) -> HeadingViews:
    """What pictures show of a stone's heading, by the colours that explain them best together.

    Parameters
    ----------
    pictures : of the stone, a fraction of a second apart
    look : the colours that it seemed to have where it lay
    thrown : the look of the thrown stone
    t, speed : (m,) times [s] and the speed of the stone then [m/s]
    """
    some = pictures[:: max(1, -(-len(pictures) // tuning.COLOUR_PICTURES))]
    tried = [look, *(own_look(crop, thrown).look for crop in some[:: tuning.COLOURS_EVERY])]
    best = min((_explained(some, one, t, speed) for one in tried), key=lambda one: one[0])
    for _ in range(tuning.COLOUR_ROUNDS):
        _, look, headings = best
        for crop, heading in zip(some, headings, strict=True):
            crop.pose[2] = heading
        better = _explained(some, coloured(some, thrown)[0], t, speed)
        if better[0] >= best[0]:
            break
        best = better
    _, look, _ = best
    views = HeadingViews()
    for crop in pictures:
        views.add(crop.t, heading_costs(crop, look))
    return views


def _explained(
    crops: Sequence[Crop], look: Appearance, t: Floats, speed: Floats
) -> tuple[float, Appearance, Floats]:
    """What a stone with a look costs that turns steadily, the look, and its headings [rad]."""
    costs = [heading_costs(crop, look) for crop in crops]
    views = HeadingViews()
    for crop, cost in zip(crops, costs, strict=True):
        views.add(crop.t, cost)
    headings, turned = likeliest_turn(views, t, speed)
    return float(sum(cost.min() for cost in costs)) + turned, look, headings
