"""Between an agent's numbers in [-1, 1] and a call: the throw, and perhaps the brooms."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from curling_env.envs.action import ThrowRange
from curling_env.errors import InputError
from curling_env.game.players import Call

Sweeping = Literal["none", "scripted", "action"]
LONGEST_SWEEP = 30.0
"""A draw takes less than this from release to rest [s]."""


class GameAction:
    """Makes calls from actions.

    Parameters
    ----------
    throws : to choose from
    sweeping : ``none``, ``scripted`` (sweepers decide) or ``action``: two further numbers of an
        action are when sweeping begins, from release to 30 s after it, and how long it lasts,
        -1 being not at all

    Raises
    ------
    InputError : another sweeping
    """

    def __init__(self, throws: ThrowRange, sweeping: Sweeping) -> None:
        if sweeping not in ("none", "scripted", "action"):
            raise InputError(f"sweeping is 'none', 'scripted' or 'action', got {sweeping!r}")
        self.throws = throws
        self.sweeping = sweeping
        self.size = 5 if sweeping == "action" else 3

    @property
    def space(self) -> spaces.Space[NDArray[np.float32]]:
        """The space of the actions."""
        box: Any = spaces.Box(-1.0, 1.0, (self.size,), np.float32)
        return box

    def call_of(self, action: ArrayLike) -> Call:
        """The call an action means; numbers beyond ±1 are taken as ±1.

        Raises
        ------
        InputError : not as many finite numbers as there should be
        """
        numbers = np.asarray(action, dtype=np.float64)
        if numbers.shape != (self.size,) or not np.isfinite(numbers).all():
            raise InputError(
                f"an action must be {self.size} finite numbers in [-1, 1], got {action}"
            )
        throw = self.throws.throw_of(numbers[:3])
        if self.sweeping != "action":
            return Call(throw=throw)
        begin, length = (LONGEST_SWEEP * (np.clip(numbers[3:], -1, 1) + 1) / 2).tolist()
        return Call(throw=throw, sweep=(begin, begin + length))

    def action_of(self, call: Call) -> NDArray[np.float32]:
        """The action that means a call; clipped where it is out of range."""
        throw = self.throws.action_of(call.throw)
        if self.sweeping != "action":
            return throw
        begin, end = call.sweep or (0.0, 0.0)
        sweep = np.array([begin, end - begin]) / LONGEST_SWEEP * 2 - 1
        return np.concatenate([throw, np.clip(sweep, -1, 1)]).astype(np.float32)
