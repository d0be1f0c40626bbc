"""The ten tasks of the benchmark, and two for practice.

A task is an environment with fixed options, episodes with fixed seeds, and one number per episode.
A change to any of them is a new version of the benchmark.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import gymnasium

import curling_env  # noqa: F401  (registers the environments)
from curling_env.errors import InputError

VERSION = 1
"""Version of the benchmark: scores of different versions cannot be compared."""
FIRST_SEED = 1_000_000
"""Seed of the first episode; later ones count up. Train with smaller seeds."""

ICES = "agents.benchmark.ices"
"""Module of the ices; its `MAP`, `MEAN` and `NOTHING` define the agent's knowledge of each."""

Metric = Literal["distance_m", "success", "points"]


@dataclass(frozen=True, kw_only=True)
class BenchmarkTask:
    """One task.

    Parameters
    ----------
    name : as on a command line
    asks : what is asked for, in words
    environment : name of the environment
    options : its options
    metric : what is averaged over episodes: ``distance_m`` from the target [m] (less is better),
        ``success`` or ``points`` scored less conceded (more is better)
    reward_threshold : mean reward of an episode from which the task counts as solved
    references : scores of random actions and of the reference (the planner, or `rulebased`), the 0
        and 1 of normalised scores
    reference_returns : the same for the mean reward of an episode
    headline : whether it counts; a task for practice does not need the stones
    """

    name: str
    asks: str
    environment: str = "CurlingSheet-v0"
    options: Mapping[str, Any] = field(default_factory=dict[str, Any])
    metric: Metric = "success"
    reward_threshold: float = 0.0
    references: tuple[float, float] = (0.0, 1.0)
    reference_returns: tuple[float, float] = (0.0, 1.0)
    headline: bool = True


def _sheet(name: str, asks: str, metric: Metric = "success", **options: Any) -> BenchmarkTask:
    """Return a task of one throw by a club player on ices with a known estimated map."""
    settings = {"ices": f"{ICES}:MAP", "skill": "club", "target": "random", **options}
    return BenchmarkTask(name=name, asks=asks, options=settings, metric=metric)


def _end(opponent: str) -> BenchmarkTask:
    """Return a task of an end against a player, on championship ice, with the hammer in half of the
    ends.
    """
    return BenchmarkTask(
        name=f"end-{opponent}",
        asks=f"an end against `{opponent}`, both teams elite",
        environment="CurlingEnd-v0",
        options={"opponent": opponent},
        metric="points",
    )


_ALL = (
    _sheet("draw", "a draw anywhere in the house, the map known", "distance_m"),
    _sheet(
        "draw-mean",
        "the same, the mean friction known",
        "distance_m",
        ices=f"{ICES}:MEAN",
    ),
    _sheet(
        "draw-blind",
        "the same, nothing known of the ice",
        "distance_m",
        ices=f"{ICES}:NOTHING",
    ),
    _sheet("guard", "a guard before the house", task="guard"),
    _sheet("takeout", "put a stone out of play", task="takeout"),
    _sheet("hit-and-stay", "the same, and stay in play", task="hit_and_stay"),
    _sheet("freeze", "rest against a stone", task="freeze"),
    _end("rulebased"),
    _end("greedy"),
    _end("learned"),
    BenchmarkTask(
        name="end-doubles",
        asks="an end of mixed doubles against `rulebased`, both teams elite",
        environment="CurlingEnd-v0",
        options={"opponent": "rulebased", "rules": "mixed_doubles_2024"},
        metric="points",
        headline=False,
    ),
    replace(_end("draw"), headline=False),
)
# About the planner's reward in single throws (ten episodes of each), and in ends that of `search`
# against `greedy`, and at least that of the opponent itself.
_THRESHOLDS = {
    "draw": 0.0,
    "draw-mean": -0.1,
    "draw-blind": -0.8,
    "guard": 0.4,
    "takeout": 2.5,
    "hit-and-stay": 2.2,
    "freeze": 0.3,
    "end-rulebased": 0.2,
    "end-greedy": 0.8,
    "end-learned": 0.0,
    "end-doubles": 0.6,
    "end-draw": 1.3,
}
# Scores and returns of random actions, then those of the planner, or of `rulebased` in ends, in the
# first hundred episodes (`scripts/baselines.py run`).
_REFERENCES = {
    "draw": ((6.04, 0.68), (-4.10, 0.19)),
    "draw-mean": ((6.04, 0.73), (-4.10, 0.17)),
    "draw-blind": ((6.04, 1.32), (-4.10, -0.70)),
    "guard": ((0.04, 0.76), (-3.55, 0.75)),
    "takeout": ((0.03, 0.90), (-0.54, 2.58)),
    "hit-and-stay": ((0.01, 0.78), (-1.00, 2.32)),
    "freeze": ((0.0, 0.21), (-4.44, 0.65)),
    "end-rulebased": ((-4.56, -0.14), (-4.56, -0.14)),
    "end-greedy": ((-5.19, 0.60), (-5.19, 0.60)),
    "end-learned": ((-3.66, -0.59), (-3.66, -0.59)),
    "end-doubles": ((-3.44, -0.05), (-3.44, -0.05)),
    "end-draw": ((-5.77, 0.92), (-5.77, 0.92)),
}
TASKS = {
    task.name: replace(
        task,
        reward_threshold=_THRESHOLDS[task.name],
        references=_REFERENCES[task.name][0],
        reference_returns=_REFERENCES[task.name][1],
    )
    for task in _ALL
}
"""The tasks by name: the scored ones, and two for practice, in which drawing to the button scores
as much as reacting to the stones."""


def task_of(name: str) -> BenchmarkTask:
    """Return the task of that name.

    Raises
    ------
    InputError : an unknown name
    """
    if name not in TASKS:
        raise InputError(
            f"unknown task {name!r} of the benchmark; expected one of {', '.join(TASKS)}"
        )
    return TASKS[name]


def make(name: str, **options: Any) -> gymnasium.Env[Any, Any]:
    """Make the environment of a task; its specification has the task's `reward_threshold`.

    Parameters
    ----------
    name : one of `TASKS`
    options : further options, such as ``render_mode``

    Raises
    ------
    InputError : an unknown name
    """
    task = task_of(name)
    spec = deepcopy(gymnasium.spec(task.environment))
    spec.reward_threshold = task.reward_threshold
    return gymnasium.make(spec, **{**task.options, **options})
