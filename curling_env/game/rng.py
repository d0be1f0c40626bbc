"""Random numbers of a throw: the same ones whoever asks for them, in whatever order."""

from __future__ import annotations

import numpy as np

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
