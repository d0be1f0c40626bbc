"""The stones of mixed doubles that lie on the sheet before an end begins (R16).

One is a guard on the centre line, one lies in the house. The team whose stone is in the house
delivers second and so has the hammer. In a power play both lie to one side. Digital Curling 4 has
six arrangements of its own.
"""

from __future__ import annotations

from typing import Literal

from curling_env.game.rules.lines import HOG_LINE, Lines
from curling_env.game.rules.rulesets import RuleSet
from curling_env.game.rules.teams import RestingStone, Stones, Team
from curling_env.sheet import HOUSE_RADIUS, RING_RADII

Side = Literal["left", "right"]
"""The side of the sheet, as the thrower sees it."""
GuardPlace = Literal["middle", "near_house", "near_hog_line"]
"""Where the guard lies: one of three places, chosen for a competition by how much the ice curls."""

_MIDWAY = (HOG_LINE - HOUSE_RADIUS) / 2
"""Distance along play of the middle place, midway between hog line and house [m]."""
_GUARD_PLACES = {"middle": 0.0, "near_house": 0.915, "near_hog_line": -0.915}
"""Distance of each place from the middle one: three feet [m]."""
_ARRANGED_GUARDS = (-3.055, -3.345, -3.97, -4.26, -4.885, -5.175)
"""Where the guard lies along play in Digital Curling 4's arrangements: it touches each of World
Curling's places from behind and from before [m]."""
_ARRANGED_POWER_PLAY = (1.093, 1.087, 1.073, 1.067, 1.053, 1.047)
"""How far to the side the guard lies in a power play of these arrangements [m]."""


def placed_stones(
    rules: RuleSet,
    lines: Lines,
    hammer: Team,
    *,
    power_play: Side | None = None,
    guard: GuardPlace = "middle",
) -> Stones:
    """The guard of the team that throws first, and the other team's stone in the house.

    Parameters
    ----------
    rules : a set of rules with placed stones
    lines : lines of the sheet, for the stone's radius
    hammer : the team with the hammer, whose stone lies in the house
    power_play : the side on which both lie, or None
    guard : the place of the guard, unless the rules have an arrangement of their own

    Returns
    -------
    The guard, centred on its place, and the stone in the house. The latter has its back edge on
    the back of the 4-foot ring; in a power play it touches the tee line from before, centred on
    the edge of the 8-foot ring.
    """
    side = {"left": -1.0, "right": 1.0, None: 0.0}[power_play]
    x = side * RING_RADII[1]
    y = RING_RADII[2] - lines.stone_radius if power_play is None else -lines.stone_radius
    guard_x, guard_y = x, _MIDWAY + _GUARD_PLACES[guard]
    if rules.arrangement is not None:
        guard_x = side * _ARRANGED_POWER_PLAY[rules.arrangement]
        guard_y = _ARRANGED_GUARDS[rules.arrangement]
    number = rules.stones
    return (
        RestingStone(hammer.other, number, guard_x, guard_y),
        RestingStone(hammer, number, x, y),
    )
