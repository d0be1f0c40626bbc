"""Training with RL Zoo's own code and the package's hyperparameters.

pip install rl_zoo3
"""

# RL Zoo is installed for this measure only.
# pyright: reportMissingImports=false

from __future__ import annotations

import argparse
import contextlib
import io
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import numpy as np
import torch
from rl_zoo3.exp_manager import ExperimentManager
from stable_baselines3.common.utils import set_random_seed

import curling_env  # noqa: F401  (registers the environments)
from agents.learning.evaluation import best_throw, misses
from agents.learning.zoo import file_of
from curling_env.sheet import Direction, tee

TRIALS = 8192
"""Number of throws with execution error of each mean miss."""


def miss_over_best(algorithm: str) -> float:
    """Train draws to the button, and return the mean miss over that of the best possible throw."""
    torch.set_num_threads(1)
    with TemporaryDirectory() as folder:
        model, options = _trained(algorithm, folder)
    env: Any = gymnasium.make("CurlingSheet-v0", **options).unwrapped
    observation, _ = env.reset(seed=0)
    action, _ = model.predict(observation, deterministic=True)
    target = np.asarray(tee(Direction.AWAY), dtype=np.float64)
    learnt = np.array([*env.throw_range.numbers_of(action), 0.0])
    best = best_throw(env.ice, target, env.skill)

    def mean_miss(throw: Any) -> float:
        thrown = misses(env.ice, throw[None], target[None], env.skill, seed=7, trials=TRIALS)
        return float(thrown.with_error.mean())

    return mean_miss(learnt) / mean_miss(best)


def _trained(algorithm: str, folder: str) -> tuple[Any, dict[str, Any]]:
    """Return a model trained by RL Zoo, and the options of its environment."""
    set_random_seed(0)
    run = ExperimentManager(
        argparse.Namespace(algo=algorithm, seed=0),
        algorithm,
        "CurlingSheet-v0",
        folder,
        eval_freq=-1,
        n_timesteps=-1,
        seed=0,
        verbose=0,
        device="cpu",
        config=str(file_of(algorithm)),
        log_interval=-2,
    )
    with contextlib.redirect_stdout(io.StringIO()):
        prepared = run.setup_experiment()
        assert prepared is not None
        run.learn(prepared[0])
    return prepared[0], run.env_kwargs
