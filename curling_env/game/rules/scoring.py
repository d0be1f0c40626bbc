"""Measuring and counting (R11), and who has the hammer next."""

from __future__ import annotations

from curling_env.game.rules.lines import Lines
from curling_env.game.rules.rulesets import RuleSet
from curling_env.game.rules.teams import Stones, Team


def shot_order(lines: Lines, stones: Stones) -> Stones:
    """The stones in or touching the house, nearest to the tee first."""
    reach = lines.reach * lines.reach
    near = [
        (stone.x * stone.x + stone.y * stone.y, k, stone)
        for k, stone in enumerate(stones)
        if stone.x * stone.x + stone.y * stone.y <= reach
    ]
    return tuple(stone for _, _, stone in sorted(near))


def count(lines: Lines, stones: Stones, measure: float = 0.0) -> tuple[Team | None, int]:
    """Whose stones count, and how many.

    A team scores for each of its stones that lies nearer than the opponent's nearest. Where stones
    of both teams lie equally far, so that no instrument tells them apart, none of them counts: an
    end blanked if they are the nearest.

    Parameters
    ----------
    measure : distances closer than this are equal [m]

    Returns
    -------
    team : that scores, or None for a blank end
    points : how many
    """
    order = shot_order(lines, stones)
    if not order:
        return None, 0
    team = order[0].team
    against = next((stone.distance for stone in order if stone.team != team), None)
    if against is None:
        return team, len(order)
    points = sum(1 for s in order if s.team == team and s.distance < against - measure)
    return (team, points) if points else (None, 0)


def score_of(rules: RuleSet, lines: Lines, stones: Stones) -> tuple[int, int]:
    """Points of the home and of the away team when an end is over."""
    team, points = count(lines, stones, rules.measure)
    if team is None:
        return 0, 0
    return (points, 0) if team is Team.HOME else (0, points)


def hammer_after(rules: RuleSet, hammer: Team, score: tuple[int, int]) -> Team:
    """Who has the hammer after an end, or in mixed doubles the decision on the placement.

    In mixed doubles a blank end gives the decision to the team that threw first in it.
    """
    if score == (0, 0):
        return hammer if rules.blank_keeps_hammer else hammer.other
    return Team.AWAY if score[0] else Team.HOME
