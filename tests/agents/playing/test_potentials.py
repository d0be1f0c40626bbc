"""Positions with more expected points have a higher value, and environments find values by name."""

from __future__ import annotations

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

import curling_env  # noqa: F401  (registers the environments)
from agents.playing.potentials import heuristic, value_network
from curling_env.game import RestingStone, Team


@pytest.mark.parametrize("potential", [value_network, heuristic])
def test_a_stone_on_the_button_is_worth_something_to_its_team_alone(potential):
    env = gym.make("CurlingEnd-v0", hammer="own").unwrapped
    env.reset(seed=0)
    game = env.state.game
    values = {}
    for team in Team:
        stones = (RestingStone(team, 0, 0.0, 0.1),)
        with_stone = replace(game, end=replace(game.end, stones=stones, delivered=14))
        values[team] = potential(with_stone, Team.HOME)
        assert potential(with_stone, Team.AWAY) == pytest.approx(-values[team])
    assert values[Team.HOME] > values[Team.AWAY] + 0.2
    assert potential(replace(game, end=None), Team.HOME) == 0.0


def test_the_environments_find_them_by_name():
    rewards = []
    for name in ("value-network", "heuristic"):
        env = gym.make("CurlingEnd-v0", potential=name, hammer="opponent", skill="none")
        env.reset(seed=0)
        *_, info = env.step(np.float32([-0.2, 0.0, 0.0]))
        rewards.append(info["reward_potential"])
    assert 0 < abs(rewards[0]) < 3
    assert rewards[0] != rewards[1]
