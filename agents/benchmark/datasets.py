"""Offline datasets of the benchmark's tasks in three tiers, in Minari's form."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from agents.benchmark.contestants import can_do, contestant
from agents.benchmark.ices import DISTRIBUTION
from agents.benchmark.tasks import BenchmarkTask, make, task_of
from agents.models import load
from agents.playing.learned.network import ShotNetwork
from agents.playing.offline_data import episode_of, write_dataset
from curling_env.envs.game.end_env import AGENT
from curling_env.errors import InputError
from curling_env.typing import Progress, no_progress

Tier = Literal["random", "medium", "expert"]
TIERS: tuple[Tier, ...] = get_args(Tier)
"""Tiers: random actions; expert or random with equal probability; the expert's actions."""
FIRST_SEED = 10_000_000
"""Seed of the first episode: neither the benchmark's nor those of trainings."""


def record_tier(
    output: str | Path,
    task: str,
    tier: Tier | str,
    *,
    deliveries: int,
    shots: bool = False,
    progress: Progress = no_progress,
) -> Path:
    """Write a dataset of a task: ``curling/TASK-TIER-v0``, or ``curling/TASK-shots-TIER-v0``.

    The expert is `learned` if a model of the package was trained for the task, else the planner.
    Single throws are on ices that are drawn from the benchmark's distribution. The reference scores
    are the returns of random actions and of the task's reference.

    Parameters
    ----------
    output : folder of datasets
    task : name of the task
    tier : one of `TIERS`
    deliveries : minimum number of steps
    shots : whether actions are the numbers of shots, with the masks in `infos`; ends only
    progress : called after every episode

    Returns
    -------
    the folder of the dataset

    Raises
    ------
    InputError : an unknown task or tier, shots in single throws, or an existing dataset
    ModuleNotFoundError : Minari is not installed
    """
    about = task_of(task)
    env = practice_env(task, shots=shots)
    episodes = tier_episodes(env, task, tier, deliveries=deliveries, shots=shots, progress=progress)
    kind = f"{task}-shots" if shots else task
    return write_dataset(
        output,
        f"curling/{kind}-{tier}-v0",
        env,
        episodes,
        by=tier,
        what=f"{about.asks}, {tier} deliveries",
        seed=FIRST_SEED,
        references=about.reference_returns,
    )


def practice_options(task: BenchmarkTask) -> dict[str, Any]:
    """Return options of a task's environment with other ices of the same distribution, for
    training.
    """
    options = dict(task.options)
    if "ices" in options:
        knows = options["ices"].rpartition(":")[2].lower()
        fields = ("level", "areas", "curl", "error")
        options["ices"] = {name: getattr(DISTRIBUTION, name) for name in fields}
        options["ices"]["knows"] = knows
    return options


def practice_env(task: str, *, shots: bool = False) -> Any:
    """Make the environment of a task with other ices of the same distribution.

    Raises
    ------
    InputError : an unknown task, or shots in single throws
    """
    about = task_of(task)
    if shots and about.metric != "points":
        raise InputError("single throws have no shots; those are for tasks that are ends")
    options = practice_options(about) | ({"actions": "shots"} if shots else {})
    return make(task, disable_env_checker=True, **options)


def tier_episodes(
    env: Any,
    task: str,
    tier: Tier | str,
    *,
    deliveries: int,
    shots: bool = False,
    first_seed: int = FIRST_SEED,
    progress: Progress = no_progress,
) -> Iterator[dict[str, Any]]:
    """Play the episodes of a tier, and yield the fields of Minari's `EpisodeBuffer`.

    Parameters
    ----------
    env : environment of the task, from `practice_env`
    task, tier, deliveries, shots, progress : as in `record_tier`
    first_seed : seed of the first episode; the others count up

    Raises
    ------
    InputError : an unknown tier
    """
    if tier not in TIERS:
        raise InputError(f"tier must be one of {', '.join(TIERS)}, got {str(tier)[:40]!r}")
    act = _tier(tier, _shot_caller() if shots else _expert(task), first_seed)

    def episodes() -> Iterator[dict[str, Any]]:
        done = number = 0
        while done < deliveries:
            one = episode_of(env, act, seed=first_seed + number, masks=shots)
            done, number = done + len(one["rewards"]), number + 1
            progress("deliveries", min(done, deliveries), deliveries)
            yield one

    return episodes()


Act = Callable[[Any, Any, dict[str, Any]], Any]
"""Function from the environment (unwrapped), its observation and its `info` to the action."""


def expert_of(task: str) -> str:
    """Return the expert at a task: `learned` if a model was trained for it, else `planner`."""
    return "learned" if can_do("learned", task_of(task)) else "planner"


def _expert(task: str) -> Act:
    who = contestant(expert_of(task))
    return lambda env, observation, info: who(env, observation)


def _shot_caller() -> Act:
    network = load("ends")
    assert isinstance(network, ShotNetwork)

    def call(env: Any, observation: Any, info: dict[str, Any]) -> Any:
        views, masks = [env.simulator.view(env.state, AGENT)], info["action_mask"]
        return int(network.predict(observation, action_masks=masks, views=views)[0])

    return call


def _tier(tier: str, expert: Act, seed: int) -> Act:
    rng = np.random.default_rng(seed)

    def by_chance(env: Any, observation: Any, info: dict[str, Any]) -> Any:
        if "action_mask" in info:
            return int(rng.choice(np.flatnonzero(info["action_mask"])))
        return rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)

    def act(env: Any, observation: Any, info: dict[str, Any]) -> Any:
        chance = tier == "random" or (tier == "medium" and rng.random() < 0.5)
        return (by_chance if chance else expert)(env, observation, info)

    return act
