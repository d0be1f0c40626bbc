"""Motion of a stone along its path under the force law, and how it depends on each cell's friction.

The law gives the acceleration; its part along the path moves the stone. The spin is not integrated
but taken from the measured heading, as ω = ω₀ (v/v₀)^p with a fitted p: the form that a symmetric
running band gives, without the poorly known moment of inertia.

The sensitivities obey the linearised equation δs'' = (∂a/∂s) δs + (∂a/∂v) δv + δa. One pass along
the path solves it for all cells, the start and the speed at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import fabs
from typing import Any

import numpy as np

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
from curling_env.physics.law import Law, compile_law, law_terms, mu_of_map
from curling_env.typing import Floats, Indices
from friction_estimation.inversion.throw.path import PATH_STEP, StonePath

TIME_STEP = 0.02
"""Time between the instants of a motion [s]; Runge-Kutta then errs by micrometres."""
_DIFFERENCE_DISTANCE = 0.1
"""Half the distance over which the change of the law along the path is taken [m]: several time
steps, so that the jump at the edge of a constant cell is neither missed nor counted twice."""
_REST_SPEED = 2e-3
"""Speed below which the remaining 20 µm are uniform deceleration [m/s]."""


@dataclass(frozen=True, kw_only=True)
class ThrowInput:
    """What the motion of a throw depends on, besides its start and speed.

    Parameters
    ----------
    path : line that the stone follows
    duration : time over which it is followed [s]
    spin, spin_power : ω₀ [rad/s] and p of ω = ω₀ (v/v₀)^p
    spin_speed : v₀, the speed at which the spin is ω₀ [m/s]
    heading : heading of the handle at the start [rad]
    clock, order, stone : session clock [s], number of throws before, and stone, as the law reads
        them
    sweeps : (k, 2) beginnings and ends of sweeping since the start [s]
    """

    path: StonePath
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
class PathMotion:
    """Motion along a path at instants `TIME_STEP` apart.

    Parameters
    ----------
    t : (n,) time since the start [s]
    distance, speed, acceleration : (n,) along the path [m, m/s, m/s²]
    friction : (n,) part of the acceleration that is proportional to μ of the map [m/s²]
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
        """Distance at any times within the motion, (m,) [m]: cubic Hermite interpolation."""
        i = np.clip((t / TIME_STEP).astype(int), 0, len(self.t) - 2)
        u = np.clip(t / TIME_STEP - i, 0.0, 1.0)
        s0, s1 = self.distance[i], self.distance[i + 1]
        v0, v1 = self.speed[i] * TIME_STEP, self.speed[i + 1] * TIME_STEP
        return (
            s0 * (1 + 2 * u) * (1 - u) ** 2
            + v0 * u * (1 - u) ** 2
            + s1 * u**2 * (3 - 2 * u)
            + v1 * u**2 * (u - 1)
        )

    def columns_at(self, columns: Floats, t: Floats) -> Floats:
        """Columns (n, m) given at the instants, interpolated at times (k,): (k, m)."""
        i = np.clip((t / TIME_STEP).astype(int), 0, len(self.t) - 2)
        u = np.clip(t / TIME_STEP - i, 0.0, 1.0)[:, None]
        return columns[i] * (1 - u) + columns[i + 1] * u


@dataclass(frozen=True, eq=False)
class LawOnMap:
    """The compiled force law of an ice, with a friction map that can be exchanged.

    Parameters
    ----------
    ice : sheet, stone and effects
    law : compiled law; its friction map need not be that of the ice
    """

    ice: Ice
    law: Law

    @classmethod
    def of(cls, ice: Ice) -> LawOnMap:
        """The law of an ice on its own map."""
        return cls(ice=ice, law=compile_law(ice))

    @property
    def mu(self) -> Floats:
        """Friction of the map, (rows, columns)."""
        return self.law.mu

    def with_level(self, level: float) -> LawOnMap:
        """The law on uniform friction; `level` is its ln μ."""
        return self.with_field(level, np.zeros(self.mu.size))

    def with_field(self, level: float, field: Floats) -> LawOnMap:
        """The law on a map whose ln μ is the level plus a field (cells,)."""
        mu = np.exp(level + field).reshape(self.mu.shape)
        law = self.law._replace(mu=np.ascontiguousarray(mu), patterned=True)
        return LawOnMap(ice=self.ice, law=law)

    def with_effects(self, ice: Ice) -> LawOnMap:
        """The same map under the effects of another ice."""
        law = compile_law(ice)._replace(mu=self.law.mu, patterned=self.law.patterned)
        return LawOnMap(ice=ice, law=law)

    def integrate(
        self, inputs: ThrowInput, start: float, speed: float, offset: float = 0.0
    ) -> PathMotion:
        """Motion of a throw along its path.

        Parameters
        ----------
        inputs : path, spin and the rest of the throw
        start, speed : distance along the path and speed at time 0 [m, m/s]
        offset : added to ln μ for this throw alone
        """
        law = self.law if offset == 0.0 else self.law._replace(mu=self.mu * np.exp(offset))
        n = int(np.ceil(inputs.duration / TIME_STEP)) + 2
        out = np.zeros((n, 6))
        motion = np.zeros(MOTION_SIZE)
        motion[[ORDER, STONE]] = inputs.order, inputs.stone
        sweeps = np.ascontiguousarray(inputs.sweeps, dtype=np.float64).reshape(-1, 2)
        spin_speed = max(inputs.spin_speed, 0.05)
        spin = np.array([inputs.spin, inputs.spin_power, spin_speed, inputs.heading, inputs.clock])
        path = inputs.path
        _integrate(
            law,
            motion,
            np.empty(PUSH_SIZE),
            np.empty(9),
            path.points,
            path.heading,
            path.origin,
            spin,
            sweeps,
            start,
            max(speed, 0.0),
            out,
        )
        return PathMotion(
            t=np.arange(n, dtype=np.float64) * TIME_STEP,
            distance=out[:, 0],
            speed=out[:, 1],
            acceleration=out[:, 2],
            friction=out[:, 3],
            by_distance=out[:, 4],
            by_speed=out[:, 5],
        )

    def cell_weights(self, xy: Floats) -> tuple[Indices, Floats]:
        """Cells that make up μ at points, and their weights.

        Parameters
        ----------
        xy : (n, 2) points in the sheet frame [m]

        Returns
        -------
        cells : (n, 4) flat indices
        weights : (n, 4) weights, which add up to 1
        """
        sheet = self.ice.sheet
        columns = sheet.shape[1]
        if self.ice.friction.interpolation == "cell":
            row, column = sheet.cell_of(xy)
            cells = np.repeat((row * columns + column)[:, None], 4, axis=1)
            return cells, np.repeat([[1.0, 0.0, 0.0, 0.0]], len(xy), axis=0)
        (i, i1), (j, j1), u, v = sheet.cells_around(xy)
        cells = np.column_stack(
            [i * columns + j, i * columns + j1, i1 * columns + j, i1 * columns + j1]
        )
        weights = np.column_stack([(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v])
        return cells, weights


def sensitivities(
    motion: PathMotion, cells: Indices, shares: Floats
) -> tuple[Indices, Floats, Floats]:
    """How the distance responds to the start, the speed and the friction of every cell crossed.

    Parameters
    ----------
    motion : motion about which to linearise
    cells : (n, 4) flat indices of the cells at each instant
    shares : (n, 4) ∂ln μ/∂ln μ_cell at each instant

    Returns
    -------
    crossed : (m,) flat indices of the cells that matter
    start : (n, 2) ∂s/∂s₀ and ∂s/∂v₀
    friction : (n, m) ∂s/∂ln μ_cell [m]
    """
    crossed, local = np.unique(cells, return_inverse=True)
    out = np.zeros((len(motion.t), 2 + len(crossed)))
    _linear_response(
        motion.speed,
        motion.friction,
        motion.by_distance,
        motion.by_speed,
        np.ascontiguousarray(local.reshape(cells.shape)),
        np.ascontiguousarray(shares),
        np.zeros((4, out.shape[1])),
        out,
    )
    return crossed, out[:, :2], out[:, 2:]


@compiled
def _along(
    law: Law,
    motion: Any,
    push: Any,
    work: Any,
    points: Any,
    heading: Any,
    origin: float,
    spin: Any,
    s: float,
    v: float,
) -> None:
    """The law along the path: work[6] = μ, work[7] = P, work[8] = Q of acceleration = μ·P + Q."""
    place = (s - origin) / PATH_STEP
    place = min(max(place, 0.0), points.shape[0] - 1.001)
    i = int(place)
    u = place - i
    x = points[i, 0] + u * (points[i + 1, 0] - points[i, 0])
    y = points[i, 1] + u * (points[i + 1, 1] - points[i, 1])
    tx = heading[i, 0] + u * (heading[i + 1, 0] - heading[i, 0])
    ty = heading[i, 1] + u * (heading[i + 1, 1] - heading[i, 1])
    speed = max(v, 1e-6)
    omega = spin[0] * (speed / spin[2]) ** spin[1]
    law_terms(law, motion, push, x, y, speed * tx, speed * ty, omega, work)
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
def _integrate(
    law: Law,
    motion: Any,
    push: Any,
    work: Any,
    points: Any,
    heading: Any,
    origin: float,
    spin: Any,
    sweeps: Any,
    start: float,
    v: float,
    out: Any,
) -> None:
    """Fill out (n, 6): distance, speed, acceleration, friction, ∂a/∂s, ∂a/∂v at each instant."""
    s = start
    turned = spin[3]
    for i in range(out.shape[0]):
        out[i, 0] = s
        out[i, 1] = v
        if v < _REST_SPEED:
            continue
        t = i * TIME_STEP
        motion[HEADING] = turned
        _set_time(motion, t, spin[4], sweeps)
        dv = 0.02 * v
        _along(law, motion, push, work, points, heading, origin, spin, s, v + dv)
        out[i, 5] = (work[6] * work[7] + work[8]) / (2 * dv)
        _along(law, motion, push, work, points, heading, origin, spin, s, v - dv)
        out[i, 5] -= (work[6] * work[7] + work[8]) / (2 * dv)
        _along(law, motion, push, work, points, heading, origin, spin, s + _DIFFERENCE_DISTANCE, v)
        out[i, 4] = (work[6] * work[7] + work[8]) / (2 * _DIFFERENCE_DISTANCE)
        _along(law, motion, push, work, points, heading, origin, spin, s - _DIFFERENCE_DISTANCE, v)
        out[i, 4] -= (work[6] * work[7] + work[8]) / (2 * _DIFFERENCE_DISTANCE)
        _along(law, motion, push, work, points, heading, origin, spin, s, v)
        a1 = work[6] * work[7] + work[8]
        out[i, 2] = a1
        out[i, 3] = work[6] * work[7]
        turned += TIME_STEP * spin[0] * (v / spin[2]) ** spin[1]
        if v + 1.5 * a1 * TIME_STEP <= 0.0:
            # The stone comes to rest within about one step, by uniform deceleration.
            s += 0.5 * v * v / max(fabs(a1), 1e-6)
            v = 0.0
            continue
        half = 0.5 * TIME_STEP
        _set_time(motion, t + half, spin[4], sweeps)
        v2 = v + half * a1
        _along(law, motion, push, work, points, heading, origin, spin, s + half * v, v2)
        a2 = work[6] * work[7] + work[8]
        v3 = v + half * a2
        _along(law, motion, push, work, points, heading, origin, spin, s + half * v2, v3)
        a3 = work[6] * work[7] + work[8]
        _set_time(motion, t + TIME_STEP, spin[4], sweeps)
        v4 = v + TIME_STEP * a3
        _along(law, motion, push, work, points, heading, origin, spin, s + TIME_STEP * v3, v4)
        a4 = work[6] * work[7] + work[8]
        s += TIME_STEP / 6.0 * (v + 2 * v2 + 2 * v3 + v4)
        v = max(v + TIME_STEP / 6.0 * (a1 + 2 * a2 + 2 * a3 + a4), 0.0)


@compiled
def _linear_response(
    speed: Any,
    friction: Any,
    by_distance: Any,
    by_speed: Any,
    cells: Any,
    shares: Any,
    work: Any,
    out: Any,
) -> None:
    """Fill out (n, 2 + m): δs for a unit of start, of speed and of ln μ of each cell."""
    n, columns = out.shape
    ds, dv, now, then = work[0], work[1], work[2], work[3]
    ds[0] = 1.0
    dv[1] = 1.0
    for k in range(4):
        now[2 + cells[0, k]] += friction[0] * shares[0, k]
    for i in range(n):
        for c in range(columns):
            out[i, c] = ds[c]
        if i == n - 1 or speed[i] < _REST_SPEED:
            continue
        # Near rest ∂a/∂v grows without bound while the remaining distance vanishes.
        slope = by_distance[i]
        damping = min(max(by_speed[i], -5.0), 5.0)
        last = speed[i + 1] < _REST_SPEED
        span = speed[i] / max(fabs(friction[i]), 1e-6) if last else TIME_STEP
        span = min(span, 2 * TIME_STEP)
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
