"""Complete state of a game at one moment, and the random numbers of its throws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.game.rules.game import Game
from curling_env.typing import Floats


@dataclass(frozen=True, kw_only=True, slots=True)
class GameState:
    """Game with its ice and the seed of its random numbers.

    A state never changes: a throw makes a new one. Keeping this object saves the game, continuing
    from it restores it, and a search may branch from it any number of times. `seed` and `throws`
    determine the execution error of the next throw. A search that should not know it gives its
    branches other seeds (``dataclasses.replace(state, seed=…)``).

    Parameters
    ----------
    game : score, stones and the team to throw
    seed : seed of all randomness in the game
    throws : number of throws delivered in the game
    clock : time since its first delivery [s]
    wear : (rows, columns) natural logarithm of each cell's friction relative to the start,
        read-only; None while the ice has not worn
    """

    game: Game
    seed: int = 0
    throws: int = 0
    clock: float = 0.0
    wear: Floats | None = None

    def __post_init__(self) -> None:
        if self.wear is not None:
            self.wear.setflags(write=False)

    def __copy__(self) -> GameState:
        return self

    def __deepcopy__(self, _memo: object) -> GameState:
        return self


_WORD = 2**64 - 1
"""Mask of the lowest 64 bits."""


class ThrowRng:
    """Random generators addressed by a game's seed and the number of the throw.

    A counter-based generator is set to the seed as its key and the throw in its counter, which is
    several times faster than making a new generator.
    """

    def __init__(self) -> None:
        self._bits = np.random.Philox(key=0)
        self._rng = np.random.Generator(self._bits)
        self._state = self._bits.state

    def at(self, seed: int, throw: int) -> np.random.Generator:
        """Return the generator of a throw, from its first number; valid until the next call."""
        state = self._state["state"]
        state["key"][:] = seed & _WORD, (seed >> 64) & _WORD
        # The lowest word of the counter counts the drawn numbers.
        state["counter"][:] = 0, throw, 0, 0
        self._bits.state = self._state
        return self._rng
