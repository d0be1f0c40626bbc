"""RL Zoo's files have the keys of the algorithms and the environments."""

from __future__ import annotations

import inspect
import subprocess
import sys

import gymnasium
import pytest
import stable_baselines3
import yaml

from agents.learning import ALGORITHMS, file_of
from curling_env.errors import InputError

OF_THE_ZOO = {"env_kwargs", "n_envs", "n_timesteps", "normalize", "noise_type", "noise_std"}
"""Keys that RL Zoo uses itself."""


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_every_key_is_one_of_the_algorithm_or_of_the_zoo(algorithm):
    runs = yaml.safe_load(file_of(algorithm).read_text())
    assert "CurlingSheet-v0" in runs
    taken = inspect.signature(getattr(stable_baselines3, algorithm.upper()).__init__).parameters
    for name, settings in runs.items():
        assert set(settings) - OF_THE_ZOO <= set(taken)
        assert settings["n_timesteps"] > 0
        env = gymnasium.make(name, **settings["env_kwargs"])
        env.reset(seed=0)


def test_files_are_found_by_the_name_of_the_algorithm():
    done = subprocess.run(
        [sys.executable, "-m", "agents.learning.zoo", "sac"], capture_output=True, text=True
    )
    assert done.stdout.strip() == str(file_of("sac"))
    with pytest.raises(InputError, match="no hyperparameters for 'dqn'; expected one of ppo, sac"):
        file_of("dqn")
