"""Who plays against an agent: players by name or file, policies, or a pool of them.

A policy is whatever turns observations of the environment into actions: a function, or an object
with `predict`, as those of stable-baselines3. As an opponent it sees and throws what the agent
would in its place.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, cast

import numpy as np

from curling_env.envs.game.core import GameCore
from curling_env.envs.options import brief
from curling_env.errors import InputError
from curling_env.game import Call, Player, PlayerView, player_named
from curling_env.game.players import player_names

ACCEPTED = (
    "a player's name (%s), module:Class, a trained model's file, a Player, a function of an "
    "observation, something with predict(observation), or a list of such"
)


def policy_of(given: Any) -> Callable[[Any], Any] | None:
    """A function of observations from a function, or from something with `predict`; else None.

    `predict` is asked for its best action where it can be, and may return a state beside it, as in
    stable-baselines3.
    """
    predict = getattr(given, "predict", None)
    if predict is None:
        return cast("Callable[[Any], Any]", given) if callable(given) else None
    choices: dict[str, Any] = {}
    if "deterministic" in inspect.signature(predict).parameters:
        choices["deterministic"] = True

    def policy(observation: Any) -> Any:
        found: Any = predict(observation, **choices)
        return cast("tuple[Any, ...]", found)[0] if isinstance(found, tuple) else found

    return policy


class PolicyPlayer(Player):
    """A policy as a player.

    Parameters
    ----------
    policy : turns an observation into an action
    core : what the observations and actions are of
    """

    name = "policy"

    def __init__(self, policy: Callable[[Any], Any], core: GameCore) -> None:
        self._policy = policy
        self._core = core

    def call(self, view: PlayerView) -> Call:
        """What the policy's action means."""
        seen = self._core.observation_of(view)
        return self._core.action.call_of(self._policy(seen), view)


class Opponents(list[Player]):
    """The players that an agent may meet; each episode draws one.

    Whatever is appended may be drawn from the next episode on: so a learner meets its past selves.

    Parameters
    ----------
    given : one opponent, or a list of them
    core : what their observations and actions are of

    Raises
    ------
    InputError : something else, or none
    """

    def __init__(self, given: Any, core: GameCore) -> None:
        self._core = core
        super().__init__()
        is_one = isinstance(given, str | Player) or not isinstance(given, Iterable)
        several: list[Any] = [given] if is_one else list(cast("Iterable[Any]", given))
        for one in several:
            self.append(one)
        if not self:
            raise InputError(f"opponent must be {ACCEPTED % ', '.join(player_names())}, got none")

    def append(self, given: Any) -> None:
        """Add an opponent, in any form in which one may be given."""
        super().append(self._player(given))

    def draw(self, rng: np.random.Generator) -> Player:
        """The opponent of an episode that begins."""
        return self[int(rng.integers(len(self)))] if len(self) > 1 else self[0]

    def _player(self, given: Any) -> Player:
        if isinstance(given, str | Path | Player):
            return player_named(given)
        policy = policy_of(given)
        if policy is not None:
            return PolicyPlayer(policy, self._core)
        names = ", ".join(player_names())
        raise InputError(f"opponent must be {ACCEPTED % names}, got {brief(given)}")
