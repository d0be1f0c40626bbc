"""Policy of `CurlingEnd-v0` as a player of whole games."""

from __future__ import annotations

from typing import Any

from curling_env.envs.game.match_core import MatchCore
from curling_env.envs.game.opponents import Policy, PolicyPlayer
from curling_env.game import Call, PlayerView

MAX_PARALLEL_ENDS = 64
"""Number of ends whose memory a recurrent policy keeps: more are never played in parallel."""


class GamePolicy(PolicyPlayer):
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
        super().__init__(Policy(policy), MatchCore())
        self.name = name
        self._memories: dict[tuple[Any, ...], Any] = {}

    def call(self, view: PlayerView) -> Call:
        """Return the call of the policy's action."""
        end = (view.entropy[0], view.team, len(view.game.line_score))
        memory = self._memories.pop(end, None)
        if view.own_stones_left == view.game.rules.stones:
            memory = None
        call, memory = self.answer(view, memory)
        if memory is not None:
            self._memories[end] = memory
            if len(self._memories) > MAX_PARALLEL_ENDS:
                del self._memories[next(iter(self._memories))]
        return call
