"""What simulates the throws of `CurlingSheet-v0`: the engine one by one, or the batch together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.envs.known_ice import KnownIce
from curling_env.envs.sheet.reset import FIRST_OWN_STONE
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.batch import RELEASE_DTYPE, BatchEngine, Positions, throw_batch
from curling_env.physics.engine import (
    Engine,
    Outcome,
    Status,
    StoneState,
    is_hogged,
    left_by_the_side,
)
from curling_env.physics.slides import SlideEnd, play_bounds
from curling_env.physics.tuning import QUICK_TOLERANCE
from curling_env.sheet import Direction
from curling_env.throw import Delivery, Throw, velocity_of
from curling_env.typing import Floats, Integers


class Surface:
    """The ice of an episode, with what plays on it and what is known of it.

    Parameters
    ----------
    ice : the ice thrown on
    known : the ice as the agent knows it
    """

    def __init__(self, ice: Ice, known: KnownIce) -> None:
        self.ice, self.known = ice, known

    @cached_property
    def engine(self) -> Engine:
        """What plays single throws, as exactly as `batch`."""
        return Engine(self.ice, tolerance=QUICK_TOLERANCE)

    @cached_property
    def batch(self) -> BatchEngine:
        """What plays many throws together."""
        return BatchEngine(self.ice, tolerance=QUICK_TOLERANCE)

    @cached_property
    def bounds(self) -> dict[int, Floats]:
        """The edges of play towards each end, see `play_bounds`."""
        return {int(end): play_bounds(self.ice, end) for end in Direction}


class Throws(NamedTuple):
    """Throws about to be made on n sheets.

    Parameters
    ----------
    throws : as they leave the hand
    numbers : (n, 3) their speeds, angles and spins [m/s, rad, rad/s]
    surfaces : the ice of each
    stones : (n, k, 3) place and heading of the stones before, sheet frame; NaN where there is none
    identifiers : (k,) of these stones
    direction : (n,) the end played to, 1 or -1
    order : (n,) number of the throw in its episode
    clock : (n,) time since the episode began [s]
    delivery : where throws begin
    """

    throws: Sequence[Throw]
    numbers: Floats
    surfaces: Sequence[Surface]
    stones: Floats
    identifiers: Sequence[int]
    direction: Integers
    order: Integers
    clock: Floats
    delivery: Delivery


class Flown(NamedTuple):
    """Outcomes of throws on n sheets.

    Parameters
    ----------
    stones : (n, k + 1, 3) place and heading of the stones in play, the delivered one last; else NaN
    last : (n, 2) where the delivered stone ended, in play or not, sheet frame [m]
    status : (n,) `Status` of the delivered stone, by its name
    time : (n,) time until all stones rest [s]
    records : for `info`, by name one for each throw
    """

    stones: Floats
    last: Floats
    status: NDArray[np.str_]
    time: Floats
    records: dict[str, list[Any]]


_NAME = f"U{max(map(len, Status))}"
ThrowPlayer = Callable[[Throws], Flown]


class PlayOneByOne:
    """The engine, which solves contacts by pymunk and keeps trajectories.

    Parameters
    ----------
    fps : samples a second of the trajectories
    """

    def __init__(self, fps: float) -> None:
        self._fps = fps

    def __call__(self, throws: Throws) -> Flown:
        n, k = throws.stones.shape[:2]
        stones, last = np.full((n, k + 1, 3), np.nan), np.empty((n, 2))
        outcomes: list[Outcome] = []
        for row in range(n):
            outcome, slots = self._play(throws, row)
            for slot, stone, status in zip(slots, outcome.stones, outcome.status, strict=True):
                if status.in_play:
                    stones[row, slot] = stone.x, stone.y, stone.theta
            last[row] = outcome.delivered.x, outcome.delivered.y
            outcomes.append(outcome)
        return Flown(
            stones=stones,
            last=last,
            status=np.array([one.delivered_status.value for one in outcomes]),
            time=np.array([one.time for one in outcomes]),
            records={
                "outcome": outcomes,
                "trajectory": [one.trajectories[-1] for one in outcomes],
            },
        )

    def _play(self, throws: Throws, row: int) -> tuple[Outcome, list[int]]:
        """The outcome of one throw, and the slots of its stones."""
        there = [(k, *place) for k, place in enumerate(throws.stones[row].tolist())]
        there = [(k, x, y, theta) for k, x, y, theta in there if x == x]  # not NaN
        order = int(throws.order[row])
        outcome = throws.surfaces[row].engine.play(
            throws.throws[row].release(
                Direction(int(throws.direction[row])),
                stone=FIRST_OWN_STONE + order,
                clock=float(throws.clock[row]),
                order=order,
                delivery=throws.delivery,
            ),
            [
                StoneState(x=x, y=y, theta=theta, stone=throws.identifiers[k])
                for k, x, y, theta in there
            ],
            fps=self._fps,
            throw=order,
        )
        return outcome, [*(k for k, *_ in there), len(throws.identifiers)]


def play_together(throws: Throws) -> Flown:
    """Simulate throws together where they share an ice and a direction, without trajectories.

    Raises
    ------
    InputError : stones outside the lines or in one place, or ice on which one never stops
    """
    n, k = throws.stones.shape[:2]
    table = np.zeros(n, dtype=RELEASE_DTYPE)
    table["y"] = -throws.direction * throws.delivery.line_y
    speed, angle, spin = throws.numbers.T
    table["vx"], table["vy"] = velocity_of(speed, angle, throws.direction)
    table["omega"], table["stone"] = spin, FIRST_OWN_STONE + throws.order
    table["clock"], table["order"] = throws.clock, throws.order
    stones, last = np.empty((n, k + 1, 3)), np.empty((n, 2))
    status, time = np.empty(n, dtype=_NAME), np.empty(n)
    for (surface, end), rows in _alike(throws).items():
        bounds = surface.bounds[end]
        if k == 0:
            after = _throw_alone(surface.ice, table[rows], bounds)
        else:
            before, names = throws.stones[rows, :, :2], throws.identifiers
            after = surface.batch.play(before, table[rows], identity=names, bounds=bounds)
        if (after.collisions < 0).any():
            raise InputError("a stone never stops on this ice; check its friction and slope")
        stones[rows, :, :2], stones[rows, :, 2] = after.xy, after.theta
        last[rows], time[rows] = after.last[:, -1], after.time
        status[rows] = _status_of_delivered(after, end, surface, bounds)
    stones[status != Status.REST.value, -1] = np.nan
    return Flown(stones=stones, last=last, status=status, time=time, records={})


def _alike(throws: Throws) -> dict[tuple[Surface, int], list[int]]:
    """The rows that share an ice and a direction."""
    rows: dict[tuple[Surface, int], list[int]] = {}
    for row, key in enumerate(zip(throws.surfaces, throws.direction.tolist(), strict=True)):
        rows.setdefault(key, []).append(row)
    return rows


def _status_of_delivered(
    after: Positions, end: int, surface: Surface, bounds: Floats
) -> NDArray[np.str_]:
    """The status of delivered stones, by its name."""
    x, y = after.last[:, -1].T
    gone = np.isnan(after.xy[:, -1, 0])
    hogged = (after.collisions == 0) & is_hogged(y, end, surface.ice.stone.radius)
    side = left_by_the_side(x, y, bounds)
    out = np.where(side, Status.OUT_SIDE.value, Status.OUT_BACK.value)
    return np.where(gone, out, np.where(hogged, Status.HOGGED.value, Status.REST.value))


def _throw_alone(ice: Ice, releases: NDArray[Any], bounds: Floats) -> Positions:
    """What a batch makes of throws on empty ice, without what happens among stones.

    So an environment of single throws need not compile that.
    """
    alone = throw_batch(ice, releases, bounds=bounds)
    last = np.stack([alone.x, alone.y], axis=-1)[:, None]
    gone = (alone.end == SlideEnd.LEFT_BOUNDS)[:, None]
    return Positions(
        xy=np.where(gone[..., None], np.nan, last),
        last=last,
        theta=np.where(gone, np.nan, alone.theta[:, None]),
        time=alone.time,
        collisions=np.where(alone.end == SlideEnd.NEVER_STOPS, -1, 0).astype(np.int32),
    )
