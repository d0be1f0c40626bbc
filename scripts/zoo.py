"""Train with RL Zoo's own code and the package's hyperparameters, and tell how near the draws come.

    pip install rl_zoo3
    python scripts/zoo.py ppo sac td3                # five minutes of one core
    python scripts/zoo.py ppo --seed 1

A line for each algorithm: the processor time of the training, the mean miss of the learnt throw
with the execution errors of the player, and that of the best possible throw with the same errors.
"""

# RL Zoo is installed for this script only.
# pyright: reportMissingImports=false

from __future__ import annotations

import argparse
import contextlib
import io
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import numpy as np
import torch
from rl_zoo3.exp_manager import ExperimentManager
from stable_baselines3.common.utils import set_random_seed

import curling_env  # noqa: F401  (registers the environments)
from agents.learning.evaluation import best_throw, misses
from agents.learning.zoo import ALGORITHMS, file_of
from curling_env.sheet import Direction, tee

TRIALS = 8192
"""Throws with execution error of each mean miss."""


def trained(algorithm: str, seed: int, folder: str) -> tuple[Any, dict[str, Any]]:
    """A model that RL Zoo has trained, and the options of its environment."""
    set_random_seed(seed)
    run = ExperimentManager(
        argparse.Namespace(algo=algorithm, seed=seed),
        algorithm,
        "CurlingSheet-v0",
        folder,
        eval_freq=-1,
        n_timesteps=-1,
        seed=seed,
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


def compare(model: Any, options: dict[str, Any]) -> tuple[float, float]:
    """Mean miss of the learnt throw at the button, and of the best possible one [m]."""
    env: Any = gymnasium.make("CurlingSheet-v0", **options).unwrapped
    observation, _ = env.reset(seed=0)
    action, _ = model.predict(observation, deterministic=True)
    target = np.asarray(tee(Direction.AWAY), dtype=np.float64)
    learnt = np.array([*env.throw_range.numbers_of(action), 0.0])
    best = best_throw(env.ice, target, env.skill)

    def mean_miss(throw: Any) -> float:
        thrown = misses(env.ice, throw[None], target[None], env.skill, seed=7, trials=TRIALS)
        return float(thrown.with_error.mean())

    return mean_miss(learnt), mean_miss(best)


@dataclass(frozen=True, kw_only=True)
class Result:
    """A training and its mean misses.

    Parameters
    ----------
    throws : number of throws that it learnt from
    seconds : processor time [s]
    miss, best : mean miss of the learnt throw, and of the best possible one [m]
    """

    throws: int
    seconds: float
    miss: float
    best: float


def measure(algorithm: str, seed: int = 0, logs: Path | None = None) -> Result:
    """Train by an algorithm, and compare the learnt throw with the best possible one."""
    torch.set_num_threads(1)
    env = gymnasium.make("CurlingSheet-v0")
    env.reset(seed=0)
    env.step(env.action_space.sample())  # compiled before the clock starts
    with TemporaryDirectory() as scratch:
        began = time.process_time()
        model, options = trained(algorithm, seed, str(logs or scratch))
        seconds = time.process_time() - began
    miss, best = compare(model, options)
    return Result(throws=model.num_timesteps, seconds=seconds, miss=miss, best=best)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("algorithms", nargs="+", choices=ALGORITHMS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path, help="keep RL Zoo's logs in this folder")
    given = parser.parse_args()
    for algorithm in given.algorithms:
        found = measure(algorithm, given.seed, given.output)
        print(
            f"{algorithm}: {found.throws} throws, {found.seconds:.0f} s; mean miss "
            f"{found.miss:.3f} m, best possible {found.best:.3f} m: {found.miss / found.best:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
