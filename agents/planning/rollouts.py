"""Many throws on one ice, each by itself: where they end and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import Ice
from curling_env.physics.batch import RELEASE_DTYPE, throw_batch
from curling_env.physics.effects.motion import MOTION_SIZE
from curling_env.physics.law import compile_law
from curling_env.physics.slide import NO_OBSTACLES, SlideEnd, new_work, slide_kernel
from curling_env.sheet import HOG_LINE_Y, Direction

Floats = NDArray[np.float64]

EVERYWHERE = np.array([-np.inf, np.inf, -np.inf, np.inf])
"""Bounds that end no slide: beyond the ice's edge the last cell goes on."""


@dataclass(frozen=True, kw_only=True)
class Rollouts:
    """How n throws ended.

    Parameters
    ----------
    xy : (n, 2) where each one ended, sheet frame [m]; NaN for a stone that never stops
    end : (n,) `SlideEnd` values
    time : (n,) since release [s]
    """

    xy: Floats
    end: NDArray[np.int64]
    time: Floats

    @property
    def rested(self) -> NDArray[np.bool_]:
        """(n,) whether the stone came to rest by itself."""
        return self.end == SlideEnd.REST


def states_of(throws: Floats, direction: Direction) -> Floats:
    """Release states (n, 6) x, y, vx, vy, theta, omega of throws (n, 4), sheet frame.

    Parameters
    ----------
    throws : speed [m/s], angle [rad], spin [rad/s] and offset at the hog line [m], one a row
    direction : the end played to
    """
    speed, angle, spin, x = throws.T
    zero = np.zeros(len(throws))
    return np.column_stack(
        [
            direction * x,
            zero - direction * HOG_LINE_Y,
            -direction * speed * np.sin(angle),
            direction * speed * np.cos(angle),
            zero,
            spin,
        ]
    )


def roll_out(
    ice: Ice,
    throws: Floats,
    direction: Direction,
    *,
    bounds: Floats = EVERYWHERE,
    stones: Floats = NO_OBSTACLES,
    reach: float = 0.0,
) -> Rollouts:
    """Throw each of (n, 4) throws alone on an ice; see `states_of` for the columns.

    Parameters
    ----------
    bounds : (4,) x_min, x_max, y_min, y_max of the centre that end a slide [m]
    stones : (k, 2) centres of resting stones, sheet frame [m]
    reach : distance between centres that ends a slide [m]
    """
    states = states_of(throws, direction)
    if len(stones) == 0:
        table = np.zeros(len(states), dtype=RELEASE_DTYPE)
        for name, column in zip(("x", "y", "vx", "vy", "theta", "omega"), states.T, strict=True):
            table[name] = column
        rests = throw_batch(ice, table, bounds=bounds)
        return _rollouts(
            np.column_stack([rests.x, rests.y]), rests.end.astype(np.int64), rests.time
        )
    law = compile_law(ice)
    end = np.empty(len(throws), dtype=np.int64)
    time = np.empty(len(throws))
    motion = np.zeros(MOTION_SIZE)
    no_samples = np.empty((0, 4))
    work = new_work()
    for i, state in enumerate(states):
        end[i], time[i], _ = slide_kernel(
            law, state, motion, 0.0, 0.0, 0.0, bounds, stones, reach, 1.0, no_samples, work
        )
    return _rollouts(states[:, :2].copy(), end, time)


def _rollouts(xy: Floats, end: NDArray[np.int64], time: Floats) -> Rollouts:
    xy[end == SlideEnd.NEVER_STOPS] = np.nan
    return Rollouts(xy=xy, end=end, time=time)
