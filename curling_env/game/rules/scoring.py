"""Measuring and counting (R11), and the next hammer."""

from __future__ import annotations

import math

import numpy as np

from curling_env.game.rules.lines import Lines
from curling_env.game.rules.rulesets import RuleSet
from curling_env.game.rules.teams import Stones, Team
from curling_env.typing import Flags, Floats, Integers


def points_of(places: Floats, own: Flags, reach: float, measure: float = 0.0) -> Integers:
    """Return points of a team in many positions at once, negative if its opponent scores.

    A team scores for each of its stones that is nearer to the tee than the opponent's nearest. If
    stones of both teams are equally far, so that no instrument can separate them, none of them
    counts; if they are the nearest, no team scores.

    Parameters
    ----------
    places : (..., k, 2) centres of stones, delivery frame [m]; NaN for none
    own : (k,) true for stones of the team
    reach : distance of a stone's centre from the tee at which it just touches the house [m]
    measure : distances that differ by less count as equal [m]

    Returns
    -------
    (...) points
    """
    distance = np.hypot(places[..., 0], places[..., 1])
    distance = np.where(distance <= reach, distance, np.inf)
    ours, theirs = distance[..., own], distance[..., ~own]
    our_nearest = ours.min(axis=-1, initial=np.inf, keepdims=True)
    their_nearest = theirs.min(axis=-1, initial=np.inf, keepdims=True)
    scored = (ours < their_nearest - measure).sum(axis=-1)
    conceded = (theirs < our_nearest - measure).sum(axis=-1)
    return scored - conceded


def count(lines: Lines, stones: Stones, measure: float = 0.0) -> tuple[Team | None, int]:
    """Return the scoring team and its points; see `points_of`.

    Parameters
    ----------
    lines : lines of the sheet
    stones : stones on the sheet
    measure : distances that differ by less count as equal [m]

    Returns
    -------
    team : the team that scores, or None for a blank end
    points : its points
    """
    # The same as `points_of`, bit for bit, which is slower for a dozen stones.
    near: tuple[list[float], list[float]] = ([], [])
    reach = lines.reach
    for team, _, x, y in stones:
        distance = abs(complex(x, y))
        if distance <= reach:
            near[team].append(distance)
    for team in Team:
        theirs = near[team.other]
        limit = min(theirs) - measure if theirs else math.inf
        points = sum(distance < limit for distance in near[team])
        if points:
            return team, points
    return None, 0


def shot_order(lines: Lines, stones: Stones) -> Stones:
    """Return the stones in the house or touching it, nearest to the tee first."""
    near = [stone for stone in stones if lines.in_house(stone.x, stone.y)]
    return tuple(sorted(near, key=lambda stone: stone.x * stone.x + stone.y * stone.y))


def score_of(rules: RuleSet, lines: Lines, stones: Stones) -> tuple[int, int]:
    """Return points of the home and of the away team when an end is over."""
    team, points = count(lines, stones, rules.measure)
    if team is None:
        return 0, 0
    return (points, 0) if team is Team.HOME else (0, points)


def hammer_after(rules: RuleSet, hammer: Team, score: tuple[int, int]) -> Team:
    """Return the team with the hammer after an end, or in mixed doubles with the decision on the
    placement.

    In mixed doubles a blank end gives the decision to the team that threw first in it.
    """
    if score == (0, 0):
        return hammer if rules.blank_keeps_hammer else hammer.other
    return Team.AWAY if score[0] else Team.HOME
