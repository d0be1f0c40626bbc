"""Faults of a row of a table of shots, and reading errors that explain a score."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from agents.playing.drawn_record import places_of
from curling_env.game.rules import Team, rule_set
from curling_env.game.rules.teams import Stones
from curling_env.typing import Flags, Floats

RULES = rule_set("mixed_doubles_2024")
LINES = RULES.lines()
OUT = 4095.0
"""Coordinate of a stone out of play."""
STONES = 6
"""Stones of a team: the placed one, then those delivered."""
OWN: Flags = np.arange(2 * STONES) < STONES
"""Columns of the home team."""
OVERLAP = 0.06
"""Maximum overlap of two stones without a fault [m]."""


def problems_of(
    places: Floats, before: Stones, after: Stones, team: Team, number: int
) -> Iterator[str]:
    """Yield the problems of the row of a delivery.

    Parameters
    ----------
    places : (12, 2) places as written; NaN for an empty cell
    before, after : stones on the sheet, delivery frame
    team, number : the team that delivers, and the number of the delivery in its end, from 0
    """
    there, here = places_of(before), places_of(after)
    odd = sorted(f"{whose.label} stone {k + 1}" for whose, k in here.keys() - there.keys()
                 if (whose, k) != (team, number // 2))  # fmt: skip
    if odd:
        yield f"{', '.join(odd)} appears, though it was not delivered"
    blank = ~np.isfinite(places).all(axis=1)
    if blank.any():
        yield f"stone_{int(np.argmax(blank)) + 1} has no place"
    half = ((places == 0).sum(axis=1) == 1) & (places < OUT).all(axis=1)
    if half.any():
        k = int(np.argmax(half))
        yield f"stone_{k + 1} lies at ({places[k, 0]:g}, {places[k, 1]:g}), beside every sheet"
    column = STONES * team + 1 + number // 2
    if (places[column] == 0).all():
        yield f"stone_{column + 1}, which was delivered, has no place"
    yield from _overlaps(after)
    if number < RULES.no_takeout_until and there.keys() - here.keys():
        yield "a stone leaves play before the fourth delivery"


def _overlaps(stones: Stones) -> Iterator[str]:
    xy = np.array([(stone.x, stone.y) for stone in stones]).reshape(-1, 2)
    apart = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1))
    apart[np.tril_indices(len(xy))] = np.inf
    if len(xy) > 1 and apart.min() < 2 * LINES.stone_radius - OVERLAP:
        pair = np.unravel_index(np.argmin(apart), apart.shape)
        deep = 100 * (2 * LINES.stone_radius - apart.min())
        both = " and ".join(f"{stones[k].team.label} stone {stones[k].number + 1}" for k in pair)
        yield f"{both} overlap by {deep:.0f} cm"


def error_needed(position: Floats, written: int) -> float:
    """Return the smallest error of distances from the tee with which the stones give the written
    score [m].

    Parameters
    ----------
    position : (12, 2) places, delivery frame; the first six are the home team's
    written : points of home less those of away
    """
    distance = np.hypot(position[:, 0], position[:, 1])
    reach = LINES.reach
    near = [np.sort(np.nan_to_num(distance[side == OWN], nan=np.inf)) for side in (True, False)]
    if not written:
        nearest = [float(side[0]) for side in near]
        blank = reach - min(nearest)  # all stones beside the house
        level = abs(nearest[0] - nearest[1]) / 2 if np.isfinite(nearest).all() else np.inf
        return max(min(blank, level), 0.0)
    ours, theirs = near if written > 0 else near[::-1]
    ours, points = np.append(ours, np.inf), abs(written)
    if points > STONES:
        return float("inf")
    last, nearest = float(ours[points - 1]), float(theirs[0])
    enough = max((last - nearest) / 2, last - reach)
    # The next one must not count: it is farther away than their nearest, or outside the house.
    few = min((nearest - float(ours[points])) / 2, reach - float(ours[points]))
    return max(enough, few, 0.0)
