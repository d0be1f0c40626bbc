"""The two-team game: PettingZoo's own tests, turns, and rewards that cancel."""

from __future__ import annotations

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
)

import curling_env
from curling_env.errors import InputError
from curling_env.game import USUAL

curling_v0 = curling_env.curling_v0

# PettingZoo recommends names like player_0; a scoreboard says home and away.
pytestmark = pytest.mark.filterwarnings("ignore:We recommend agents to be named")


def test_api():
    api_test(curling_v0.env(ends=2), num_cycles=70)


def test_seeds():
    seed_test(lambda: curling_v0.env(ends=2, living=USUAL), num_cycles=20)
    parallel_seed_test(lambda: curling_v0.parallel_env(ends=1), num_cycles=20)


def test_max_cycles():
    max_cycles_test(curling_v0)


def test_parallel_api():
    parallel_api_test(curling_v0.parallel_env(ends=1), num_cycles=40)


def test_render(monkeypatch):
    pytest.importorskip("pygame")
    monkeypatch.setattr("curling_env.envs.game_scene.WINDOW_SPEED", 200.0)
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
