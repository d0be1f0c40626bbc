"""Deliveries in many ends as arrays, and what the batch engine tells of each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.game.simulator import direction_of
from curling_env.physics.many_stones.batch import RELEASE_DTYPE
from curling_env.physics.many_stones.engine import (
    Outcome,
    Status,
    StoneState,
    is_hogged,
    left_by_the_side,
)
from curling_env.throw import Delivery, velocity_of
from curling_env.typing import Floats

DIRECTION = direction_of(0)
"""The end played to in the first end of a game."""


def release_table_of(throws: Floats, delivery: Delivery) -> NDArray[Any]:
    """Releases, of RELEASE_DTYPE.

    Parameters
    ----------
    throws : (n, 9) rows of offset, speed, angle, spin, stone, clock, order, begin and end of
        sweeping
    delivery : where throws begin
    """
    x, speed, angle, spin, stone, clock, order, begin, until = throws.T
    vx, vy = velocity_of(speed, angle, DIRECTION)
    given = {"x": x, "y": -delivery.line_y, "vx": vx, "vy": vy, "omega": spin, "stone": stone}
    given |= {"clock": clock, "order": order, "sweep_start": begin, "sweep_end": until}
    releases = np.zeros(len(throws), dtype=RELEASE_DTYPE)
    for name, values in given.items():
        releases[name] = values
    return releases


def batch_outcome(
    identifiers: list[int],
    ended: list[list[float]],
    lie: list[list[float]],
    unmoved: list[bool],
    time: float,
    struck: bool,
    bounds: Floats,
    radius: float,
) -> Outcome:
    """What the batch engine tells of a delivery: where every stone came to rest or left play.

    Parameters
    ----------
    identifiers : of the stones, the delivered one last
    ended : (x, y) where each rests or left play, sheet frame [m]
    lie : the same in the delivery frame, NaN for one that left play
    unmoved : whether nothing touched each of the stones before
    time : until all rest [s]
    struck : whether the delivered stone touched another
    bounds : the edges of play, sheet frame
    radius : radius of a stone [m]
    """
    stones: list[StoneState] = []
    status: list[Status] = []
    for identifier, (x, y), place in zip(identifiers, ended, lie, strict=True):
        stones.append(StoneState(x=x, y=y, stone=identifier))
        gone = place[0] != place[0]
        by_side = gone and left_by_the_side(x, y, bounds)
        status.append(Status.OUT_SIDE if by_side else Status.OUT_BACK if gone else Status.REST)
    if status[-1] is Status.REST and not struck and is_hogged(stones[-1].y, DIRECTION, radius):
        status[-1] = Status.HOGGED
    ends = tuple(0.0 if still else time for still in (*unmoved, False))
    return Outcome(stones=tuple(stones), status=tuple(status), time=time, ends=ends, contacts=())
