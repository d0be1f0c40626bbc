"""Policy of `CurlingEnd-v0` as a player of whole games."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from curling_env.envs.game.match_core import MatchCore
from curling_env.envs.game.opponents import Policy
from curling_env.envs.game.shots import ShotActions
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
