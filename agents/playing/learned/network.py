"""Network that calls shots: from its input to the value of every shot of the list.

Every stone, and every place to which one may be drawn, is described separately. The descriptions of
the stones are summed for each team, so that their order does not matter (Zaheer et al. 2017), and
the sums describe the position. Each shot at a stone then follows from the stone, the position and
the expected points of the shot thrown once without error; each draw likewise from its place. The
expected points also count directly: the network learns how often shots succeed, and what else makes
them good.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from agents.learning.model_file import check_finite, read_model, write_model
from agents.playing.learned.features import (
    PLACE_FEATURES,
    PLACES,
    WHOLE_FEATURES,
    Seen,
    checked,
    features_of,
)
from agents.playing.learned.values import ShotValues
from agents.playing.learned.views import views_of
from agents.playing.search.positions import SLOTS
from agents.playing.search.value_network import STONE_FEATURES
from curling_env.envs.game.shots import SHOTS
from curling_env.errors import InputError
from curling_env.game import PlayerView
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.typing import Integers, Singles

HANDLES = 2
"""Shots to a place: with either handle."""
OF_PLACES = HANDLES * len(PLACES)
"""Shots to places, which come first in the list."""
OF_A_STONE = (len(SHOTS) - 1 - OF_PLACES) // SLOTS
"""Shots at a stone."""
ABOUT_PLACES, ABOUT_STONES = slice(0, OF_PLACES), slice(OF_PLACES, len(SHOTS) - 1)
STONE_UNITS, WHOLE_UNITS, HEAD_UNITS = 32, 64, 32
SIZES: dict[str, tuple[int, int]] = {
    "stone 1": (STONE_FEATURES, STONE_UNITS),
    "stone 2": (STONE_UNITS, STONE_UNITS),
    "whole 1": (2 * STONE_UNITS + WHOLE_FEATURES, WHOLE_UNITS),
    "whole 2": (WHOLE_UNITS, WHOLE_UNITS),
    "shots of a stone 1": (STONE_UNITS + OF_A_STONE + WHOLE_UNITS, HEAD_UNITS),
    "shots of a stone 2": (HEAD_UNITS, OF_A_STONE),
    "draws 1": (PLACE_FEATURES + HANDLES + WHOLE_UNITS, HEAD_UNITS),
    "draws 2": (HEAD_UNITS, HANDLES),
    "through": (WHOLE_UNITS, 1),
    "prospects": (1, 1),
}
"""Inputs and outputs of each layer."""
IMPOSSIBLE = -1e9
"""Score of a shot that does not exist."""


@dataclass(frozen=True, kw_only=True)
class ShotNetwork:
    """Weights of the network.

    Parameters
    ----------
    layers : a matrix and an offset for each layer of `SIZES`
    """

    layers: Mapping[str, tuple[Singles, Singles]]
    _values: ShotValues = field(default_factory=ShotValues, init=False, repr=False, compare=False)

    @classmethod
    def load(cls, path: str | Path) -> ShotNetwork:
        """Load the network in a file; nothing in the file is executed.

        Raises
        ------
        InputError : a missing file, or another kind of network
        """
        return cls.of_document(read_model(path), path)

    @classmethod
    def of_document(cls, document: Mapping[str, Any], source: str | Path) -> ShotNetwork:
        """Return the network in the document of a model file; see `agents.learning.model_file`.

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
            raise InputError("contains weights that do not fit its settings", source=source)
        check_finite(document["shots"], source)
        return cls(layers=layers)

    def save(self, path: str | Path, **description: Any) -> None:
        """Write the network in half precision, with its description.

        Raises
        ------
        OutputError : the file cannot be written
        """
        halves = {name: [x.astype(np.float16) for x in both] for name, both in self.layers.items()}
        write_model(path, {"shots": halves, **description})

    def seen(self, observations: ArrayLike, views: Sequence[PlayerView] | None = None) -> Seen:
        """Return the input of the network for positions; every shot is thrown once for it.

        Parameters
        ----------
        observations : (n, k) flat observations of `CurlingEnd-v0`
        views : the same positions from the player's view, with the known ice; by default on the ice
            of `views.views_of`

        Raises
        ------
        InputError : observations of another kind
        """
        views = views_of(observations) if views is None else views
        return features_of(observations, self._values.once(views))

    def worths(self, seen: Seen) -> Singles:
        """Return the logit of each shot of the list, (n, 201).

        Shots that do not exist are `IMPOSSIBLE`.
        """
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
            x = np.concatenate([each, promised, beside], axis=2)
            return self._layer(f"{name} 2", self._layer(f"{name} 1", x), last=True)

        worths = np.concatenate(
            [
                head("draws", seen.places, ABOUT_PLACES).reshape(n, -1),
                head("shots of a stone", stones, ABOUT_STONES).reshape(n, -1),
                self._layer("through", whole, last=True),
            ],
            axis=1,
        )
        worths = worths + self.layers["prospects"][0][0, 0] * seen.prospects
        return np.where(seen.possible, worths, np.float32(IMPOSSIBLE))

    def predict(
        self,
        observation: ArrayLike,
        *,
        action_masks: ArrayLike | None = None,
        deterministic: bool = True,
        rng: np.random.Generator | None = None,
        views: Sequence[PlayerView] | None = None,
    ) -> tuple[Integers, None]:
        """Return the number of the called shot, for one observation or for many.

        Every shot is simulated once, a few milliseconds a position. An observation has little on
        the ice: without `views` its mean friction is used, on ice that is otherwise like
        `standard`.

        Parameters
        ----------
        observation : (k,) or (n, k), of ``CurlingEnd-v0`` made with ``actions="shots"``
        action_masks : (201,) or (n, 201), 0 for each shot that may not be called
        deterministic : call the best shot instead of sampling by probability
        rng : source of randomness for sampling
        views : n positions from the player's view, with the known ice

        Returns
        -------
        () or (n,) numbers of `curling_env.envs.game.shots.SHOTS`; and None, as in
        stable-baselines3

        Raises
        ------
        InputError : observations of another kind
        """
        one = np.ndim(observation) == 1
        worths = self.worths(self.seen(checked(np.atleast_2d(observation)), views))
        if action_masks is not None:
            worths = np.where(np.atleast_2d(action_masks), worths, IMPOSSIBLE)
        if not deterministic:
            rng = np.random.default_rng() if rng is None else rng
            worths = worths + rng.gumbel(size=worths.shape)
        best = worths.argmax(axis=1)
        return (best[0] if one else best), None

    def _layer(self, name: str, x: Singles, *, last: bool = False) -> Singles:
        weights, offset = self.layers[name]
        found = x @ weights + offset
        return found if last else np.maximum(found, 0)
