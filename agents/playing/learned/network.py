"""The network that calls shots: from what it sees to the worth of every shot of the list.

Every stone, and every place to which one may be drawn, is described by itself. The descriptions of
the stones are summed for each team, so that their order does not matter (Zaheer et al. 2017), and
the sums say what the position is like. Each shot about a stone then follows from the stone, the
position, what the shot promises and whether its way is free; each draw from its place and the same.
Promise and way also count by themselves: the network learns how often shots come off, and what else
makes them good.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from agents.learning.model_file import check_finite, read_model, write_model
from agents.playing.learned.features import (
    PLACE_FEATURES,
    PLACES,
    WHOLE_FEATURES,
    features_of,
)
from agents.playing.search.positions import SLOTS
from agents.playing.search.value_network import STONE_FEATURES
from curling_env.envs.game.shots import SHOTS
from curling_env.errors import InputError
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.typing import Integers, Singles

HANDLES = 2
"""Shots about a place: with either handle."""
OF_PLACES = HANDLES * len(PLACES)
"""Shots about places, which the list begins with."""
OF_A_STONE = (len(SHOTS) - 1 - OF_PLACES) // SLOTS
"""Shots about a stone."""
ABOUT_PLACES, ABOUT_STONES = slice(0, OF_PLACES), slice(OF_PLACES, len(SHOTS) - 1)
STONE_UNITS, WHOLE_UNITS, HEAD_UNITS = 32, 64, 32
SIZES: dict[str, tuple[int, int]] = {
    "stone 1": (STONE_FEATURES, STONE_UNITS),
    "stone 2": (STONE_UNITS, STONE_UNITS),
    "whole 1": (2 * STONE_UNITS + WHOLE_FEATURES, WHOLE_UNITS),
    "whole 2": (WHOLE_UNITS, WHOLE_UNITS),
    "shots of a stone 1": (STONE_UNITS + 2 * OF_A_STONE + WHOLE_UNITS, HEAD_UNITS),
    "shots of a stone 2": (HEAD_UNITS, OF_A_STONE),
    "draws 1": (PLACE_FEATURES + 2 * HANDLES + WHOLE_UNITS, HEAD_UNITS),
    "draws 2": (HEAD_UNITS, HANDLES),
    "through": (WHOLE_UNITS, 1),
    "prospects": (1, 1),
    "blocked": (1, 1),
}
"""Inputs and outputs of each layer."""
IMPOSSIBLE = -1e9
"""What a shot that there is not counts."""


@dataclass(frozen=True, kw_only=True)
class ShotNetwork:
    """Weights of the network.

    Parameters
    ----------
    layers : a matrix and an offset for each layer of `SIZES`
    """

    layers: Mapping[str, tuple[Singles, Singles]]

    @classmethod
    def load(cls, path: str | Path) -> ShotNetwork:
        """The network in a file; nothing in the file is executed.

        Raises
        ------
        InputError : no such file, or not such a network
        """
        return cls.of_document(read_model(path), path)

    @classmethod
    def of_document(cls, document: Mapping[str, Any], source: str | Path) -> ShotNetwork:
        """The network in the document of a model file; see `agents.learning.model_file`.

        Raises
        ------
        InputError : the weights are not those of such a network
        """
        try:
            layers = {
                name: (np.asarray(w, dtype=np.float32), np.asarray(b, dtype=np.float32))
                for name, (w, b) in document["shots"].items()
            }
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError("is not a network that calls shots", source=source) from error
        if {name: w.shape for name, (w, _) in layers.items()} != SIZES or any(
            b.shape != (SIZES[name][1],) for name, (_, b) in layers.items()
        ):
            raise InputError("holds weights that do not fit its settings", source=source)
        check_finite(document["shots"], source)
        return cls(layers=layers)

    def save(self, path: str | Path, **said: Any) -> None:
        """Write the network in half precision, and beside it what is said of it.

        Raises
        ------
        OutputError : the file cannot be written
        """
        halves = {name: [x.astype(np.float16) for x in both] for name, both in self.layers.items()}
        write_model(path, {"shots": halves, **said})

    def worths(self, observations: ArrayLike) -> Singles:
        """How much each shot of the list is called for, (n, 201): logits.

        Shots about stones that do not lie are `IMPOSSIBLE`.

        Parameters
        ----------
        observations : (n, k) flat observations of `CurlingEnd-v0`

        Raises
        ------
        InputError : they are not
        """
        seen = features_of(observations)
        n = len(seen.whole)
        stones = self._layer("stone 2", self._layer("stone 1", seen.stones))
        stones = stones * seen.there[:, :, None]
        teams = stones.reshape(n, 2, STONES_PER_TEAM, STONE_UNITS).sum(axis=2).reshape(n, -1)
        whole = self._layer("whole 1", np.concatenate([teams, seen.whole], axis=1))
        whole = self._layer("whole 2", whole)

        def head(name: str, each: Singles, shots: slice) -> Singles:
            of_each = (*each.shape[:2], -1)
            beside = np.broadcast_to(whole[:, None], (*each.shape[:2], WHOLE_UNITS))
            promised = seen.prospects[:, shots].reshape(of_each)
            free = seen.blocked[:, shots].reshape(of_each)
            x = np.concatenate([each, promised, free, beside], axis=2)
            return self._layer(f"{name} 2", self._layer(f"{name} 1", x), last=True)

        of_stones = head("shots of a stone", stones, ABOUT_STONES)
        of_stones[seen.there == 0] = IMPOSSIBLE
        worths = np.concatenate(
            [
                head("draws", seen.places, ABOUT_PLACES).reshape(n, -1),
                of_stones.reshape(n, -1),
                self._layer("through", whole, last=True),
            ],
            axis=1,
        )
        promises, ways = (self.layers[name][0][0, 0] for name in ("prospects", "blocked"))
        return worths + promises * seen.prospects + ways * seen.blocked

    def predict(
        self,
        observation: ArrayLike,
        *,
        action_masks: ArrayLike | None = None,
        deterministic: bool = True,
        rng: np.random.Generator | None = None,
    ) -> tuple[Integers, None]:
        """The number of the shot that is called, for one observation or for many.

        Parameters
        ----------
        observation : (k,) or (n, k), of ``CurlingEnd-v0`` made with ``actions="shots"``
        action_masks : (201,) or (n, 201), 1 for each shot that there is
        deterministic : whether the best shot is called, rather than one drawn by its chances: of
            the stone or place that is called for most the best variety
        rng : source of the randomness, where it is drawn

        Returns
        -------
        () or (n,) numbers of `curling_env.envs.game.shots.SHOTS`; and None, as in
        stable-baselines3

        Raises
        ------
        InputError : observations of another kind
        """
        seen = np.asarray(observation, dtype=np.float64)
        worths = self.worths(np.atleast_2d(seen))
        if action_masks is not None:
            worths = np.where(np.atleast_2d(action_masks), worths, IMPOSSIBLE)
        if deterministic:
            chances = np.exp(worths - worths.max(axis=1, keepdims=True))
            called = (chances @ _OF_CALLS).argmax(axis=1)
            worths = np.where(_OF_CALLS[:, called].T > 0, worths, 2 * IMPOSSIBLE)
        else:
            rng = np.random.default_rng() if rng is None else rng
            worths = worths + rng.gumbel(size=worths.shape)
        best = worths.argmax(axis=1)
        return (best[0] if seen.ndim == 1 else best), None

    def _layer(self, name: str, x: Singles, *, last: bool = False) -> Singles:
        weights, offset = self.layers[name]
        found = x @ weights + offset
        return found if last else np.maximum(found, 0)


def _of_calls() -> Singles:
    """For each shot of the list (row) 1 in the column of its call: a place, or a stone."""
    calls = [(shot.kind, shot.place, shot.stone) for shot in SHOTS]
    each = list(dict.fromkeys(calls))
    return (np.array([each.index(c) for c in calls])[:, None] == np.arange(len(each))).astype(
        np.float32
    )


_OF_CALLS = _of_calls()
