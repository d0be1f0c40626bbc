"""All that a game is at one moment: frozen, so that saving and branching cost nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from curling_env.game.rules.game import Game


@dataclass(frozen=True, kw_only=True, slots=True)
class GameState:
    """A game, its ice and its luck.

    It never changes: a throw makes a new one. To save a game is to keep this object, to restore it
    is to go on from it, and a search may branch from it as often as it likes. What the next throw's
    execution error will be is part of it, by `seed` and `throws`: a search that is not to know its
    own luck gives its branches other seeds (``dataclasses.replace(state, seed=…)``).

    Parameters
    ----------
    game : score, stones and whose turn it is
    seed : of everything random in the game
    throws : delivered in the game so far
    clock : seconds since its first delivery
    wear : (rows, columns) ln of each cell's friction over what it was, read-only; None while the
        ice has not worn
    """

    game: Game
    seed: int = 0
    throws: int = 0
    clock: float = 0.0
    wear: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if self.wear is not None:
            self.wear.setflags(write=False)

    def __copy__(self) -> GameState:
        return self

    def __deepcopy__(self, _memo: object) -> GameState:
        return self
