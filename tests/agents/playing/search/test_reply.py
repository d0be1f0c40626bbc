"""Value of a position after the opponent's reply, and shots chosen by it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from agents.playing import SearchPlayer, throws_before
from agents.playing.search.player import _Search
from agents.playing.search.reply import values_after_reply
from agents.playing.search.tuning import MIN_REPLY_THROWS, REPLIES_ALWAYS, REPLY_FACTOR
from curling_env.game import End, GameSimulator, GameState, PlayerView, RestingStone, Team, rule_set

RULES = rule_set("world_curling_2024", ends=1)
SIMULATOR = GameSimulator(rules=RULES, skills="elite")
AWAY_SHOT = RestingStone(Team.AWAY, 6, 0.1, 0.2)
"""Open counting stone of the team without the hammer."""
BURIED = (
    RestingStone(Team.AWAY, 6, 0.0, 0.25),
    *(RestingStone(Team.AWAY, k, x, -1.1) for k, x in enumerate((-0.16, 0.16))),
    RestingStone(Team.AWAY, 2, 0.0, -2.4),
)
"""The same, behind three guards."""


def state_of(stones, delivered) -> GameState:
    """The last end of a level game; home has the hammer."""
    end = End(number=0, hammer=Team.HOME, stones=tuple(stones), delivered=delivered)
    game = replace(SIMULATOR.new_game(0, last_stone=Team.HOME).game, end=end)
    return GameState(game=game, seed=3, throws=delivered)


def search_at(view: PlayerView, budget: int) -> _Search:
    player = SearchPlayer(budget)
    return player._searched(view)


def value_for_away(stones) -> float:
    """Win probability of the team that waits while the hammer is thrown."""
    view = SIMULATOR.view(state_of(stones, 15), Team.AWAY)
    player = SearchPlayer(1000)
    thrower = search_at(SIMULATOR.view(state_of(stones, 15)), 200)
    values, simulated = values_after_reply(
        thrower.simulator,
        thrower.table,
        partial(player._evaluator(view).win_probabilities, view),
        thrower.stones[None],
        15,
        thrower.sigma,
        view.skill,
        np.random.default_rng(0),
    )
    assert simulated > 50
    return float(values[0])


def wins_of_away(stones, trials=20) -> float:
    """The share of games that away wins when home's last stone is played as search has it."""
    call = SearchPlayer(2000).call(SIMULATOR.view(state_of(stones, 15)))
    after = [
        SIMULATOR.play(replace(state_of(stones, 15), seed=50 + k), call)[0] for k in range(trials)
    ]
    return float(np.mean([state.game.line_score[-1][Team.AWAY] > 0 for state in after]))


def test_the_value_of_a_position_is_that_after_the_reply():
    assert value_for_away((AWAY_SHOT,)) == pytest.approx(wins_of_away((AWAY_SHOT,)), abs=0.2)


def test_a_stone_behind_guards_is_worth_more_than_an_open_one():
    assert value_for_away(BURIED) > value_for_away((AWAY_SHOT,)) + 0.1


def test_replies_are_looked_up_before_the_last_stone_but_one():
    stones = (RestingStone(Team.HOME, 5, 0.4, 0.3),)
    looked_up = {
        delivered: search_at(SIMULATOR.view(state_of(stones, delivered)), 1000).looked_up
        for delivered in (13, 14, 15)
    }
    assert looked_up[13] == looked_up[15] == 0
    assert 1000 < looked_up[14] < REPLY_FACTOR * 1000
    few = search_at(SIMULATOR.view(state_of(stones, 14)), MIN_REPLY_THROWS // REPLY_FACTOR - 1)
    assert few.looked_up == 0
    assert few.simulated < MIN_REPLY_THROWS // REPLY_FACTOR


def test_a_long_search_looks_up_replies_before_every_delivery_but_the_last():
    stones = (RestingStone(Team.HOME, 5, 0.4, 0.3),)
    for delivered in (3, 13, 14, 15):
        view = SIMULATOR.view(state_of(stones, delivered))
        found = search_at(view, REPLIES_ALWAYS)
        assert (found.looked_up > REPLIES_ALWAYS / 2) is (delivered < 15)
        assert found.simulated < 1.02 * REPLIES_ALWAYS
        assert throws_before(view, REPLIES_ALWAYS) == REPLIES_ALWAYS
    assert throws_before(SIMULATOR.view(state_of(stones, 13)), 3000) == 3000
    assert throws_before(SIMULATOR.view(state_of(stones, 14)), 3000) == REPLY_FACTOR * 3000


def test_replies_take_no_more_throws_than_the_clock_allows():
    view = SIMULATOR.view(state_of((RestingStone(Team.HOME, 5, 0.4, 0.3),), 14))
    player = SearchPlayer(seconds=0.2)
    player._rate = 40_000.0
    assert player._searched(view).simulated < 1.02 * 8000


def test_the_same_seed_is_the_same_choice_with_replies():
    view = SIMULATOR.view(state_of((RestingStone(Team.HOME, 5, 0.4, 0.3),), 14))
    first, again = SearchPlayer(500), SearchPlayer(500)
    assert first.ranked_shots(view) == again.ranked_shots(view)
    kinds = first.shots_by_kind(view)
    assert first.ranked_shots(view)[0] == kinds[0]
    assert all(0 <= kind.win_probability <= 1 for kind in kinds)
