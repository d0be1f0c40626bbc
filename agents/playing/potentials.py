"""Values of positions that `CurlingEnd-v0` and the two-team game may reward on the way.

Each is declared under the entry-point group `curling.potentials`; see
`curling_env.envs.game.potential`.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from agents.playing.players.heuristic import heuristic_value
from agents.playing.search.positions import SCORES, position_of
from agents.playing.search.value_network import ValueNetwork, load_network
from curling_env.game.rules import Game, Team

_WORTH = (SCORES > 0).astype(np.float64)
"""What each score of the end is worth to the team with the hammer."""


@cache
def _network() -> ValueNetwork:
    return load_network()


def value_network(game: Game, team: Team) -> float:
    """The points that the end promises a team, as the package's value network sees it.

    Both teams are taken to play as in the last end of a tied game: each wants to win the end.

    Parameters
    ----------
    game : a game; between ends it promises nothing
    team : the team
    """
    end = game.end
    if end is None:
        return 0.0
    left = game.rules.deliveries - end.delivered
    chances = _network().score_probabilities(game.lines, position_of(end)[None], left, _WORTH, 0.0)
    points = float(chances[0] @ SCORES)
    return points if team is end.hammer else -points


def heuristic(game: Game, team: Team) -> float:
    """The value of the position by a rule of thumb; between ends none."""
    return 0.0 if game.end is None else heuristic_value(game, team)
