"""Input features of a position for a network that calls shots.

An observation of `CurlingEnd-v0` has the position of each stone. Relations between stones and to
the tee matter most, so they are computed first: for each stone on the sheet, and for each place of
the list to which a stone may be drawn. The promise of each shot, from `values`, is added.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from agents.playing.search.positions import SLOTS, points_of
from agents.playing.search.value_network import STONE_FEATURES, stone_features
from curling_env.envs.game.observation import CONTEXT
from curling_env.envs.game.shots import DRAWS, GUARDS
from curling_env.envs.known_ice import mean_friction
from curling_env.envs.sheet.observation import LENGTH_SCALE
from curling_env.errors import InputError
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.sheet import Sheet
from curling_env.typing import Flags, Floats, Indices, Integers, Singles

LINES = Lines(width=Sheet().width)
"""Lines of the usual sheet. Observations of sheets of another width are read as if of this one."""
PLACES = np.array([*DRAWS.values(), *GUARDS.values()])
"""Places to draw to, (12, 2) delivery frame [m]."""
DELIVERIES = 16
MAX_POINTS = 4
"""Maximum score; larger ones are seen as this one."""
_DELIVERED, _HAMMER, _PROTECTED = (
    CONTEXT.index(name) for name in ("stones delivered", "hammer", "guards protected")
)
WHOLE_FEATURES = DELIVERIES + 2 * MAX_POINTS + 1 + 2
PLACE_FEATURES = len(PLACES) + 8


class Seen(NamedTuple):
    """Features of n positions.

    Parameters
    ----------
    stones : (n, 16, s) features of each stone, own ones first; zero if absent
    there : (n, 16) 1 for each stone on the sheet
    places : (n, 12, p) features of each place of `PLACES`
    whole : (n, w) features of the position as a whole
    possible : (n, 201) true for each shot of the list that exists
    prospects : (n, 201) points expected after one throw without error
    """

    stones: Singles
    there: Singles
    places: Singles
    whole: Singles
    possible: Flags
    prospects: Singles


def checked(observations: ArrayLike) -> Floats:
    """Check flat observations of `CurlingEnd-v0`, (n, k).

    Raises
    ------
    InputError : observations of another form
    """
    seen = np.asarray(observations, dtype=np.float64)
    if seen.ndim != 2 or seen.shape[1] < len(CONTEXT) + 3 * SLOTS:
        raise InputError(
            "expected flat observations of CurlingEnd-v0, of "
            f"{len(CONTEXT) + 3 * SLOTS} numbers or more, got an array {seen.shape}"
        )
    return seen


def positions_of(seen: Floats) -> Floats:
    """Return positions of the stones, (n, 16, 2) delivery frame [m], own ones first; NaN if absent.

    Parameters
    ----------
    seen : (n, k) observations
    """
    stones = seen[:, -3 * SLOTS :].reshape(-1, SLOTS, 3)
    places = stones[:, :, 1:] * [LINES.width / 2, LENGTH_SCALE]
    return np.where(stones[:, :, :1] > 0.5, places, np.nan)


def features_of(observations: ArrayLike, once: Singles) -> Seen:
    """Return the network's input for positions.

    Parameters
    ----------
    observations : (n, k) flat observations of `CurlingEnd-v0`
    once : (n, 201) points expected of each shot; see `values.ShotValues.once`

    Raises
    ------
    InputError : observations of another kind
    """
    seen = checked(observations)
    positions = positions_of(seen)
    n = len(positions)
    of_stones, rows = stone_features(LINES, positions)
    stones = np.zeros((n * SLOTS, STONE_FEATURES), dtype=np.float32)
    stones[rows] = of_stones
    return Seen(
        stones=stones.reshape(n, SLOTS, STONE_FEATURES),
        there=np.isfinite(positions[:, :, 0]).astype(np.float32),
        places=_of_places(positions),
        whole=_of_the_whole(seen, positions, delivered_in(seen)),
        possible=np.isfinite(once),
        prospects=np.nan_to_num(once).astype(np.float32),
    )


def delivered_in(seen: Floats) -> Indices:
    """Return the number of stones delivered before observations (n, k), (n,)."""
    delivered = np.rint(seen[:, _DELIVERED] * DELIVERIES).astype(np.intp)
    return np.clip(delivered, 0, DELIVERIES - 1)


def hammer_in(seen: Floats) -> Flags:
    """Return whether the thrower has the hammer in observations (n, k), (n,)."""
    return seen[:, _HAMMER] > 0


def friction_in(seen: Floats) -> Floats:
    """Return the mean friction in observations (n, k), (n,)."""
    return mean_friction(seen[:, len(CONTEXT)])


def _of_the_whole(seen: Floats, positions: Floats, delivered: Indices) -> Singles:
    n = len(seen)
    # In either throwing order, own points are positive.
    points: Integers = np.clip(points_of(LINES, positions), -MAX_POINTS, MAX_POINTS)
    whole = np.zeros((n, WHOLE_FEATURES), dtype=np.float32)
    rows = np.arange(n)
    whole[rows, delivered] = 1
    whole[rows, DELIVERIES + MAX_POINTS + points] = 1
    whole[:, -2] = seen[:, _HAMMER]
    whole[:, -1] = seen[:, _PROTECTED]
    return whole


def _of_places(positions: Floats) -> Singles:
    """Return the relation of the stones to each place, (n, 12, PLACE_FEATURES)."""
    n = len(positions)
    apart: Any = positions[:, None] - PLACES[:, None]
    dx, dy = apart[..., 0], apart[..., 1]
    narrow = np.exp(-((dx / 0.2) ** 2))
    near = np.exp(-(dx**2 + dy**2) / 0.5)
    before = dy < -0.25
    own = np.arange(SLOTS) < STONES_PER_TEAM
    nearer = np.hypot(positions[:, None, :, 0], positions[:, None, :, 1]) < np.hypot(
        *PLACES.T[:, :, None]
    )

    def total(values: Any) -> Any:
        return np.nansum(values, axis=-1)

    features = np.zeros((n, len(PLACES), PLACE_FEATURES), dtype=np.float32)
    features[:, np.arange(len(PLACES)), np.arange(len(PLACES))] = 1
    columns = (
        total(narrow * before),
        total(narrow * (dy < -1.2)),
        total(np.exp(-((dx / 0.45) ** 2)) * before),
        total(narrow * np.exp(-((dy / 0.5) ** 2)) * (dy > 0.1)),
        total(near * own),
        total(near * ~own),
        total(nearer & own) / 2,
        total(nearer & ~own) / 2,
    )
    features[:, :, len(PLACES) :] = np.stack(columns, axis=-1)
    return features
