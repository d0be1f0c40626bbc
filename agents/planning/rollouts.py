"""Batches of throws on one ice: places and reasons of their ends, with or without stones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.batch import play_batch, releases_of
from curling_env.physics.engine import is_hogged
from curling_env.physics.slides import NO_BOUNDS, NO_OBSTACLES, SlideEnd, play_bounds
from curling_env.sheet import Direction
from curling_env.throw import FROM_HOG_LINE, Delivery
from curling_env.typing import Flags, Floats, Integers

SPEED, ANGLE, SPIN, OFFSET, SWEEP, SWEEP_END = range(6)
"""Columns of a table of throws (n, 6), see `curling_env.physics.batch.releases_of`."""


@dataclass(frozen=True, kw_only=True)
class Rollouts:
    """Outcomes of n throws.

    Parameters
    ----------
    xy : (n, 2) end of each thrown stone, sheet frame [m]; NaN for one that never stops
    end : (n,) reason for the end of each slide, as `SlideEnd` values; CONTACT if the stone met
        another
    in_play : (n,) true if the thrown stone stayed in play
    time : (n,) time until all stones rest [s]
    stones : (n, k, 2) final positions of the other stones, NaN for one that left play [m]
    """

    xy: Floats
    end: Integers
    in_play: Flags
    time: Floats
    stones: Floats

    @property
    def rested(self) -> Flags:
        """Return whether each stone came to rest without meeting another, (n,)."""
        return self.end == SlideEnd.REST


def roll_out(
    ice: Ice,
    throws: Floats,
    direction: Direction,
    *,
    bounds: Floats = NO_BOUNDS,
    stones: Floats = NO_OBSTACLES,
    delivery: Delivery = FROM_HOG_LINE,
) -> Rollouts:
    """Throw n stones on an ice, each into the same position.

    Parameters
    ----------
    throws : (n, 4) or (n, 6), see `releases_of`
    direction : the end played to
    bounds : (4,) x_min, x_max, y_min, y_max of centres in play [m]
    stones : (k, 2) centres of resting stones, sheet frame [m]
    delivery : start of the throws
    """
    before = np.broadcast_to(stones, (len(throws), *stones.shape))
    after = play_batch(ice, before, releases_of(throws, direction, delivery), bounds=bounds)
    struck = after.collisions > 0
    gone = np.isnan(after.xy[:, -1, 0])
    end = np.where(struck, SlideEnd.CONTACT, np.where(gone, SlideEnd.LEFT_BOUNDS, SlideEnd.REST))
    xy = after.last[:, -1].copy()
    endless = after.collisions < 0
    xy[endless], end[endless] = np.nan, SlideEnd.NEVER_STOPS
    return Rollouts(
        xy=xy,
        end=end.astype(np.int64),
        in_play=~gone & ~endless & (struck | ~_is_short(ice, xy, direction)),
        time=after.time,
        stones=after.xy[:, :-1],
    )


def roll_out_in_play(
    ice: Ice,
    throws: Floats,
    direction: Direction,
    stones: Floats,
    *,
    delivery: Delivery = FROM_HOG_LINE,
) -> Rollouts:
    """Run `roll_out` with stones that end where they leave play."""
    bounds = play_bounds(ice, direction)
    return roll_out(ice, throws, direction, bounds=bounds, stones=stones, delivery=delivery)


def _is_short(ice: Ice, xy: Floats, direction: Direction) -> Flags:
    return np.asarray(is_hogged(xy[:, 1], direction, ice.stone.radius))
