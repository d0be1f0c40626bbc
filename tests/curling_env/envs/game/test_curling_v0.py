"""The two-team game: PettingZoo's own tests, turns, rewards that cancel, decisions."""

from __future__ import annotations

import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("pettingzoo")
from pettingzoo.test import (
    api_test,
    max_cycles_test,
    parallel_api_test,
    parallel_seed_test,
    render_test,
    seed_test,
    state_test,
)
from pettingzoo.utils.wrappers import OrderEnforcingWrapper

import curling_env
from curling_env.envs import GameRewardWeights, TeamDecisions
from curling_env.errors import InputError
from curling_env.game import TYPICAL_EVOLUTION, Call, Fault, GameState, Team
from curling_env.physics import Aim
from curling_env.sheet import Direction
from curling_env.throw import SKILLS, Throw

curling_v0 = curling_env.curling_v0

# PettingZoo recommends names like player_0; a scoreboard says home and away.
pytestmark = pytest.mark.filterwarnings("ignore:We recommend agents to be named")


@pytest.mark.parametrize("actions", ["throws", "shots"])
def test_api(actions):
    api_test(curling_v0.env(ends=2, actions=actions), num_cycles=70)
    parallel_api_test(curling_v0.parallel_env(ends=1, actions=actions), num_cycles=40)


def test_seeds():
    seed_test(lambda: curling_v0.env(ends=2, ice_evolution=TYPICAL_EVOLUTION), num_cycles=20)
    parallel_seed_test(lambda: curling_v0.parallel_env(ends=1), num_cycles=20)


def test_each_player_of_a_team_has_its_own_skill():
    """In mixed doubles one player delivers the first and the last stone of a team."""
    exact, club = SKILLS["none"], SKILLS["club"]
    game = curling_v0.env(rules="mixed_doubles_2024", skill=[(exact, "club"), "elite"])
    simulator = game.unwrapped.usual.simulator
    state = simulator.begin_end(simulator.new_game(3, last_stone=Team.AWAY))
    erred: list[bool] = []
    while state.game.end is not None:
        view, throw = simulator.view(state), Throw(speed=2.0, spin=1.5)
        state, shot = simulator.play(state, Call(throw=throw))
        own = club if 0 < shot.number // 2 < 4 else exact
        assert view.skill is (own if shot.team is Team.HOME else SKILLS["elite"])
        if shot.team is Team.HOME:
            erred.append(shot.thrown != throw)
    assert erred == [False, True, True, True, False]


def test_max_cycles():
    max_cycles_test(curling_v0)


def test_a_game_of_blank_ends_is_truncated(monkeypatch):
    monkeypatch.setattr("curling_env.envs.game.match_core.MOST_EXTRA_ENDS", 1)
    game = curling_v0.env(ends=1, skill="none")
    game.reset(seed=0)
    for agent in game.agent_iter(200):
        _, _, over, truncated, _ = game.last()
        action = np.zeros(game.action_space(agent).shape, dtype=np.float32)
        action[0] = 1.0  # through the house
        game.step(None if over or truncated else action)
    assert not game.agents
    assert len(game.unwrapped.state.game.line_score) == 2


def test_render(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setattr(pygame.time, "Clock", lambda: SimpleNamespace(tick=lambda _: 0))
    monkeypatch.setattr("curling_env.envs.game.rendering.PLAYBACK_SPEED", 2000.0)
    monkeypatch.setattr("curling_env.envs.game.rendering.RULED_FRAMES", 1)
    monkeypatch.setattr("curling_env.render.playback.HOLD", 0.05)
    render_test(lambda render_mode=None: curling_v0.env(ends=1, render_mode=render_mode))


def play(env, rng):
    """Deliveries and the sum of rewards of a whole game by random agents."""
    order, total = [], {"home": 0.0, "away": 0.0}
    for agent in env.agent_iter():
        _, reward, terminated, truncated, _ = env.last()
        total[agent] += reward
        if terminated or truncated:
            env.step(None)
            continue
        order.append(agent)
        env.step(rng.uniform(-1, 1, 3).astype(np.float32))
    return order, total


def test_teams_take_turns_and_one_gains_what_the_other_loses():
    env = curling_v0.env(ends=3, rules="digital_curling")
    env.reset(seed=4, options={"last_stone": "home"})
    order, total = play(env, np.random.default_rng(4))
    assert order[:16] == ["away", "home"] * 8
    home, away = env.unwrapped.state.game.score
    assert total == {"home": home - away, "away": away - home}
    assert home != away


def test_a_branch_leaves_the_game_as_it_was():
    env = curling_v0.env(ends=1)
    env.reset(seed=1)
    for _ in range(5):
        env.step(env.action_space(env.agent_selection).sample() * 0.2)
    kept = env.unwrapped.state
    seen = env.observe("home")
    for _ in range(3):
        env.step(np.zeros(3, dtype=np.float32))
    assert env.unwrapped.state is not kept
    env.unwrapped.state = kept
    assert env.unwrapped.state is kept
    assert np.array_equal(env.observe("home"), seen)


def test_mixed_doubles_begins_with_two_stones():
    env = curling_v0.env(rules="mixed_doubles_2024", ends=1)
    env.reset(seed=0)
    assert len(env.unwrapped.state.game.end.stones) == 2


def test_limits_below_one_are_refused():
    with pytest.raises(InputError, match="max_cycles"):
        curling_v0.env(max_cycles=0)


# --- the state of PettingZoo and that of the game -------------------------------------------------


def test_states():
    state_test(curling_v0.env(ends=1), curling_v0.parallel_env(ends=1), num_cycles=20)


def checked(**settings):
    """The game in PettingZoo's own wrapper."""
    return OrderEnforcingWrapper(curling_v0.raw_env(**settings))


@pytest.mark.parametrize("make", [curling_v0.env, checked, curling_v0.parallel_env])
def test_the_state_is_an_array_to_call_and_a_game_to_keep(make):
    env = make(ends=1, observation="planes")
    env.reset(seed=0)
    kept, seen = env.unwrapped.state, env.state()
    assert isinstance(kept, GameState)
    assert env.state_space.contains(seen)
    game = env.unwrapped
    game.step(np.zeros(3, dtype=np.float32))
    assert not np.array_equal(env.state(), seen)
    game.state = kept
    assert np.array_equal(env.state(), seen)
    game.state = pickle.loads(pickle.dumps(kept))
    assert np.array_equal(env.state(), seen)
    game.state = replace(kept, seed=kept.seed + 1)
    assert game.state.seed == kept.seed + 1
    assert np.array_equal(env.state(), seen)


def test_infos_have_the_names_that_an_end_against_an_opponent_has():
    env = curling_v0.env(ends=1, skill="none", actions="shots", details=True)
    env.reset(seed=0)
    assert set(env.infos["home"]) == {"action_mask"}
    names = []
    while not env.terminations["home"]:
        thrower = env.agent_selection
        env.step(0)
        names.append(set(env.infos["away"]))
        (shot,) = env.infos["home"]["shots"]
        assert shot.team.label == thrower
    assert names[:-1] == [{"shots", "reward_parts", "action_mask"}] * 15
    assert names[-1] == {"shots", "reward_parts", "action_mask", "score"}
    home, away = env.unwrapped.state.game.score
    assert env.infos["home"]["score"] == (home, away)
    assert env.infos["away"]["score"] == (away, home)


# --- choices as part of the action ----------------------------------------------------------------


def ticked(put_back):
    """A game in which away guards, and home ticks the guard off the centre line."""
    env = curling_v0.env(ends=1, skill="none", choices="action", details=True).unwrapped
    env.reset(seed=0, options={"last_stone": "home"})
    aim = Aim(env.simulator.ice, Direction.AWAY)
    guard = Call(throw=aim.draw(0.0, -3.0, 1.5))
    env.step(env.action.action_of(guard, TeamDecisions(put_back=put_back)))
    for off in (0.24, 0.26, 0.22, 0.27):
        before = env.state
        weight = 1.02 * aim.draw(0.0, 0.0, 1.5).speed
        tick = Call(throw=aim.through(off, -3.0, weight, 1.5))
        # The decision of the home team is not asked after its own tick.
        env.step(env.action.action_of(tick, TeamDecisions(put_back=not put_back)))
        shot = env.infos["home"]["shots"][0]
        if shot.ruling.fault is Fault.NO_TICK:
            return before, env.state, shot
        env.state = before
        env._decisions[Team.AWAY] = TeamDecisions(put_back=put_back)
    raise AssertionError("no throw ticked the guard")


@pytest.mark.parametrize("put_back", [True, False])
def test_after_a_tick_the_other_teams_decision_counts(put_back):
    before, after, shot = ticked(put_back)
    assert shot.put_back is put_back
    guard = before.game.end.stones[0]
    assert (guard in after.game.end.stones) is put_back


def test_a_power_play_is_taken_when_decided_and_only_once():
    env = curling_v0.env(
        ends=3, rules="mixed_doubles_2024", skill="none", choices="action"
    ).unwrapped
    env.reset(seed=0, options={"last_stone": "home", "power_play": "left"})
    assert env.state.game.end.power_play == "left"
    had = []
    while env.agents and not env.state.game.is_over:
        end = env.state.game.end
        had.append((end.number, end.power_play, env.state.game.power_plays))
        # Only stones of the home team reach the house: away decides on the second end.
        home = env.agent_selection == "home"
        throw = Aim(env.simulator.ice, Direction.AWAY).draw(0.9, 0.0, 1.5) if home else None
        action = np.float32([-1, 0, 0, 0, 0, -1, -1])
        if throw is not None:
            action = env.action.action_of(Call(throw=throw), TeamDecisions(power_play="right"))
        action[4] = 1.0
        env.step(action)
    sides = {number: (side, teams) for number, side, teams in had}
    assert sides[0] == ("left", (Team.HOME,))
    side, teams = sides[1]
    # The deciding team has its power play at once, unless it has had it.
    assert (side == "right") == (len(teams) == 2)
    assert all(len(set(teams)) == len(teams) for _, teams in sides.values())


SLIPPED = Call(throw=Throw(speed=1.0))
"""A stone that never reaches the far hog line."""


def ordered(env, decisions):
    return env.action.action_of(SLIPPED, decisions)


@pytest.mark.parametrize("first", [True, False])
def test_the_deciding_team_may_give_the_hammer_away(first):
    """After a blank end the team that threw first decides on the next."""
    env = curling_v0.env(
        ends=2, rules="mixed_doubles_2024", skill="none", choices="action"
    ).unwrapped
    env.reset(seed=0, options={"last_stone": "home", "throw_first": first})
    assert env.state.game.end.hammer is (Team.AWAY if first else Team.HOME)
    assert env.agent_selection == ("home" if first else "away")
    while env.state.game.end.number == 0:
        env.step(ordered(env, TeamDecisions(throw_first=first)))
    decides = env.state.game.last_stone
    assert env.state.game.end.hammer is (decides.other if first else decides)
    game = curling_v0.env()
    with pytest.raises(InputError, match="no choice of the first throw"):
        game.reset(seed=0, options={"throw_first": True})


def test_a_team_concedes_where_the_rules_allow_it_and_only_there():
    weights = GameRewardWeights(points=0.0, win=1.0)
    for rules, allowed in (("digital_curling", True), ("world_curling_2024", False)):
        env = curling_v0.env(ends=2, rules=rules, choices="action", weights=weights)
        env.reset(seed=0, options={"last_stone": "home"})
        game = env.unwrapped
        for _ in range(3):
            env.step(ordered(game, TeamDecisions()))
        assert env.agent_selection == "home"
        env.step(ordered(game, TeamDecisions(concede=True)))
        state = game.state.game
        assert state.is_over is allowed
        if not allowed:
            assert state.end.delivered == 4
            continue
        assert state.conceded is Team.HOME
        assert state.winner is Team.AWAY
        assert state.line_score == ()
        result = {}
        for agent in env.agent_iter():
            _, result[agent], terminated, _, info = env.last()
            assert terminated
            assert info["reward_parts"]["win"] == result[agent]
            env.step(None)
        assert result == {"home": -1.0, "away": 1.0}


def test_choices_and_power_plays_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match="choices"):
        curling_v0.env(choices="maybe")
    env = curling_v0.env()
    with pytest.raises(InputError, match="no power play"):
        env.reset(seed=0, options={"power_play": "left"})
    assert curling_v0.env(choices="action", sweeping="action").action_space("home").shape == (9,)
