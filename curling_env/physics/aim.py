"""Aiming: the throw that comes to rest at a point of the empty sheet, or passes over it.

A table of straight throws has the distance and the curl for each speed. A few corrections with the
slopes of that table then reach the point within a millimetre.
"""

from __future__ import annotations

from functools import partial
from math import asin, cos, hypot, sin
from typing import Any

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.integrator import (
    CONTACT,
    LEFT_BOUNDS,
    NEVER_STOPS,
    REST,
    ThrowTimes,
    integrate,
)
from curling_env.physics.law import compile_law
from curling_env.physics.motion import MOTION_SIZE, ORDER, STONE
from curling_env.physics.state import State
from curling_env.physics.step import new_workspace
from curling_env.physics.surroundings import NO_BOUNDS, NO_OBSTACLES, Limits
from curling_env.physics.tuning import MAX_AIM_ANGLE, MAX_CORRECTIONS, ON_TARGET, QUICK_TOLERANCE
from curling_env.sheet import BACK_LINE_Y, TEE_Y, Direction
from curling_env.throw import FROM_HOG_LINE, Delivery, Throw
from curling_env.typing import Floats

_TEE = np.array([0.0, TEE_Y])
MAX_CACHED_DRAWS = 1_000
"""Number of draws that an aim caches."""


class Aim:
    """Search for throws towards one end of one ice; positions are in the delivery frame.

    Parameters
    ----------
    ice : ice that the thrower believes in
    clock, order, stone : clock, order and stone of the throws in their session, for effects that
        depend on them
    tolerance : maximum error of a rest on the roughest ice [m]
    delivery : start and maximum speed of throws
    x : offset of the release of the throws that are found [m]
    sweep : start and end of the sweeping, after the release [s]

    Raises
    ------
    InputError : an effect that is not in the catalogue, or parameters its card does not allow
    """

    def __init__(
        self,
        ice: Ice,
        direction: Direction = Direction.AWAY,
        *,
        clock: float = 0.0,
        order: int = 0,
        stone: int = 0,
        tolerance: float = QUICK_TOLERANCE,
        delivery: Delivery = FROM_HOG_LINE,
        x: float = 0.0,
        sweep: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.ice = ice
        self.direction = direction
        self.delivery = delivery
        self._start_y, self._max_speed = delivery.start_y, delivery.max_speed
        self._d, self._reach = int(direction), 2 * ice.stone.radius
        self._law = compile_law(ice)
        self._x, self._place = x, ThrowTimes(clock, *sweep)
        self._motion = np.zeros(MOTION_SIZE)
        self._motion[[ORDER, STONE]] = order, stone
        self._work = new_workspace(tolerance)
        self._tables: dict[float, Floats] = {}
        self._draws: dict[tuple[float, ...], Throw | None] = {}
        place = {"clock": clock, "order": order, "stone": stone}
        self._again = partial(Aim, ice, direction, **place, tolerance=tolerance, delivery=delivery,
                              x=x, sweep=sweep)  # fmt: skip

    def __reduce__(self) -> tuple[Any, ...]:
        # The law holds addresses of this process.
        return self._again, ()

    def rest(self, throw: Throw) -> tuple[float, float] | None:
        """Return the place of rest of a throw, delivery frame [m]; None if it never stops."""
        end, x, y = self._slide(throw.speed, throw.angle, throw.spin, throw.x, NO_BOUNDS)
        return None if end == NEVER_STOPS else (x, y)

    def draw(self, x: float, y: float, spin: float, *, within: float = ON_TARGET) -> Throw | None:
        """Return the throw that comes to rest at (x, y) with this spin, or None if none was found.

        It is cached: players draw to the same places repeatedly. `within` is the largest distance
        from the place [m].
        """
        place = x, y, spin, within
        if place not in self._draws:
            if len(self._draws) >= MAX_CACHED_DRAWS:
                self._draws.clear()
            self._draws[place] = self._find(x, y, spin, on_target=within)
        return self._draws[place]

    def draw_weight(self, spin: float = 0.0, *, y: float = 0.0) -> float | None:
        """Return the speed at which a straight throw comes to rest level with y, or None [m/s]."""
        throw = self._find(None, y, spin, on_target=0.1 * ON_TARGET)
        return None if throw is None else throw.speed

    def through(self, x: float, y: float, speed: float, spin: float) -> Throw | None:
        """Return the throw of this weight that passes over (x, y), or None if it does not reach
        it.
        """
        return self._find(x, y, spin, weight=speed)

    def _find(
        self,
        x: float | None,
        y: float,
        spin: float,
        *,
        weight: float | None = None,
        on_target: float = ON_TARGET,
    ) -> Throw | None:
        """Return the throw that rests at (x, y), or passes over it with a given weight; None if
        none does.

        Without x it is the straight throw that rests level with y.
        """
        distance = y - self._start_y
        if weight is None:
            table = self._table(spin)
            if not (len(table) > 0 and table[0, 1] < distance < table[-1, 1]):
                return None
            bounds, wanted = NO_BOUNDS, REST
            speed, curl, slope = (
                float(np.interp(distance, table[:, 1], table[:, k])) for k in (0, 2, 3)
            )
        else:
            bounds, wanted = self._bounds_until(y), LEFT_BOUNDS
            speed, curl, slope = weight, 0.0, 1.0
        sine = 0.0 if x is None else (x - self._x - curl) / distance
        angle = -asin(max(min(sine, MAX_AIM_ANGLE), -MAX_AIM_ANGLE))
        for _ in range(MAX_CORRECTIONS):
            end, at_x, at_y = self._slide(speed, angle, spin, self._x, bounds)
            if end != wanted:
                return None
            left = 0.0 if x is None else at_x - x
            short = y - at_y if weight is None else 0.0
            if hypot(left, short) < on_target:
                return Throw(speed=speed, angle=angle, spin=spin, x=self._x)
            speed += short / slope
            angle += left / distance
            too_fast = weight is None and not 0 < speed <= self._max_speed
            if too_fast or not abs(angle) < MAX_AIM_ANGLE:
                return None
        return None

    def path_clears(self, throw: Throw, stones: Floats, *, until: float) -> bool:
        """Return whether a throw reaches y = until [m], or rests, without touching a stone.

        The centres of the stones are (k, 2), delivery frame [m].
        """
        bounds, on_sheet = self._bounds_until(until), self._d * (stones + _TEE)
        end, _, _ = self._slide(throw.speed, throw.angle, throw.spin, throw.x, bounds, on_sheet)
        return end != CONTACT

    def _bounds_until(self, y: float) -> Floats:
        """Return bounds that end a slide at y."""
        bounds = NO_BOUNDS.copy()
        bounds[3 if self._d > 0 else 2] = self._d * (y + TEE_Y)
        return bounds

    def _table(self, spin: float) -> Floats:
        """Return rows of speed, distance, sideways drift and metres per m/s, by speed."""
        if spin not in self._tables:
            rows: list[tuple[float, float, float]] = []
            speed = 0.05
            while speed < self._max_speed:
                end, x, y = self._slide(speed, 0.0, spin, self._x, NO_BOUNDS)
                if end == NEVER_STOPS or (rows and y - self._start_y <= rows[-1][1]):
                    break
                rows.append((speed, y - self._start_y, x - self._x))
                if y > BACK_LINE_Y - TEE_Y + 2.0:
                    break
                speed *= 1.25
            table = np.array(rows).reshape(-1, 3)
            slope = np.gradient(table[:, 1], table[:, 0]) if len(rows) > 1 else np.ones(len(rows))
            self._tables[spin] = np.column_stack([table, slope])
        return self._tables[spin]

    def _slide(
        self,
        speed: float,
        angle: float,
        spin: float,
        x: float,
        bounds: Floats,
        obstacles: Floats = NO_OBSTACLES,
    ) -> tuple[int, float, float]:
        """Return the end of a slide, and its place in the delivery frame [m]."""
        d, work = self._d, self._work
        along, left = d * speed * cos(angle), d * speed * sin(angle)
        state = work.states[2]
        state[:] = d * x, -d * self.delivery.line_y, -left, along, 0.0, spin
        limits = Limits(bounds, obstacles, self._reach)
        law, motion, place = self._law, self._motion, self._place
        end, _, _ = integrate(law, motion, place, limits, work.nodes[:0], 0.0, work)
        return end, d * float(state[State.X]), d * float(state[State.Y]) - TEE_Y
