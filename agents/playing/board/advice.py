"""Best calls in a position, each with its chances.

The player `search` proposes shots; the best of every kind and handle is then thrown equally often
with the thrower's errors, so that their chances are comparable.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.planning.description import Description, describe
from agents.playing.search import SearchPlayer
from agents.playing.search.evaluator import PositionEvaluator
from agents.playing.search.player import ShotEstimate
from agents.playing.search.positions import EndSimulator, points_of, position_of
from agents.playing.search.value_network import skill_feature
from curling_env.errors import InputError
from curling_env.game import GameSimulator, GameState, PlayerView
from curling_env.sheet import tee, to_sheet
from curling_env.throw import Throw
from curling_env.typing import Floats

TRIALS = 400
"""Number of throws of each proposed shot: a chance is then known to 2.5 % of all throws or
better.
"""
SAME_LINE, SAME_WEIGHT = 0.003, 0.03
"""Differences of line [rad] and weight (relative) below which two shots of one handle are one
shot.
"""


@dataclass(frozen=True, kw_only=True)
class Advice:
    """Call with the results of many throws of it.

    Parameters
    ----------
    shot : the shot in the sport's words
    throw : the throw without error
    description : the throw in a curler's words
    win_probability, standard_error : probability of winning the game after it, and its error
    lies_shot : share of the throws after which the thrower's team lies shot
    points : mean points that the thrower's team then counts; negative if the opponents count. After
        the last stone of an end it is the score.
    rests : (n, 2) end of the thrown stone, sheet frame [m]; NaN if it left play
    """

    shot: str
    throw: Throw
    description: Description
    win_probability: float
    standard_error: float
    lies_shot: float
    points: float
    rests: Floats


def best_calls(
    simulator: GameSimulator,
    state: GameState,
    *,
    player: SearchPlayer | None = None,
    count: int = 4,
    trials: int = TRIALS,
) -> list[Advice]:
    """Return the best calls for the team to throw, the best first.

    Parameters
    ----------
    simulator : the ice, the rules, and the skill of the thrower
    state : a game with an end in play
    player : player that proposes shots; reuse one, because it remembers the ice
    count : number of calls
    trials : number of throws of each for its chances

    Raises
    ------
    InputError : no end is in play, or no throw that reaches the house
    """
    view = simulator.view(state)
    end = view.game.end
    if end is None:
        raise InputError("no end is in play")
    searcher = SearchPlayer() if player is None else player
    proposed = _different(searcher.shots_by_kind(view))[: 3 * count]
    if not proposed:
        raise InputError("no throw on this ice reaches the far house")
    lines, rules = view.game.lines, view.game.rules
    evaluator = PositionEvaluator(
        searcher.network(rules, view.ice), rules, lines, skill_feature(view.skill)
    )
    play = EndSimulator(
        ice=view.ice, direction=view.direction, rules=rules, lines=lines, delivery=view.delivery
    )
    errors = view.skill.errors(trials, view.rng())
    intended = np.array([(s.throw.speed, s.throw.angle, s.throw.spin) for s in proposed])
    thrown = (intended[:, None] + errors).reshape(-1, 3)
    before = np.broadcast_to(position_of(end), (len(thrown), *position_of(end).shape))
    after = play.play(before, end.delivered, thrown)
    shape = (len(proposed), trials)
    wins = evaluator.win_probabilities(view, after, end.delivered + 1).reshape(shape)
    sign = 1 if end.hammer is view.team else -1
    points = sign * points_of(lines, after).reshape(shape)
    rests = to_sheet(after[:, play.slot(end.delivered)], view.direction).reshape(*shape, 2)
    order = np.argsort(-wins.mean(axis=1), kind="stable")[:count]
    return [
        Advice(
            shot=proposed[k].shot,
            throw=proposed[k].throw,
            description=_described(view, proposed[k].throw),
            win_probability=float(wins[k].mean()),
            standard_error=float(wins[k].std() / np.sqrt(trials)),
            lies_shot=float((points[k] > 0).mean()),
            points=float(points[k].mean()),
            rests=rests[k],
        )
        for k in order
    ]


def _described(view: PlayerView, throw: Throw) -> Description:
    return describe(view.ice, throw, tee(view.direction), view.direction, view.delivery)


def _different(shots: list[ShotEstimate]) -> list[ShotEstimate]:
    """Return shots that differ from every better one by handle, line or weight."""
    kept: list[ShotEstimate] = []
    for shot in shots:
        alike = any(
            shot.throw.spin * other.throw.spin > 0
            and abs(shot.throw.angle - other.throw.angle) < SAME_LINE
            and abs(shot.throw.speed / other.throw.speed - 1) < SAME_WEIGHT
            for other in kept
        )
        if not alike:
            kept.append(shot)
    return kept
