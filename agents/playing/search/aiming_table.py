"""An atlas of an ice: tables that turn many targets into throws at once.

`curling_env.physics.one_stone.aim` finds one throw to the millimetre; a search wants some hundred
to a centimetre, and simulates each of them anyway.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.playing.players.aiming import SPIN
from curling_env.ice import Ice
from curling_env.physics.batch import RELEASE_DTYPE, throw_batch
from curling_env.physics.one_stone.aim import START_Y, Aim
from curling_env.physics.one_stone.slide import NO_BOUNDS
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import MAX_SPEED, velocity_of
from curling_env.typing import Floats

WIDEST = 0.11
"""Lines reach so far to each side [rad]: three metres at the tee."""
LINES = 15
DRAWS = 12
"""Weights in the table of draws."""
SHORTEST, LONGEST = 0.84, 1.09
"""Weights of that table over the draw to the button: from short of the hog line to far too long."""
HITS = (1.1, 1.25, 1.5, 1.9)
"""Weights of hits over the draw to the button: control, board, normal, peel."""
LEVELS = np.linspace(-6.6, 1.8, 15)
"""Distances before the tee at which a hit's way is tabulated [m]."""
ROUNDS = 6
"""Corrections of a draw; each makes the error some ten times smaller."""


class Atlas:
    """Throws towards one end of one ice, both handles; positions are in the delivery frame.

    Parameters
    ----------
    ice : as the thrower knows it
    direction : the end played to
    """

    def __init__(self, ice: Ice, direction: Direction) -> None:
        self.ice, self.direction = ice, direction
        button = Aim(ice, direction).draw(0.0, 0.0, SPIN)
        self.button_speed = 2.1 if button is None else button.speed
        """Weight of the draw to the button [m/s]."""
        self._angles = np.linspace(-WIDEST, WIDEST, LINES)
        self._speeds = np.linspace(SHORTEST, LONGEST, DRAWS) * self.button_speed
        self._rests = {spin: self._draws_of(spin) for spin in (SPIN, -SPIN)}
        self._ways = {
            (weight, spin): self._way_of(weight, spin) for weight in HITS for spin in (SPIN, -SPIN)
        }

    def draws(self, x: Floats, y: Floats, spin: float) -> Floats:
        """Throws that come to rest at (x, y) on the empty sheet, (n, 3); NaN for none."""
        reach, bend = self._rests[spin]
        bearing = np.arctan2(-x, y - START_Y)
        distance = np.hypot(x, y - START_Y)
        angle = bearing.copy()
        speed = np.full(len(x), self.button_speed)
        for _ in range(ROUNDS):
            # Both tables change little with the line, so the column next to it is searched.
            speed = self._speed_for(reach, distance, angle)
            angle = bearing - self._at(bend, speed, angle)
        good = np.isfinite(speed) & (np.abs(angle) < WIDEST)
        throws = np.column_stack([speed, angle, np.full(len(x), spin)])
        throws[~good] = np.nan
        return throws

    def hits(self, x: Floats, y: Floats, weight: float, spin: float) -> Floats:
        """Throws of one of the weights `HITS` that run over (x, y), (n, 3); NaN for none."""
        across = self._ways[weight, spin]
        at = np.clip((y - LEVELS[0]) / (LEVELS[1] - LEVELS[0]), 0, len(LEVELS) - 1.001)
        level = at.astype(int)
        part = (at - level)[:, None]
        rows = (1 - part) * across[:, level].T + part * across[:, level + 1].T
        # x falls with the angle: how many lines pass to the right of the place.
        line = np.clip((rows > x[:, None]).sum(axis=1) - 1, 0, LINES - 2)
        here = np.arange(len(x))
        left, right = rows[here, line], rows[here, line + 1]
        with np.errstate(invalid="ignore", divide="ignore"):
            angle = self._angles[line] + (left - x) / (left - right) * (
                self._angles[1] - self._angles[0]
            )
        speed = min(weight * self.button_speed, MAX_SPEED)
        throws = np.column_stack([np.full(len(x), speed), angle, np.full(len(x), spin)])
        throws[~(np.abs(angle) < WIDEST)] = np.nan
        return throws

    # --- the tables -------------------------------------------------------------------------------

    def _draws_of(self, spin: float) -> tuple[Floats, Floats]:
        """How far each (weight, line) carries, and how much its bearing gains: (DRAWS, LINES)."""
        speed, angle = (
            grid.ravel() for grid in np.meshgrid(self._speeds, self._angles, indexing="ij")
        )
        rests = throw_batch(self.ice, self._releases(speed, angle, spin), bounds=NO_BOUNDS)
        d = int(self.direction)
        x, y = d * rests.x, d * rests.y - TEE_Y - START_Y
        shape = (DRAWS, LINES)
        return np.hypot(x, y).reshape(shape), (np.arctan2(-x, y) - angle).reshape(shape)

    def _way_of(self, weight: float, spin: float) -> Floats:
        """Where a hit of each line crosses each level, (LINES, LEVELS) [m]."""
        speed = np.full(LINES, min(weight * self.button_speed, MAX_SPEED))
        run = throw_batch(
            self.ice,
            self._releases(speed, self._angles, spin),
            bounds=NO_BOUNDS,
            fps=20.0,
        )
        assert run.paths is not None
        d = int(self.direction)
        across = np.full((LINES, len(LEVELS)), np.nan)
        for k, path in enumerate(run.paths):
            path = path[np.isfinite(path[:, 0])]
            x, y = d * path[:, 0], d * path[:, 1] - TEE_Y
            across[k] = np.interp(LEVELS, y, x, right=np.nan)
        return across

    def _releases(self, speed: Floats, angle: Floats, spin: float) -> NDArray[np.void]:
        d = int(self.direction)
        releases = np.zeros(len(speed), dtype=RELEASE_DTYPE)
        releases["y"] = -d * HOG_LINE_Y
        releases["vx"], releases["vy"] = velocity_of(speed, angle, d)
        releases["omega"] = spin
        return releases

    def _speed_for(self, reach: Floats, distance: Floats, angle: Floats) -> Floats:
        """The weight that carries so far on a line; NaN beyond the table."""
        at = np.clip((angle + WIDEST) / (self._angles[1] - self._angles[0]), 0, LINES - 1.001)
        line = at.astype(int)
        part = at - line
        carried = (1 - part) * reach[:, line] + part * reach[:, line + 1]  # (DRAWS, n)
        step = np.clip((carried < distance).sum(axis=0) - 1, 0, DRAWS - 2)
        here = np.arange(len(distance))
        low, high = carried[step, here], carried[step + 1, here]
        speed = self._speeds[step] + (distance - low) / (high - low) * (
            self._speeds[1] - self._speeds[0]
        )
        inside = (carried[0] <= distance) & (distance <= carried[-1])
        return np.where(inside, speed, np.nan)

    def _at(self, table: Floats, speed: Floats, angle: Floats) -> Floats:
        """A table's value, bilinear in weight and line."""
        u = (np.nan_to_num(speed) - self._speeds[0]) / (self._speeds[1] - self._speeds[0])
        v = (angle + WIDEST) / (self._angles[1] - self._angles[0])
        u, v = np.clip(u, 0, DRAWS - 1.001), np.clip(v, 0, LINES - 1.001)
        i, j = u.astype(int), v.astype(int)
        u, v = u - i, v - j
        return (1 - u) * ((1 - v) * table[i, j] + v * table[i, j + 1]) + u * (
            (1 - v) * table[i + 1, j] + v * table[i + 1, j + 1]
        )
