"""Opponents of an agent: players by name or file, policies, or a pool of them.

A policy maps observations of the environment to actions: a function, or an object with `predict`,
as those of stable-baselines3. As an opponent it gets the observations that the agent would get in
its place.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from curling_env.envs.game.core import GameCore
from curling_env.envs.game.shots import ShotActions
from curling_env.envs.options import brief
from curling_env.errors import InputError
from curling_env.game import Call, Player, PlayerView, player_named
from curling_env.game.players import player_names

ACCEPTED = (
    "a player's name (%s), module:Class, a trained model's file, a Player, a function of an "
    "observation, something with predict(observation), or a list of such"
)


class Policy:
    """Function of observations, or object with `predict`, called as for an agent.

    `predict` gets those of `state`, `action_masks` and `deterministic` that it accepts, as the
    models of stable-baselines3 and sb3-contrib do: its memory of the episode, the available shots,
    and the request for its best action. A function gets `action_masks` if it has such a parameter.

    Parameters
    ----------
    given : the function, or what has `predict`

    Raises
    ------
    InputError : neither
    """

    def __init__(self, given: Any) -> None:
        predict = getattr(given, "predict", None)
        if predict is None and not callable(given):
            raise InputError(f"expected a function of an observation, got {brief(given)}")
        self._act: Callable[..., Any] = given if predict is None else predict
        try:
            self._takes = set(inspect.signature(self._act).parameters)
        except (TypeError, ValueError):  # compiled code has no signature
            self._takes = set[str]()
        self._predicts = predict is not None

    def act(
        self, observation: Any, memory: Any = None, masks: Callable[[], Any] | None = None
    ) -> tuple[Any, Any]:
        """Return the action for an observation, and the memory of the episode after it.

        Parameters
        ----------
        observation : of the environment
        memory : what the last call of the episode returned; None at its beginning
        masks : returns the available actions, (n,) 1 or 0; None for all
        """
        options: dict[str, Any] = {}
        if self._predicts and "deterministic" in self._takes:
            options["deterministic"] = True
        if self._predicts and "state" in self._takes:
            options["state"] = memory
        if masks is not None and "action_masks" in self._takes:
            options["action_masks"] = masks()
        found: Any = self._act(observation, **options)
        if not (self._predicts and isinstance(found, tuple)):
            return found, None
        action, memory = cast("tuple[Any, ...]", found)[:2]
        return action, memory


class PolicyPlayer(Player):
    """Policy as a player, with its memory of the current end.

    Parameters
    ----------
    policy : turns an observation into an action: a throw, or the number of a shot
    core : what the observations and throws are of
    """

    name = "policy"

    def __init__(self, policy: Policy, core: GameCore) -> None:
        self._policy, self._core, self._shots = policy, core, ShotActions()

    def call(self, view: PlayerView) -> Call:
        """Return the call of the policy's action from this position alone."""
        return self.answer(view, None)[0]

    def answer(self, view: PlayerView, memory: Any) -> tuple[Call, Any]:
        """Return the call of the policy's action, and its memory of the end after it."""
        seen, masks = self._core.observation_of(view), partial(self._shots.mask, view)
        action, memory = self._policy.act(seen, memory, masks)
        chosen = self._shots if np.ndim(action) == 0 else self._core.action
        return chosen.call_of(action, view), memory


class Opponents(list[Player]):
    """Pool of opponents; each episode draws one.

    Appended ones may be drawn from the next episode on, for instance past versions of a learner.

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
        """Add an opponent, in any accepted form."""
        super().append(self._player(given))

    def draw(self, rng: np.random.Generator) -> Player:
        """Draw the opponent of a new episode."""
        return self[int(rng.integers(len(self)))] if len(self) > 1 else self[0]

    def _player(self, given: Any) -> Player:
        if isinstance(given, str | Path | Player):
            return player_named(given)
        if callable(given) or hasattr(given, "predict"):
            return PolicyPlayer(Policy(given), self._core)
        names = ", ".join(player_names())
        raise InputError(f"opponent must be {ACCEPTED % names}, got {brief(given)}")
