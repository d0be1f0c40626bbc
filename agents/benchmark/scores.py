"""Measuring: the mean over the episodes of a task, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.benchmark.contestants import Contestant
from agents.benchmark.tasks import FIRST_SEED, VERSION, BenchmarkTask, make
from curling_env.errors import InputError
from curling_env.typing import Floats, Progress, no_progress

RESAMPLES = 2000
"""Resampled sets of episodes for an interval."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """The score of somebody at a task.

    Parameters
    ----------
    task : name of the task
    metric : what was averaged
    mean : the mean over the episodes
    low, high : its 95 % interval, by resampling the episodes
    episodes : number of episodes
    reward : mean reward of an episode, which `reward_threshold` of the task is about
    version : version of the benchmark
    """

    task: str
    metric: str
    mean: float
    low: float
    high: float
    episodes: int
    reward: float
    version: int = VERSION

    def in_words(self) -> str:
        """The score with its interval."""
        if self.metric == "success":
            return f"{100 * self.mean:.0f} % ({100 * self.low:.0f}–{100 * self.high:.0f})"
        unit = " m" if self.metric == "distance_m" else ""
        return f"{self.mean:.2f}{unit} ({self.low:.2f} to {self.high:.2f})"


def measure(
    task: BenchmarkTask,
    who: Contestant,
    *,
    episodes: int = 200,
    progress: Progress = no_progress,
) -> Score:
    """Play the first episodes of a task.

    Parameters
    ----------
    task : the task
    who : who plays, from `contestants.contestant`
    episodes : number of episodes
    progress : called after every episode

    Raises
    ------
    InputError : no episode, or somebody who cannot do this task
    """
    if episodes < 2:
        raise InputError(f"an interval needs at least 2 episodes, got {episodes}")
    env = make(task.name, disable_env_checker=True).unwrapped
    values, rewards = np.zeros(episodes), np.zeros(episodes)
    for k in range(episodes):
        observation, _ = env.reset(seed=FIRST_SEED + k)
        over, info = False, dict[str, Any]()
        while not over:
            observation, reward, over, _, info = env.step(who(env, observation))
            rewards[k] += float(reward)
        values[k] = _value(task, info)
        progress(task.name, k + 1, episodes)
    env.close()
    low, high = _interval(values)
    return Score(
        task=task.name,
        metric=task.metric,
        mean=float(values.mean()),
        low=low,
        high=high,
        episodes=episodes,
        reward=float(rewards.mean()),
    )


def _value(task: BenchmarkTask, info: dict[str, Any]) -> float:
    if task.metric == "points":
        own, opponents = info["score"]
        return float(own - opponents)
    return float(info[task.metric])


def _interval(values: Floats) -> tuple[float, float]:
    rng = np.random.default_rng(0)
    means = rng.choice(values, (RESAMPLES, len(values))).mean(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return float(low), float(high)
