"""Simulators of the throws of `CurlingSheet-v0`: the engine one by one, or the batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.envs.field import Field
from curling_env.envs.known_ice import KnownIce
from curling_env.envs.random_ice import DrawnIces, RandomIces
from curling_env.envs.sheet.reset import FIRST_OWN_STONE
from curling_env.ice import Ice
from curling_env.physics.batch import releases_of
from curling_env.physics.engine import (
    Engine,
    Outcome,
    Status,
    StoneState,
)
from curling_env.physics.tuning import QUICK_TOLERANCE
from curling_env.sheet import Direction
from curling_env.throw import Delivery, Throw
from curling_env.typing import Floats, Integers, Singles


class Surface(Field):
    """Ice of an episode, with its simulator and its known ice.

    Parameters
    ----------
    ice : the ice thrown on
    known : the ice as the agent knows it
    identifiers : of the stones, by their slots
    """

    def __init__(self, ice: Ice, known: KnownIce, identifiers: Sequence[int]) -> None:
        super().__init__(ice)
        self.known = known
        self.of_stones = _of_stones(known, identifiers)
        """(slots + 1, k) what is known of each stone, and of none."""
        self.field: Field = self
        """Simulator of its throws; surfaces that share one are played together."""
        self.place = 0
        """Index of its ice in the field."""
        self.stone_radius = ice.stone.radius

    def features(self, direction: Direction) -> Singles:
        """Return the known ice features, towards an end; see `KnownIce.features`."""
        return self.known.features(direction)

    @cached_property
    def engine(self) -> Engine:
        """Simulator of single throws."""
        return Engine(self.ice, tolerance=QUICK_TOLERANCE)


class DrawnSurface(Surface):
    """One of many ices drawn at once; most of it is computed on first access.

    Parameters
    ----------
    field : of all of them
    place : its index in that field
    """

    def __init__(self, field: DrawnField, place: int) -> None:
        self.field, self.place, self.drawn = field, place, field
        self.of_stones, self.stone_radius = field.of_stones, field.ice.stone.radius

    def features(self, direction: Direction) -> Singles:
        """Return the known ice features, towards an end."""
        return self.drawn.features(direction)[self.place]

    @cached_property
    def ice(self) -> Ice:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Ice of the throws."""
        return self.drawn.ices.ices.ice(self.place)

    @cached_property
    def known(self) -> KnownIce:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Known ice."""
        distribution = self.drawn.distribution
        estimate = self.drawn.ices.estimate(self.place)
        return KnownIce(distribution.as_known(estimate, distribution.knows))


class DrawnField(Field):
    """Many ices drawn at once, on which throws are simulated together.

    Parameters
    ----------
    distribution : the distribution of the ices
    ices : the ices
    of_stones : what is known of each stone, as of a `Surface`
    """

    def __init__(self, distribution: RandomIces, ices: DrawnIces, of_stones: Singles) -> None:
        super().__init__(distribution.family.base, ices.ices)
        self.distribution, self.ices, self.of_stones = distribution, ices, of_stones
        self._features: dict[Direction, Singles] = {}

    def features(self, direction: Direction) -> Singles:
        """Return the features of the known ices, (n, m)."""
        if direction not in self._features:
            self._features[direction] = self.distribution.features(self.ices, direction)
        return self._features[direction]


def drawn_surfaces(
    distribution: RandomIces, ices: DrawnIces, identifiers: Sequence[int]
) -> list[Surface]:
    """Return the surfaces of many ices drawn at once."""
    of_stones = _of_stones(KnownIce(distribution.family.base), identifiers)
    field = DrawnField(distribution, ices, of_stones)
    return [DrawnSurface(field, k) for k in range(len(ices.estimated))]


def _of_stones(known: KnownIce, identifiers: Sequence[int]) -> Singles:
    features = known.of_stones(identifiers)
    return np.concatenate([features, np.zeros_like(features[:1])])


class Throws(NamedTuple):
    """Throws to be made on n sheets.

    Parameters
    ----------
    numbers : (n, 3) their speeds, angles and spins as they leave the hand [m/s, rad, rad/s]
    surfaces : the ice of each
    stones : (n, k, 3) place and heading of the stones before, sheet frame; NaN for missing ones
    identifiers : (k,) of these stones
    direction : (n,) the end played to, 1 or -1
    order : (n,) number of the throw in its episode
    clock : (n,) time since the episode began [s]
    delivery : where throws begin
    """

    numbers: Floats
    surfaces: Sequence[Surface]
    stones: Floats
    identifiers: Sequence[int]
    direction: Integers
    order: Integers
    clock: Floats
    delivery: Delivery

    @property
    def each(self) -> list[Throw]:
        """Return the throws as objects."""
        return [Throw(speed=v, angle=a, spin=s) for v, a, s in self.numbers.tolist()]


class ThrowOutcomes(NamedTuple):
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


ThrowPlayer = Callable[[Throws], ThrowOutcomes]


class PlayOneByOne:
    """Engine that solves contacts by pymunk and keeps trajectories.

    Parameters
    ----------
    fps : samples a second of the trajectories
    """

    def __init__(self, fps: float) -> None:
        self._fps = fps

    def __call__(self, throws: Throws) -> ThrowOutcomes:
        n, k = throws.stones.shape[:2]
        stones, last = np.full((n, k + 1, 3), np.nan), np.empty((n, 2))
        outcomes: list[Outcome] = []
        for row, throw in enumerate(throws.each):
            outcome, slots = self._play(throws, row, throw)
            for slot, stone, status in zip(slots, outcome.stones, outcome.status, strict=True):
                if status.in_play:
                    stones[row, slot] = stone.x, stone.y, stone.theta
            last[row] = outcome.delivered.x, outcome.delivered.y
            outcomes.append(outcome)
        return ThrowOutcomes(
            stones=stones,
            last=last,
            status=np.array([one.delivered_status.value for one in outcomes]),
            time=np.array([one.time for one in outcomes]),
            records={
                "outcome": outcomes,
                "trajectory": [one.trajectories[-1] for one in outcomes],
            },
        )

    def _play(self, throws: Throws, row: int, throw: Throw) -> tuple[Outcome, list[int]]:
        """Return the outcome of one throw, and the slots of its stones."""
        there = [(k, *place) for k, place in enumerate(throws.stones[row].tolist())]
        there = [(k, x, y, theta) for k, x, y, theta in there if x == x]  # not NaN
        order = int(throws.order[row])
        outcome = throws.surfaces[row].engine.play(
            throw.release(
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


def play_together(throws: Throws) -> ThrowOutcomes:
    """Simulate throws together if they share an ice and a direction, without trajectories.

    Raises
    ------
    InputError : stones outside the lines or in one place, or ice on which one never stops
    """
    n, k = throws.stones.shape[:2]
    stones, last = np.empty((n, k + 1, 3)), np.empty((n, 2))
    status, time = np.empty(n, dtype=f"U{max(map(len, Status))}"), np.empty(n)
    releases = releases_of(
        throws.numbers,
        throws.direction,
        throws.delivery,
        stone=FIRST_OWN_STONE + throws.order,
        clock=throws.clock,
        order=throws.order,
    )
    alike: dict[tuple[Field, int], list[int]] = {}
    for row, (surface, end) in enumerate(
        zip(throws.surfaces, throws.direction.tolist(), strict=True)
    ):
        alike.setdefault((surface.field, end), []).append(row)
    for (field, end), rows in alike.items():
        before, names = throws.stones[rows, :, :2], throws.identifiers
        which = np.array([throws.surfaces[row].place for row in rows])
        after = field.play(before, names, releases[rows], end, which=which)
        stones[rows, :, :2], stones[rows, :, 2] = after.xy, after.theta
        last[rows], time[rows] = after.last[:, -1], after.time
        status[rows] = field.statuses(after, end)[:, -1]
    stones[status != Status.REST.value, -1] = np.nan
    return ThrowOutcomes(stones=stones, last=last, status=status, time=time, records={})
