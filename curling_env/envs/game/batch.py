"""Deliveries in many ends as arrays, and what the batch engine tells of each."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.game.simulator import direction_of
from curling_env.physics.many_stones.batch import RELEASE_DTYPE, Positions
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


class Facts(NamedTuple):
    """What a delivery among many left, of which an outcome can be made.

    Parameters
    ----------
    after : the positions after the deliveries of many ends
    row : the end among them
    identifiers : of the stones, the delivered one last
    columns : where the stones lie in `after`, without the delivered one, which is last there
    unmoved : whether nothing touched each of the stones before
    bounds : the edges of play, sheet frame
    radius : radius of a stone [m]
    """

    after: Positions
    row: int
    identifiers: list[int]
    columns: list[int]
    unmoved: list[bool]
    bounds: Floats
    radius: float


class BatchOutcome(Outcome):
    """What the batch engine tells of a delivery: where every stone came to rest or left play.

    It is made of the facts when somebody looks at it, which few do.
    """

    def __init__(self, facts: Facts) -> None:
        vars(self)["_facts"] = facts

    def __getattr__(self, name: str) -> Any:
        if "_facts" not in vars(self):
            raise AttributeError(name)
        vars(self).update(vars(_outcome(vars(self).pop("_facts"))))
        return getattr(self, name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Outcome) and _whole(self) == _whole(other)

    __hash__ = Outcome.__hash__

    def __reduce__(self) -> tuple[Any, ...]:
        return _whole, (_whole(self),)


def _whole(outcome: Outcome) -> Outcome:
    """An outcome that is all there."""
    return Outcome(**{part.name: getattr(outcome, part.name) for part in fields(Outcome)})


def _outcome(facts: Facts) -> Outcome:
    after, row, identifiers, columns, unmoved, bounds, radius = facts
    columns = [*columns, -1]
    stones: list[StoneState] = []
    status: list[Status] = []
    ended, lie = after.last[row, columns].tolist(), after.xy[row, columns].tolist()
    for identifier, (x, y), place in zip(identifiers, ended, lie, strict=True):
        stones.append(StoneState(x=x, y=y, stone=identifier))
        gone = place[0] != place[0]
        by_side = gone and left_by_the_side(x, y, bounds)
        status.append(Status.OUT_SIDE if by_side else Status.OUT_BACK if gone else Status.REST)
    struck, time = bool(after.collisions[row]), float(after.time[row])
    if status[-1] is Status.REST and not struck and is_hogged(stones[-1].y, DIRECTION, radius):
        status[-1] = Status.HOGGED
    ends = tuple(0.0 if still else time for still in (*unmoved, False))
    return Outcome(stones=tuple(stones), status=tuple(status), time=time, ends=ends, contacts=())
