"""Hyperparameters for RL Zoo with which default runs learn.

One YAML file for each algorithm, in the form of https://github.com/DLR-RM/rl-baselines3-zoo.
``python -m agents.learning.zoo ppo`` prints where a file is, for RL Zoo's ``--conf-file``.
"""

from __future__ import annotations

from pathlib import Path

from curling_env.errors import InputError

ALGORITHMS = ("ppo", "sac", "td3")


def file_of(algorithm: str) -> Path:
    """Return the file of an algorithm's hyperparameters.

    Raises
    ------
    InputError : an algorithm without a file
    """
    if algorithm not in ALGORITHMS:
        raise InputError(
            f"no hyperparameters for {algorithm[:40]!r}; expected one of {', '.join(ALGORITHMS)}"
        )
    return Path(__file__).with_name(f"{algorithm}.yml")
