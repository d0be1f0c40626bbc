"""Value of a position to a team in points, by a rule of thumb.

The numbers are chosen, neither learned nor measured: a club skip would accept them.
"""

from __future__ import annotations

from math import exp

from curling_env.game.rules import Game, Team, count, shot_order
from curling_env.sheet import HOUSE_RADIUS

HAMMER = 0.6
"""Value of the hammer in the next end [points]: the mean lead that it brings."""
WIN = 10.0
"""Value of winning the game [points]."""
NEAR = 0.7
"""Distance from the tee at which the value of a stone has fallen to 1/e [m]."""
GUARD = 0.12
"""Value of a guard in front of the shot stone [points]."""


def heuristic_value(game: Game, team: Team) -> float:
    """Return the value of a game to a team, from the current end or the one just over [points]."""
    if game.end is None:
        return _between_ends(game, team)
    return _in_play(game, team)


def _between_ends(game: Game, team: Team) -> float:
    if game.winner is not None:
        return WIN if game.winner is team else -WIN
    if len(game.line_score) >= game.rules.ends:  # tied
        return HAMMER if game.last_stone is team else -HAMMER
    points = game.line_score[-1][team] - game.line_score[-1][team.other]
    return points + (HAMMER if game.last_stone is team else -HAMMER)


def _in_play(game: Game, team: Team) -> float:
    end = game.end
    assert end is not None
    played = end.delivered / game.rules.deliveries
    whose, points = count(game.lines, end.stones)
    standing = 0.0 if whose is None else points if whose is team else -points
    near = 0.0
    for stone in shot_order(game.lines, end.stones):
        near += exp(-stone.distance / NEAR) * (1 if stone.team is team else -1)
    cover = 0.0
    if whose is not None:
        shot = shot_order(game.lines, end.stones)[0]
        covered = any(
            stone.y < -HOUSE_RADIUS and abs(stone.x - shot.x) < 0.35 for stone in end.stones
        )
        cover = GUARD * covered * (1 if whose is team else -1)
    return played * standing + (1 - 0.5 * played) * near + cover
