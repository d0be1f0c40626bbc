"""Policy of `CurlingEnd-v0` as a player of whole games: any function, or a saved model."""

from __future__ import annotations

import json
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np

from curling_env.envs.game.match_core import MatchCore
from curling_env.envs.game.opponents import Policy
from curling_env.envs.game.shots import ShotActions
from curling_env.errors import InputError
from curling_env.game import Call, Player, PlayerView

MAX_PARALLEL_ENDS = 64
"""Number of ends whose memory a recurrent policy keeps: more are never played in parallel."""


class GamePolicy(Player):
    """Policy that sees flat observations and returns a throw, or the number of a shot.

    A policy with a parameter `action_masks` gets those of the shots; one with `state` gets its
    memory of the end.

    Parameters
    ----------
    policy : a function of observations, or an object with `predict`
    name : its name

    Raises
    ------
    InputError : neither
    """

    def __init__(self, policy: Any, name: str = "policy") -> None:
        self.name = name
        self._policy, self._core, self._shots = Policy(policy), MatchCore(), ShotActions()
        self._memories: dict[tuple[Any, ...], Any] = {}

    def call(self, view: PlayerView) -> Call:
        """Return the call of the policy's action."""
        end = (view.entropy[0], view.team, len(view.game.line_score))
        memory = self._memories.pop(end, None)
        if view.own_stones_left == view.game.rules.stones:
            memory = None
        masks = partial(self._shots.mask, view)
        action, memory = self._policy.act(self._core.observation_of(view), memory, masks)
        if memory is not None:
            self._memories[end] = memory
            if len(self._memories) > MAX_PARALLEL_ENDS:
                del self._memories[next(iter(self._memories))]
        chosen = self._shots if np.ndim(action) == 0 else self._core.action
        return chosen.call_of(action, view)


_ALGORITHMS = {
    "maskable": "MaskablePPO",
    "recurrent": "RecurrentPPO",
    ".sac.": "SAC",
    ".td3.": "TD3",
    ".dqn.": "DQN",
    ".qrdqn.": "QRDQN",
    ".tqc.": "TQC",
}
"""Algorithms by a part of the name of their policy's module; other policies are like PPO's."""


def stable_baselines_model(path: str | Path) -> Any:
    """Load a model that was saved by stable-baselines3 or sb3-contrib. Loading runs code in the
    file.

    Raises
    ------
    InputError : no such file, or one that was not saved by their algorithms
    """
    try:
        with ZipFile(path) as archive:
            module = str(json.loads(archive.read("data"))["policy_class"]["__module__"])
    except FileNotFoundError as error:
        raise InputError("no such file", source=path) from error
    except (OSError, BadZipFile, KeyError, ValueError, TypeError) as error:
        raise InputError("is not a model of stable-baselines3", source=path) from error
    algorithm = next((name for part, name in _ALGORITHMS.items() if part in module), "PPO")
    package = "sb3_contrib" if module.startswith("sb3_contrib") else "stable_baselines3"
    try:
        return getattr(import_module(package), algorithm).load(path, device="cpu")
    except ModuleNotFoundError as error:
        raise InputError(f"needs {package} to be installed", source=path) from error
