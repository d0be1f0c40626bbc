"""Value of positions: the probability of winning the game from them."""

from __future__ import annotations

import numpy as np

from agents.playing.search.calling_style import NEUTRAL_STYLE, CallingStyle
from agents.playing.search.positions import MAX_POINTS, points_of
from agents.playing.search.value_network import ValueNetwork
from agents.playing.search.win_probability import WinProbability
from curling_env.errors import InputError
from curling_env.game import PlayerView
from curling_env.game.rules import End, RuleSet
from curling_env.game.rules.lines import Lines
from curling_env.typing import Floats


class PositionEvaluator:
    """Probability of winning from positions, by the network and the ends to come.

    Parameters
    ----------
    network : predicts the score of the end
    rules, lines : rules and lines of the game
    skill : skill of the players as the network sees it, see `skill_feature`
    calls : preferences of the team, in addition to the odds
    """

    def __init__(
        self,
        network: ValueNetwork,
        rules: RuleSet,
        lines: Lines,
        skill: float,
        calls: CallingStyle = NEUTRAL_STYLE,
    ) -> None:
        self.network, self.rules, self.lines, self.skill = network, rules, lines, skill
        self.calls = calls
        self.game_odds = WinProbability(rules)

    def win_probabilities(self, view: PlayerView, stones: Floats, delivered: int) -> Floats:
        """Return the win probability of the view's team from positions of the current end, (n,).

        Parameters
        ----------
        view : the game as the player sees it
        stones : (n, 16, 2) positions, see `positions`
        delivered : number of stones delivered in the end
        """
        end = end_of(view)
        lead, ends_left = view.game.lead(end.hammer), view.game.ends_left
        by_score = self.calls.worth(
            self.game_odds.by_score(lead, ends_left),
            lead,
            ends_left,
            with_hammer=end.hammer is view.team,
        )
        hammers = self.values_to_hammer(stones, delivered, by_score)
        return hammers if end.hammer is view.team else 1 - hammers

    def values_to_hammer(self, stones: Floats, delivered: int, by_score: Floats) -> Floats:
        """Return the value of positions to the team with the hammer, (n,).

        Parameters
        ----------
        stones, delivered : as in `win_probabilities`
        by_score : (13,) value of each of `SCORES` to that team
        """
        left = self.rules.deliveries - delivered
        if left == 0:
            points = np.clip(points_of(self.lines, stones), -MAX_POINTS, MAX_POINTS)
            return by_score[points + MAX_POINTS]
        return (
            by_score
            @ self.network.score_probabilities(self.lines, stones, left, by_score, self.skill).T
        )


def end_of(view: PlayerView) -> End:
    """Return the current end.

    Raises
    ------
    InputError : no end is in play
    """
    if view.game.end is None:
        raise InputError("no end is in play")
    return view.game.end
