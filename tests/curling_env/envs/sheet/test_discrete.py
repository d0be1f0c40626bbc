"""Discrete actions: throws from a list."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs import DiscreteThrows
from curling_env.errors import InputError


def test_the_grid_reaches_the_ends_of_the_range():
    env = DiscreteThrows(gym.make("CurlingEnd-v0"), speeds=5, angles=3, spins=2)
    assert env.action_space.n == 30
    assert env.throws.min(axis=0).tolist() == [-1, -1, -1]
    assert env.throws.max(axis=0).tolist() == [1, 1, 1]
    with pytest.warns(UserWarning, match="different from the unwrapped"):
        check_env(env, skip_render_check=True)


def test_a_choice_is_the_throw_it_stands_for():
    env = DiscreteThrows(gym.make("CurlingEnd-v0", hammer="opponent", skill="none", details=True))
    env.reset(seed=0)
    *_, info = env.step(137)
    meant = env.unwrapped.call_of(env.throws[137]).throw
    assert info["shots"][0].thrown == meant


def test_sweeping_actions_are_refused():
    with pytest.raises(InputError, match="speed, line and spin"):
        DiscreteThrows(gym.make("CurlingEnd-v0", sweeping="action"))
    with pytest.raises(InputError, match="spins"):
        DiscreteThrows(gym.make("CurlingEnd-v0"), spins=0)
    assert np.isfinite(DiscreteThrows(gym.make("CurlingEnd-v0"), spins=1).throws).all()
