"""The best calls, their chances checked by playing them in the engine for games."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.playing import LaidStone, Position, SearchPlayer, best_calls, set_up
from curling_env.errors import InputError
from curling_env.game import Call, GameSimulator, Team, rule_set
from curling_env.sheet import TEE_Y, Direction

LAST = Position(  # tied, the last stone of the game, an open stone of theirs beside the button
    stones=(LaidStone(x=-0.3, y=-(TEE_Y + 0.2), team=Team.AWAY),),
    direction=Direction.HOME,
    hammer=Team.HOME,
    delivered=15,
)


@pytest.fixture(scope="module")
def player():
    return SearchPlayer(2000)


def simulator_for(position, skill="club"):
    return GameSimulator(rules=position.rules(rule_set("world_curling_2024")), skills=skill)


def test_chances_are_those_of_the_game(player):
    simulator = simulator_for(LAST)
    state = set_up(simulator, LAST, seed=3)
    best, *others = best_calls(simulator, state, player=player)
    assert others
    assert all(best.win_probability >= other.win_probability for other in others)
    wins, trials = 0, 150
    for seed in range(trials):
        after, _ = simulator.play(replace(state, seed=seed + 1000), Call(throw=best.throw))
        wins += after.game.winner is Team.HOME
    share = wins / trials
    error = np.hypot((share * (1 - share) / trials) ** 0.5, best.standard_error)
    # A team that does not score plays an extra end, which counts by its chance.
    tied = best.win_probability - best.lies_shot
    assert abs(best.lies_shot - share) < 4 * error
    assert 0 <= tied < 1
    assert best.description.call
    assert np.isfinite(best.rests).any()


def test_the_calls_differ(player):
    simulator = simulator_for(LAST)
    calls = best_calls(simulator, set_up(simulator, LAST), player=player)
    keys = {(call.shot, call.throw.spin > 0) for call in calls}
    assert len(calls) == 4
    assert len(keys) >= 3
    for call in calls:
        # The house at the home end, seen from the other one, lies at negative y.
        rests = call.rests[np.isfinite(call.rests[:, 0])]
        assert (rests[:, 1] < 0).all()


def test_the_hammer_scores_with_an_open_draw(player):
    empty = Position(delivered=15, hammer=Team.HOME)
    simulator = simulator_for(empty, "none")
    (call,) = best_calls(simulator, set_up(simulator, empty), player=player, count=1)
    assert call.lies_shot == 1.0
    assert call.points == 1.0
    assert call.win_probability == 1.0


def test_between_ends_there_is_no_call():
    simulator = simulator_for(LAST)
    with pytest.raises(InputError, match="no end is in play"):
        best_calls(simulator, simulator.new_game(0))
