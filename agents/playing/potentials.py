"""Values of positions for intermediate rewards of `CurlingEnd-v0` and the two-team game.

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
"""Value of each score of the end to the team with the hammer."""


@cache
def _network() -> ValueNetwork:
    return load_network()


def value_network(game: Game, team: Team) -> float:
    """Return the expected points of the end for a team, by the package's value network.

    Both teams are assumed to play as in the last end of a tied game: each wants to win the end.

    Parameters
    ----------
    game : a game; between ends the value is zero
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
    """Return the value of the position by a rule of thumb; zero between ends."""
    return 0.0 if game.end is None else heuristic_value(game, team)
