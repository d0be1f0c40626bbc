"""Benchmarks of ends, games and the search, on one core."""

from __future__ import annotations

import time
from collections.abc import Iterator

import gymnasium
import numpy as np

import curling_env  # noqa: F401  (registers the environments)
from agents.commands.page_benchmarks import page_measures
from agents.playing.match import play_game
from agents.playing.search import SearchPlayer
from curling_env.commands.benchmarks import Measure, rate
from curling_env.envs.game.end_env import CurlingEndEnv
from curling_env.envs.game.end_vector_env import CurlingEndVectorEnv
from curling_env.game import TYPICAL_EVOLUTION, GameSimulator
from curling_env.game.opponents.rulebased import RuleBasedPlayer
from curling_env.game.rules import Team, rule_set

SIDE_BY_SIDE = 256


def measures() -> Iterator[Measure]:
    """Ends against the draw player, games between rule-based players, and the search."""
    yield Measure(name="end_env_ends_per_s", value=rate(_end_alone()), unit="ends/s")
    yield Measure(name="end_vector_env_ends_per_s", value=rate(_ends_together()), unit="ends/s")
    yield Measure(name="game_of_8_ends_s", value=_game(), unit="s")
    yield Measure(name="search_1000_delivery_s", value=_search(), unit="s")
    yield from page_measures()


def _end_alone():
    """An end in which both teams draw to the button, so that stones collide."""
    env = gymnasium.make("CurlingEnd-v0").unwrapped
    assert isinstance(env, CurlingEndEnv)
    env.reset(seed=0)
    action = env.action_of(env.opponent.call(env.simulator.view(env.state)))

    def work() -> int:
        env.reset()
        over = False
        while not over:
            over = env.step(action)[2]
        return 1

    return work


def _ends_together():
    env = gymnasium.make_vec(
        "CurlingEnd-v0", num_envs=SIDE_BY_SIDE, vectorization_mode="vector_entry_point"
    )
    assert isinstance(env, CurlingEndVectorEnv)
    env.reset(seed=0)
    view = env.usual.simulator.view(env.states[0])
    action = env.action_of(env.opponents[0].call(view))
    actions = np.tile(action, (SIDE_BY_SIDE, 1))

    def work() -> int:
        ends = 0
        while ends == 0:
            ends = int(env.step(actions)[2].sum())
        return ends

    return work


def _game() -> float:
    """Processor time of a game of eight ends on changing ice with paths, the best of three [s]."""
    simulator = GameSimulator(
        rules=rule_set("world_curling_2024", ends=8),
        skills="elite",
        ice_evolution=TYPICAL_EVOLUTION,
        sweeping=True,
    )
    spent: list[float] = []
    for seed in range(4):  # the first one warms up
        start = time.process_time()
        play_game(simulator, (RuleBasedPlayer(), RuleBasedPlayer()), seed=seed, paths=True)
        spent.append(time.process_time() - start)
    return min(spent[1:])


def _search() -> float:
    """Processor time of a delivery by `search:1000` in mid-end, the best of five [s]."""
    simulator = GameSimulator(rules=rule_set("world_curling_2024", ends=8), skills="elite")
    opening = play_game(
        simulator, (RuleBasedPlayer(), RuleBasedPlayer()), seed=1, last_stone=Team.HOME
    ).deliveries[8]
    view, player = simulator.view(opening.before), SearchPlayer(1000)
    spent: list[float] = []
    for _ in range(6):  # the first one warms up
        start = time.process_time()
        player.call(view)
        spent.append(time.process_time() - start)
    return min(spent[1:])
