"""All that a game is at one moment, and the random numbers of its throws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.game.rules.game import Game
from curling_env.typing import Floats


@dataclass(frozen=True, kw_only=True, slots=True)
class GameState:
    """A game, its ice, and the seed of what is still to be drawn.

    A state never changes: a throw makes a new one. To save a game is to keep this object, to
    restore it is to go on from it, and a search may branch from it as often as it likes. `seed`
    and `throws` determine the execution error of the next throw. A search that should not know it
    gives its branches other seeds (``dataclasses.replace(state, seed=…)``).

    Parameters
    ----------
    game : score, stones and whose turn it is
    seed : seed of everything random in the game
    throws : number of throws delivered in the game so far
    clock : time since its first delivery [s]
    wear : (rows, columns) natural logarithm of each cell's friction over what it was at the start,
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
        """The generator of a throw, from its first number; valid until the next call."""
        state = self._state["state"]
        state["key"][:] = seed & _WORD, (seed >> 64) & _WORD
        # The lowest word of the counter counts the numbers that were drawn.
        state["counter"][:] = 0, throw, 0, 0
        self._bits.state = self._state
        return self._rng
