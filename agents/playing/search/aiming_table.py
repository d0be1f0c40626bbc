"""Tables of an ice that convert many targets into throws at once.

`curling_env.physics.Aim` finds one throw to the millimetre. A search needs some hundreds to a
centimetre, and simulates each of them anyway.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.playing.search.tuning import (
    DRAW_CORRECTIONS,
    DRAW_WEIGHTS,
    HIT_LEVELS,
    HIT_WEIGHTS,
    MAX_ANGLE,
    TABLE_LINES,
    TABLE_SPEEDS,
)
from curling_env.ice import Ice
from curling_env.physics.aim import Aim
from curling_env.physics.batch import releases_of, throw_batch
from curling_env.physics.slides import NO_BOUNDS
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import FROM_HOG_LINE, Delivery
from curling_env.typing import Floats


class AimingTable:
    """Throws towards one end of one ice, for both handles; positions are in the delivery frame.

    Parameters
    ----------
    ice : ice as the thrower knows it
    direction : the end played to
    delivery : start, spin and maximum speed of throws
    """

    def __init__(self, ice: Ice, direction: Direction, delivery: Delivery = FROM_HOG_LINE) -> None:
        self.ice, self.direction, self.delivery = ice, direction, delivery
        self.spins = (delivery.spin, -delivery.spin)
        """Spins of the two handles [rad/s]."""
        button = Aim(ice, direction, delivery=delivery).draw(0.0, 0.0, delivery.spin)
        self.button_speed = 2.1 if button is None else button.speed
        """Speed of the draw to the button [m/s]."""
        self._angles = np.linspace(-MAX_ANGLE, MAX_ANGLE, TABLE_LINES)
        self._speeds = np.linspace(*DRAW_WEIGHTS, TABLE_SPEEDS) * self.button_speed
        self._rests = {spin: self._draws_of(spin) for spin in self.spins}
        self._ways = {
            (weight, spin): self._way_of(weight, spin)
            for weight in HIT_WEIGHTS
            for spin in self.spins
        }

    def draws(self, x: Floats, y: Floats, spin: float) -> Floats:
        """Return throws that come to rest at (x, y) on the empty sheet, (n, 3); NaN for none."""
        reach, bend = self._rests[spin]
        bearing = np.arctan2(-x, y - self.delivery.start_y)
        distance = np.hypot(x, y - self.delivery.start_y)
        angle = bearing.copy()
        speed = np.full(len(x), self.button_speed)
        for _ in range(DRAW_CORRECTIONS):
            # Both tables change little with the line, so the last line is good enough.
            speed = self._speed_for(reach, distance, angle)
            angle = bearing - self._at(bend, speed, angle)
        good = np.isfinite(speed) & (np.abs(angle) < MAX_ANGLE)
        throws = np.column_stack([speed, angle, np.full(len(x), spin)])
        throws[~good] = np.nan
        return throws

    def hits(self, x: Floats, y: Floats, weight: float, spin: float) -> Floats:
        """Return throws of one of `HIT_WEIGHTS` that pass over (x, y), (n, 3); NaN for none."""
        across = self._ways[weight, spin]
        at = np.clip(
            (y - HIT_LEVELS[0]) / (HIT_LEVELS[1] - HIT_LEVELS[0]), 0, len(HIT_LEVELS) - 1.001
        )
        level = at.astype(int)
        part = (at - level)[:, None]
        rows = (1 - part) * across[:, level].T + part * across[:, level + 1].T
        # x falls with the angle, so this counts the lines that pass to the right of the place.
        line = np.clip((rows > x[:, None]).sum(axis=1) - 1, 0, TABLE_LINES - 2)
        here = np.arange(len(x))
        left, right = rows[here, line], rows[here, line + 1]
        with np.errstate(invalid="ignore", divide="ignore"):
            angle = self._angles[line] + (left - x) / (left - right) * (
                self._angles[1] - self._angles[0]
            )
        speed = min(weight * self.button_speed, self.delivery.max_speed)
        throws = np.column_stack([np.full(len(x), speed), angle, np.full(len(x), spin)])
        throws[~(np.abs(angle) < MAX_ANGLE)] = np.nan
        return throws

    # --- the tables -------------------------------------------------------------------------------

    def _draws_of(self, spin: float) -> tuple[Floats, Floats]:
        """Return distance and gain in bearing of each speed and line, (speeds, lines) each."""
        speed, angle = (
            grid.ravel() for grid in np.meshgrid(self._speeds, self._angles, indexing="ij")
        )
        rests = throw_batch(self.ice, self._releases(speed, angle, spin), bounds=NO_BOUNDS)
        d = int(self.direction)
        x, y = d * rests.x, d * rests.y - TEE_Y - self.delivery.start_y
        shape = (TABLE_SPEEDS, TABLE_LINES)
        return np.hypot(x, y).reshape(shape), (np.arctan2(-x, y) - angle).reshape(shape)

    def _way_of(self, weight: float, spin: float) -> Floats:
        """Return the crossings of a hit of each line with each level, (lines, levels) [m]."""
        speed = np.full(TABLE_LINES, min(weight * self.button_speed, self.delivery.max_speed))
        run = throw_batch(
            self.ice,
            self._releases(speed, self._angles, spin),
            bounds=NO_BOUNDS,
            fps=20.0,
        )
        assert run.paths is not None
        d = int(self.direction)
        across = np.full((TABLE_LINES, len(HIT_LEVELS)), np.nan)
        for k, path in enumerate(run.paths):
            path = path[np.isfinite(path[:, 0])]
            x, y = d * path[:, 0], d * path[:, 1] - TEE_Y
            across[k] = np.interp(HIT_LEVELS, y, x, right=np.nan)
        return across

    def _releases(self, speed: Floats, angle: Floats, spin: float) -> NDArray[np.void]:
        throws = np.column_stack([speed, angle, np.full(len(speed), spin)])
        return releases_of(throws, int(self.direction), self.delivery)

    def _speed_for(self, reach: Floats, distance: Floats, angle: Floats) -> Floats:
        """Return the speed that reaches a distance on a line, (n,); NaN beyond the table."""
        at = np.clip(
            (angle + MAX_ANGLE) / (self._angles[1] - self._angles[0]), 0, TABLE_LINES - 1.001
        )
        line = at.astype(int)
        part = at - line
        carried = (1 - part) * reach[:, line] + part * reach[:, line + 1]  # (TABLE_SPEEDS, n)
        row = np.clip((carried < distance).sum(axis=0) - 1, 0, TABLE_SPEEDS - 2)
        here = np.arange(len(distance))
        low, high = carried[row, here], carried[row + 1, here]
        speed = self._speeds[row] + (distance - low) / (high - low) * (
            self._speeds[1] - self._speeds[0]
        )
        inside = (carried[0] <= distance) & (distance <= carried[-1])
        return np.where(inside, speed, np.nan)

    def _at(self, table: Floats, speed: Floats, angle: Floats) -> Floats:
        """Return the value of a table, bilinear in speed and line."""
        u = (np.nan_to_num(speed) - self._speeds[0]) / (self._speeds[1] - self._speeds[0])
        v = (angle + MAX_ANGLE) / (self._angles[1] - self._angles[0])
        u, v = np.clip(u, 0, TABLE_SPEEDS - 1.001), np.clip(v, 0, TABLE_LINES - 1.001)
        i, j = u.astype(int), v.astype(int)
        u, v = u - i, v - j
        return (1 - u) * ((1 - v) * table[i, j] + v * table[i, j + 1]) + u * (
            (1 - v) * table[i + 1, j] + v * table[i + 1, j + 1]
        )
