"""Whether the way of a shot is free, or a stone lies on it.

A stone curls, so it comes from a side, the more so the slower it is. How far from the straight line
it is before its goal is a parabola here, read off paths on the `standard` ice with 1.5 rad/s.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.playing.search.positions import SLOTS
from curling_env.envs.game.shots import COVER, GAP, SHOTS, Shot
from curling_env.typing import Floats, Singles

CURL = {
    1.0: (0.134, -0.0115),
    1.12: (0.050, -0.0025),
    1.25: (0.033, -0.0015),
    1.6: (0.017, -0.0007),
}
"""By weight over that of a draw: sideways distance from the line at s metres before the goal is
a s + b s², to the right where the stone turns counter-clockwise [m]."""
ON_THE_WAY = 0.31
"""Distance from the way within which a stone is touched, with a little to spare [m]."""
TOUCHING = 0.32
"""Distance from its goal within which a stone is what the shot is about [m]."""
FROM = 28.35
"""Distance from the hog line at which stones are let go to the tee played to [m]."""


def blocked(positions: Floats) -> Singles:
    """Whether a stone lies on the way of each shot of the list, (n, 201): 1 or 0.

    Shots about a stone may be thrown with either handle, and are blocked if both ways are. Those
    about stones that do not lie are not blocked.

    Parameters
    ----------
    positions : (n, 16, 2) stones, the thrower's first, delivery frame [m]; NaN where there is none
    """
    stones = np.concatenate([positions, np.zeros((len(positions), 1, 2))], axis=1)
    goals = stones[:, _STONE] + _FROM_STONE
    apart: Any = goals[:, :, None] - positions[:, None]
    before = apart[..., 1]
    straight = apart[..., 0] - goals[:, :, None, 0] * before / FROM
    curl = _CURL[:, :1] * before + _CURL[:, 1:] * before**2
    here = (before > 0) & (np.hypot(apart[..., 0], apart[..., 1]) > TOUCHING)
    here &= ~_ITSELF
    # To the left of the line comes a stone that turns clockwise, to the right the other.
    ways = [((np.abs(straight + turn * curl) < ON_THE_WAY) & here).any(axis=2) for turn in (-1, 1)]
    either = ways[0] & ways[1]
    one = np.where(_HANDLE < 0, ways[0], np.where(_HANDLE > 0, ways[1], either))
    return one.astype(np.float32)


def _from_stone(shot: Shot) -> tuple[float, float]:
    if shot.kind == "draw":
        return shot.place
    if shot.kind == "freeze":
        return 0.0, -0.29 - GAP
    if shot.kind == "cover":
        return 0.0, -COVER
    return (shot.off, 0.0) if shot.kind == "hit" else (1.6, 0.0)


_STONE = np.array([shot.stone for shot in SHOTS])
"""The stone that each shot is about; -1, the last one, lies on the tee for those about none."""
_FROM_STONE = np.array([_from_stone(shot) for shot in SHOTS])
_HANDLE = np.array([shot.handle for shot in SHOTS])
_CURL = np.array([CURL[shot.weight if shot.kind == "hit" else 1.0] for shot in SHOTS])
_ITSELF = (np.arange(SLOTS) == _STONE[:, None]) & np.array([s.kind == "hit" for s in SHOTS])[
    :, None
]
