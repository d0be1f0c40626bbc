"""A stone riding its course under the force law, and what the ride owes to each cell's friction.

The law gives the acceleration; its part along the course moves the stone. Spin is not integrated
but taken from the measured heading (methods: only r²m/I matters and is not known to 10 %), as
ω = ω₀ (v/v₀)^p with p fitted, the form that a symmetric running band gives (physics T10).

Sensitivities obey the linearised equation δs'' = (∂a/∂s) δs + (∂a/∂v) δv + δa: one pass over the
path yields those for all cells, the start and the speed at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import fabs
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import Ice
from curling_env.physics.compiled import compiled
from curling_env.physics.effects.motion import (
    CLOCK,
    HEADING,
    MOTION_SIZE,
    ORDER,
    PUSH_SIZE,
    STONE,
    SWEPT,
    T,
)
from curling_env.physics.law import Law, compile_law, feel, mu_of_map
from curling_env.typing import Floats
from friction_estimation.inversion.throw.path import STEP, Course

TICK = 0.02
"""Between the instants of a ride [s]: Runge–Kutta then errs by micrometres on the paper's cells."""
NEARBY = 0.1
"""Half the distance over which the law's change along the course is taken [m]: several ticks, so
that the jump at the edge of a constant cell is neither missed nor counted twice."""
SLOWEST = 2e-3
"""Below this speed the rest is uniform deceleration, 20 µm of it [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Passenger:
    """What a ride needs to know of one throw besides where and how fast it starts.

    Parameters
    ----------
    course : the line it follows
    duration : how long it is followed [s]
    spin, spin_power : ω₀ at the speed `spin_speed`, and p [rad/s, 1]
    spin_speed : speed at which the spin is ω₀ [m/s]
    heading : of the handle at the start [rad]
    clock, order, stone : of the session, as the law reads them
    sweeps : (k, 2) beginnings and ends of sweeping since the start [s]
    """

    course: Course
    duration: float
    spin: float = 0.0
    spin_power: float = 0.2
    spin_speed: float = 1.0
    heading: float = 0.0
    clock: float = 0.0
    order: int = 0
    stone: int = 0
    sweeps: Floats


@dataclass(frozen=True, kw_only=True)
class Ride:
    """A ride at instants `TICK` apart.

    Parameters
    ----------
    t : (n,) since the start [s]
    distance, speed, acceleration : (n,) along the course [m, m/s, m/s²]
    friction : (n,) part of the acceleration that is proportional to the map's μ [m/s²]
    by_distance, by_speed : (n,) derivatives of the acceleration [1/s²], [1/s]
    """

    t: Floats
    distance: Floats
    speed: Floats
    acceleration: Floats
    friction: Floats
    by_distance: Floats
    by_speed: Floats

    def distance_at(self, t: Floats) -> Floats:
        """Distance at any time within the ride, (m,) [m]: the cubic through both ends' motion."""
        i = np.clip((t / TICK).astype(int), 0, len(self.t) - 2)
        u = np.clip(t / TICK - i, 0.0, 1.0)
        s0, s1 = self.distance[i], self.distance[i + 1]
        v0, v1 = self.speed[i] * TICK, self.speed[i + 1] * TICK
        return (
            s0 * (1 + 2 * u) * (1 - u) ** 2
            + v0 * u * (1 - u) ** 2
            + s1 * u**2 * (3 - 2 * u)
            + v1 * u**2 * (u - 1)
        )

    def tangents_at(self, columns: Floats, t: Floats) -> Floats:
        """Columns (n, m) given at the instants, read at times (k,) → (k, m)."""
        i = np.clip((t / TICK).astype(int), 0, len(self.t) - 2)
        u = np.clip(t / TICK - i, 0.0, 1.0)[:, None]
        return columns[i] * (1 - u) + columns[i + 1] * u


class Track:
    """The law compiled once for an ice: rides of all throws on it."""

    def __init__(self, ice: Ice) -> None:
        self.ice = ice
        self._law = compile_law(ice)

    @property
    def mu(self) -> Floats:
        """Friction of the map that is ridden on, (rows, columns)."""
        return self._law.mu

    def set_level(self, level: float) -> Track:
        """Ride on uniform friction from now on; `level` is its ln μ."""
        return self.set_field(level, np.zeros(self._law.mu.size))

    def set_field(self, level: float, field: Floats) -> Track:
        """Ride on a map from now on: ln μ is the level plus the field (cells,)."""
        mu = np.exp(level + field).reshape(self._law.mu.shape)
        self._law = self._law._replace(mu=np.ascontiguousarray(mu), patterned=True)
        return self

    def under(self, ice: Ice) -> Track:
        """Rides over the same map under the effects of another ice."""
        track = Track(ice)
        track._law = track._law._replace(mu=self._law.mu, patterned=self._law.patterned)
        return track

    def ride(self, passenger: Passenger, start: float, speed: float, offset: float = 0.0) -> Ride:
        """The ride that starts at a distance along the course with a speed [m, m/s].

        `offset` is added to ln μ for this throw alone.
        """
        law = self._law if offset == 0.0 else self._law._replace(mu=self.mu * np.exp(offset))
        n = int(np.ceil(passenger.duration / TICK)) + 2
        out = np.zeros((n, 6))
        p = passenger
        motion = np.zeros(MOTION_SIZE)
        motion[[ORDER, STONE]] = p.order, p.stone
        sweeps = np.ascontiguousarray(p.sweeps, dtype=np.float64).reshape(-1, 2)
        spin = np.array([p.spin, p.spin_power, max(p.spin_speed, 0.05), p.heading, p.clock])
        course = p.course
        _ride(
            law, motion, np.empty(PUSH_SIZE), np.empty(9), course.points, course.heading,
            course.origin, spin, sweeps, start, max(speed, 0.0), out,
        )  # fmt: skip
        return Ride(
            t=np.arange(n, dtype=np.float64) * TICK,
            distance=out[:, 0],
            speed=out[:, 1],
            acceleration=out[:, 2],
            friction=out[:, 3],
            by_distance=out[:, 4],
            by_speed=out[:, 5],
        )

    def cell_weights(self, xy: Floats) -> tuple[NDArray[np.intp], Floats]:
        """Cells that make up μ at points, and their shares.

        Parameters
        ----------
        xy : (n, 2) sheet frame [m]

        Returns
        -------
        cells : (n, 4) flat indices
        weights : (n, 4) shares, which add up to 1
        """
        sheet = self.ice.sheet
        rows, columns = sheet.shape
        if self.ice.friction.interpolation == "cell":
            row, column = sheet.cell_of(xy)
            cells = np.repeat((row * columns + column)[:, None], 4, axis=1)
            return cells, np.repeat([[1.0, 0.0, 0.0, 0.0]], len(xy), axis=0)
        row = np.clip((xy[:, 1] - sheet.y_centres[0]) / sheet.cell_size, 0, rows - 1)
        column = np.clip((xy[:, 0] - sheet.x_centres[0]) / sheet.cell_size, 0, columns - 1)
        i = np.minimum(row.astype(np.intp), max(rows - 2, 0))
        j = np.minimum(column.astype(np.intp), max(columns - 2, 0))
        u, v = row - i, column - j
        i1, j1 = np.minimum(i + 1, rows - 1), np.minimum(j + 1, columns - 1)
        cells = np.column_stack(
            [i * columns + j, i * columns + j1, i1 * columns + j, i1 * columns + j1]
        )
        weights = np.column_stack([(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v])
        return cells, weights


def sensitivities(
    ride: Ride, cells: NDArray[np.intp], shares: Floats
) -> tuple[NDArray[np.intp], Floats, Floats]:
    """How the distance responds to the start, the speed and the friction of every cell crossed.

    Parameters
    ----------
    ride : the path about which to linearise
    cells : (n, 4) flat indices of the cells under each instant
    shares : (n, 4) ∂ln μ/∂ln μ_cell at each instant

    Returns
    -------
    crossed : (m,) flat indices of the cells that matter
    start : (n, 2) ∂s/∂s₀ and ∂s/∂v₀
    friction : (n, m) ∂s/∂ln μ_cell [m]
    """
    crossed, local = np.unique(cells, return_inverse=True)
    out = np.zeros((len(ride.t), 2 + len(crossed)))
    _linear_response(
        ride.speed,
        ride.friction,
        ride.by_distance,
        ride.by_speed,
        np.ascontiguousarray(local.reshape(cells.shape)),
        np.ascontiguousarray(shares),
        np.zeros((4, out.shape[1])),
        out,
    )
    return crossed, out[:, :2], out[:, 2:]


@compiled
def _along(
    law: Law, motion: Any, push: Any, work: Any, points: Any, heading: Any, origin: float,
    spin: Any, s: float, v: float,
) -> None:  # fmt: skip
    """The law along the course: work[6] = μ, work[7] = P, work[8] = Q of acceleration = μ·P + Q."""
    place = (s - origin) / STEP
    place = min(max(place, 0.0), points.shape[0] - 1.001)
    i = int(place)
    u = place - i
    x = points[i, 0] + u * (points[i + 1, 0] - points[i, 0])
    y = points[i, 1] + u * (points[i + 1, 1] - points[i, 1])
    tx = heading[i, 0] + u * (heading[i + 1, 0] - heading[i, 0])
    ty = heading[i, 1] + u * (heading[i + 1, 1] - heading[i, 1])
    speed = max(v, 1e-6)
    omega = spin[0] * (speed / spin[2]) ** spin[1]
    feel(law, motion, push, x, y, speed * tx, speed * ty, omega, work)
    work[6] = mu_of_map(law, x, y)
    work[7] = work[0] * tx + work[1] * ty
    work[8] = work[3] * tx + work[4] * ty


@compiled
def _set_time(motion: Any, t: float, clock: float, sweeps: Any) -> None:
    motion[T] = t
    motion[CLOCK] = clock + t
    motion[SWEPT] = 0.0
    for k in range(sweeps.shape[0]):
        if sweeps[k, 0] <= t < sweeps[k, 1]:
            motion[SWEPT] = 1.0


@compiled
def _ride(
    law: Law, motion: Any, push: Any, work: Any, points: Any, heading: Any, origin: float,
    spin: Any, sweeps: Any, start: float, v: float, out: Any,
) -> None:  # fmt: skip
    """Fill out (n, 6): distance, speed, acceleration, friction, ∂a/∂s, ∂a/∂v at each instant."""
    s = start
    turned = spin[3]
    for i in range(out.shape[0]):
        out[i, 0] = s
        out[i, 1] = v
        if v < SLOWEST:
            continue
        t = i * TICK
        motion[HEADING] = turned
        _set_time(motion, t, spin[4], sweeps)
        dv = 0.02 * v
        _along(law, motion, push, work, points, heading, origin, spin, s, v + dv)
        out[i, 5] = (work[6] * work[7] + work[8]) / (2 * dv)
        _along(law, motion, push, work, points, heading, origin, spin, s, v - dv)
        out[i, 5] -= (work[6] * work[7] + work[8]) / (2 * dv)
        _along(law, motion, push, work, points, heading, origin, spin, s + NEARBY, v)
        out[i, 4] = (work[6] * work[7] + work[8]) / (2 * NEARBY)
        _along(law, motion, push, work, points, heading, origin, spin, s - NEARBY, v)
        out[i, 4] -= (work[6] * work[7] + work[8]) / (2 * NEARBY)
        _along(law, motion, push, work, points, heading, origin, spin, s, v)
        a1 = work[6] * work[7] + work[8]
        out[i, 2] = a1
        out[i, 3] = work[6] * work[7]
        turned += TICK * spin[0] * (v / spin[2]) ** spin[1]
        if v + 1.5 * a1 * TICK <= 0.0:
            # Comes to rest within about one tick: uniform deceleration for the rest.
            s += 0.5 * v * v / max(fabs(a1), 1e-6)
            v = 0.0
            continue
        half = 0.5 * TICK
        _set_time(motion, t + half, spin[4], sweeps)
        v2 = v + half * a1
        _along(law, motion, push, work, points, heading, origin, spin, s + half * v, v2)
        a2 = work[6] * work[7] + work[8]
        v3 = v + half * a2
        _along(law, motion, push, work, points, heading, origin, spin, s + half * v2, v3)
        a3 = work[6] * work[7] + work[8]
        _set_time(motion, t + TICK, spin[4], sweeps)
        v4 = v + TICK * a3
        _along(law, motion, push, work, points, heading, origin, spin, s + TICK * v3, v4)
        a4 = work[6] * work[7] + work[8]
        s += TICK / 6.0 * (v + 2 * v2 + 2 * v3 + v4)
        v = max(v + TICK / 6.0 * (a1 + 2 * a2 + 2 * a3 + a4), 0.0)


@compiled
def _linear_response(
    speed: Any, friction: Any, by_distance: Any, by_speed: Any, cells: Any, shares: Any,
    work: Any, out: Any,
) -> None:  # fmt: skip
    """Columns of out (n, 2 + m): δs for a unit of start, of speed, and of ln μ of each cell."""
    n, columns = out.shape
    ds, dv, now, then = work[0], work[1], work[2], work[3]
    ds[0] = 1.0
    dv[1] = 1.0
    for k in range(4):
        now[2 + cells[0, k]] += friction[0] * shares[0, k]
    for i in range(n):
        for c in range(columns):
            out[i, c] = ds[c]
        if i == n - 1 or speed[i] < SLOWEST:
            continue
        # Near rest ∂a/∂v grows without bound while what is left of the path vanishes.
        slope = by_distance[i]
        damping = min(max(by_speed[i], -5.0), 5.0)
        last = speed[i + 1] < SLOWEST
        span = speed[i] / max(fabs(friction[i]), 1e-6) if last else TICK
        span = min(span, 2 * TICK)
        for c in range(columns):
            then[c] = 0.0
        for k in range(4):
            then[2 + cells[i + 1, k]] += friction[i + 1] * shares[i + 1, k]
        for c in range(columns):
            a0 = slope * ds[c] + damping * dv[c] + now[c]
            vp = dv[c] + span * a0
            sp = ds[c] + span * (dv[c] + 0.5 * span * a0)
            a1 = slope * sp + damping * vp + then[c]
            ds[c] += span * (dv[c] + span * (2 * a0 + a1) / 6.0)
            dv[c] += 0.5 * span * (a0 + a1)
        for c in range(columns):
            now[c] = then[c]
