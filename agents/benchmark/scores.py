"""Measurement of a policy: the mean over the episodes of a task, with its interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import trim_mean

from agents.benchmark.contestants import Contestant
from agents.benchmark.tasks import FIRST_SEED, VERSION, BenchmarkTask, make
from curling_env.errors import InputError
from curling_env.typing import Floats, Progress, no_progress

TRIMMED = 0.25
"""Share of the runs that the interquartile mean drops at either end."""
RESAMPLES = 2000
"""Number of resampled sets of episodes for an interval."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """The score of a contestant at a task.

    Parameters
    ----------
    task : name of the task
    metric : what was averaged
    mean : the mean over the episodes; of several trainings the interquartile mean of theirs
    low, high : its 95 % interval, by resampling the trainings and the episodes of each
    episodes : number of episodes of a run
    reward : mean reward of an episode, which `reward_threshold` of the task is about; None where it
        is not known
    runs : number of trainings
    version : version of the benchmark
    """

    task: str
    metric: str
    mean: float
    low: float
    high: float
    episodes: int
    reward: float | None = None
    runs: int = 1
    version: int = VERSION

    def in_words(self) -> str:
        """Return the score with its interval."""
        if self.metric == "success":
            return f"{100 * self.mean:.0f} % ({100 * self.low:.0f}–{100 * self.high:.0f})"
        unit = " m" if self.metric == "distance_m" else ""
        return f"{self.mean:.2f}{unit} ({self.low:.2f} to {self.high:.2f})"


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Score of one contestant minus that of another in the same episodes.

    Parameters
    ----------
    mean : the mean over the episodes, of several tasks the mean over the tasks
    low, high : its 95 % interval, by resampling the episodes of each task
    episodes : number of episodes of each task
    """

    mean: float
    low: float
    high: float
    episodes: int

    def in_words(self) -> str:
        """Return the difference with its interval."""
        return f"{self.mean:+.2f} ({self.low:+.2f} to {self.high:+.2f})"


def measure(
    task: BenchmarkTask,
    who: Contestant,
    *,
    episodes: int = 200,
    progress: Progress = no_progress,
) -> Score:
    """Measure the score of a contestant at a task; see `played`."""
    return score_of(task, *played(task, who, episodes=episodes, progress=progress))


def played(
    task: BenchmarkTask,
    who: Contestant,
    *,
    episodes: int = 200,
    progress: Progress = no_progress,
) -> tuple[Floats, Floats]:
    """Play the first episodes of a task.

    Parameters
    ----------
    task : the task
    who : the contestant, from `contestants.contestant`
    episodes : number of episodes
    progress : called after every episode

    Returns
    -------
    what counts, and the reward, of each episode

    Raises
    ------
    InputError : too few episodes, or a contestant that cannot do this task
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
    return values, rewards


def score_of(task: BenchmarkTask, values: Floats, rewards: Floats | None = None) -> Score:
    """Return the score of a contestant from a task that was `played`.

    Parameters
    ----------
    task : the task
    values : what counted in each episode, (episodes,) or (runs, episodes) for several trainings, of
        which the interquartile mean is the score
    rewards : of the same episodes; None where they are not known
    """
    runs = np.atleast_2d(values)
    drawn = resampled_runs(runs) if len(runs) > 1 else None
    low, high = _interval(runs) if drawn is None else interval_of(drawn)
    return Score(
        task=task.name,
        metric=task.metric,
        mean=float(trim_mean(runs.mean(axis=1), TRIMMED)),
        low=low,
        high=high,
        episodes=runs.shape[1],
        runs=len(runs),
        reward=None if rewards is None else float(np.mean(rewards)),
    )


def resampled_runs(values: Floats) -> Floats:
    """Return means of resampled runs, (resamples, runs), of values (runs, episodes).

    Runs are drawn with replacement, and episodes within each.
    """
    rng, (runs, episodes) = np.random.default_rng(0), values.shape
    out = np.empty((RESAMPLES, runs))
    for row in out:
        some = rng.integers(runs, size=(runs, 1))
        row[:] = values[some, rng.integers(episodes, size=(runs, episodes))].mean(axis=1)
    return out


def interval_of(means: Floats) -> tuple[float, float]:
    """Return the 95 % interval of the interquartile mean of resampled means (resamples, runs)."""
    low, high = np.quantile(trim_mean(means, TRIMMED, axis=1), [0.025, 0.975])
    return float(low), float(high)


def difference_of(own: Sequence[Floats], others: Sequence[Floats]) -> Difference:
    """Return the difference of two scores.

    Parameters
    ----------
    own, others : for each task what counts in each of the same episodes
    """
    apart = np.array(own) - np.array(others)
    low, high = _interval(apart)
    return Difference(mean=float(apart.mean()), low=low, high=high, episodes=apart.shape[1])


class Played(NamedTuple):
    """Results of a played task.

    Parameters
    ----------
    task : the task
    values, rewards : what counted and the reward of each episode, for each who played
    against : the last of them, where they are compared
    """

    task: BenchmarkTask
    values: list[Floats]
    rewards: list[Floats]
    against: str | None

    @property
    def score(self) -> Score:
        """Score, without a comparison."""
        own = slice(None) if self.against is None else slice(1)
        return score_of(self.task, np.array(self.values[own]), np.array(self.rewards[own]))

    @property
    def difference(self) -> Difference:
        """Difference of the first score and the second."""
        own, other = self.values
        return difference_of([own], [other])

    def line(self) -> str:
        """Return the score with the task, or the difference, in a line."""
        remark = self.task.asks
        if self.against is not None:
            remark = f"{self.difference.in_words():28} more than {self.against}"
        return f"{self.task.name:14} {self.score.in_words():28} {remark}"


def _value(task: BenchmarkTask, info: dict[str, Any]) -> float:
    if task.metric == "points":
        own, opponents = info["score"]
        return float(own - opponents)
    return float(info[task.metric])


def _interval(values: Floats) -> tuple[float, float]:
    """Return the interval of the mean of values (tasks, episodes)."""
    rng = np.random.default_rng(0)
    means = [rng.choice(each, (RESAMPLES, len(each))).mean(axis=1) for each in values]
    low, high = np.quantile(np.mean(means, axis=0), [0.025, 0.975])
    return float(low), float(high)
