"""Aiming: the throw that comes to rest at a point of the empty sheet, or runs over it.

A table of straight throws tells how far a weight carries and how much it curls on its way; a few
corrections with its slopes then land within a millimetre. Some ten slides for the table, three to
five for each throw.
"""

from __future__ import annotations

from math import asin, cos, hypot, sin

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.effects.motion import MOTION_SIZE
from curling_env.physics.law import compile_law
from curling_env.physics.one_stone.slide import NO_OBSTACLES, SlideEnd, new_work, slide_kernel
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import MAX_SPEED, Throw
from curling_env.typing import Floats

ON_TARGET = 1e-3
"""Distance from the target that is near enough [m]."""
CORRECTIONS = 12
WIDEST = 0.3
"""Largest angle to which a line is corrected [rad]."""

_NO_SAMPLES = np.empty((0, 4))
_EVERYWHERE = np.array([-np.inf, np.inf, -np.inf, np.inf])
START_Y = -HOG_LINE_Y - TEE_Y
"""Where a stone is released, delivery frame [m]."""


class Aim:
    """Finds throws towards one end of one ice; positions are in the delivery frame.

    Parameters
    ----------
    ice : as the thrower knows it
    direction : the end played to

    Raises
    ------
    InputError : an effect that is not in the catalogue, or parameters its card does not allow
    """

    def __init__(self, ice: Ice, direction: Direction = Direction.AWAY) -> None:
        self.ice = ice
        self.direction = direction
        self._law = compile_law(ice)
        self._work = new_work()
        self._tables: dict[float, Floats] = {}

    def rest(self, throw: Throw) -> tuple[float, float] | None:
        """Where a throw comes to rest, delivery frame [m]; None if it never stops."""
        end, x, y = self._slide(throw.speed, throw.angle, throw.spin, throw.x, _EVERYWHERE)
        return None if end == SlideEnd.NEVER_STOPS else (x, y)

    def draw(self, x: float, y: float, spin: float) -> Throw | None:
        """The throw that comes to rest at (x, y) with this spin, or None if none was found."""
        table = self._table(spin)
        distance = y - START_Y
        if not table[0, 1] < distance < table[-1, 1]:
            return None
        speed = float(np.interp(distance, table[:, 1], table[:, 0]))
        curl = float(np.interp(distance, table[:, 1], table[:, 2]))
        angle = -asin(max(min((x - curl) / distance, WIDEST), -WIDEST))
        slope = float(np.interp(distance, table[:, 1], table[:, 3]))
        for _ in range(CORRECTIONS):
            end, rest_x, rest_y = self._slide(speed, angle, spin, 0.0, _EVERYWHERE)
            if end == SlideEnd.NEVER_STOPS:
                return None
            if hypot(rest_x - x, rest_y - y) < ON_TARGET:
                return Throw(speed=speed, angle=angle, spin=spin)
            speed += (y - rest_y) / slope
            angle += (rest_x - x) / distance
            if not (0 < speed <= MAX_SPEED and abs(angle) < WIDEST):
                return None
        return None

    def through(self, x: float, y: float, speed: float, spin: float) -> Throw | None:
        """The throw of this weight that runs over (x, y), or None if it does not get there."""
        distance = y - START_Y
        bounds = _EVERYWHERE.copy()
        bounds[3 if self.direction > 0 else 2] = self.direction * (y + TEE_Y)
        angle = -asin(max(min(x / distance, WIDEST), -WIDEST))
        for _ in range(CORRECTIONS):
            end, at_x, _ = self._slide(speed, angle, spin, 0.0, bounds)
            if end != SlideEnd.LEFT_BOUNDS:
                return None
            if abs(at_x - x) < ON_TARGET:
                return Throw(speed=speed, angle=angle, spin=spin)
            angle += (at_x - x) / distance
            if not abs(angle) < WIDEST:
                return None
        return None

    def path_clears(self, throw: Throw, stones: Floats, *, until: float) -> bool:
        """Whether a throw runs as far as y = until, or to rest, without touching a stone.

        Parameters
        ----------
        stones : (k, 2) centres, delivery frame [m]
        until : [m]
        """
        bounds = _EVERYWHERE.copy()
        bounds[3 if self.direction > 0 else 2] = self.direction * (until + TEE_Y)
        on_sheet = self.direction * (stones + np.array([0.0, TEE_Y]))
        end, _, _ = self._slide(
            throw.speed, throw.angle, throw.spin, throw.x, bounds, np.ascontiguousarray(on_sheet)
        )
        return end != SlideEnd.CONTACT

    def _table(self, spin: float) -> Floats:
        """Rows of speed, distance carried, sideways drift and metres per m/s, by speed."""
        if spin not in self._tables:
            rows: list[tuple[float, float, float]] = []
            speed = 0.05
            while speed < MAX_SPEED:
                end, x, y = self._slide(speed, 0.0, spin, 0.0, _EVERYWHERE)
                if end == SlideEnd.NEVER_STOPS or (rows and y - START_Y <= rows[-1][1]):
                    break
                rows.append((speed, y - START_Y, x))
                if y > BACK_LINE_Y - TEE_Y + 2.0:
                    break
                speed *= 1.25
            table = np.array(rows)
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
        """How a slide ends and where, delivery frame [m]."""
        d = int(self.direction)
        state = np.array(
            [d * x, -d * HOG_LINE_Y, -d * speed * sin(angle), d * speed * cos(angle), 0.0, spin]
        )
        end, _, _ = slide_kernel(
            self._law,
            state,
            np.zeros(MOTION_SIZE),
            0.0,
            0.0,
            0.0,
            bounds,
            obstacles,
            2 * self.ice.stone.radius,
            1.0,
            _NO_SAMPLES,
            self._work,
        )
        return int(end), d * float(state[0]), d * float(state[1]) - TEE_Y
