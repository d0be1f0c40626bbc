"""A throw among other stones, from event to event.

Every moving stone slides as if alone until it rests, leaves the bounds or meets a resting stone;
the first time at which two moving stones meet is found on their paths. The earliest meeting is
resolved by an impulse, and from there the moving stones slide on. So a resting stone costs nothing
until something comes near it, and no time step limits how exactly a hit stands.

The impulse is that of two equal disks: restitution along the line of centres, Coulomb friction at
the rims, which carries spin over.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import Ice
from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.effects.motion import MOTION_SIZE, STONE
from curling_env.physics.law import Law
from curling_env.physics.one_stone.integrate import SlideEnd, glide
from curling_env.physics.one_stone.step import KNOT_SIZE, QUICK, Work, new_work

MEETING = 1e-6
"""Stones whose rims are this close can touch [m]."""
LEAST_BOUNCE = 1e-3
"""Stones that met part at least this fast [m/s], so that none is carried along for ever."""
MAX_MEETINGS = 500
"""Meetings after which a throw is given up."""
REST, MOVING, GONE = 0, 1, 2


class Hands(NamedTuple):
    """What a collision needs to know of the stones.

    Parameters
    ----------
    reach : distance of two centres that touch [m]
    restitution : 0 to 1
    friction : between two rims
    rim_mass : m·R²/I: how much lighter a rim is to push than the centre
    """

    reach: float
    restitution: float
    friction: float
    rim_mass: float


class Table(NamedTuple):
    """The arrays a position is played in; none outlives it.

    Parameters
    ----------
    stones : (n, 6) x, y, theta, vx, vy, spin
    status : (n,) REST, MOVING or GONE
    resting : (n, 2) centres of the stones at rest
    paths : (n, knots, KNOT_SIZE) ways of the moving stones
    lengths, ends : (n,) knots of each way and how it ends
    motion : (MOTION_SIZE,)
    samples : (0, 4)
    work : of one slide
    """

    stones: NDArray[np.float64]
    status: NDArray[np.int64]
    resting: NDArray[np.float64]
    paths: NDArray[np.float64]
    lengths: NDArray[np.int64]
    ends: NDArray[np.int64]
    motion: NDArray[np.float64]
    samples: NDArray[np.float64]
    work: Work


def new_table(ice: Ice, stones: int, tolerance: float = QUICK) -> Table:
    """What one thread plays positions of so many stones with; tolerance of a lone slide [m]."""
    rows, columns = ice.friction.mu.shape
    knots = 512 + 4 * (rows + columns)
    return Table(
        stones=np.zeros((stones, 6)),
        status=np.zeros(stones, dtype=np.int64),
        resting=np.zeros((stones, 2)),
        paths=np.zeros((stones, knots, KNOT_SIZE)),
        lengths=np.zeros(stones, dtype=np.int64),
        ends=np.zeros(stones, dtype=np.int64),
        motion=np.zeros(MOTION_SIZE),
        samples=np.zeros((0, 4)),
        work=new_work(tolerance),
    )


def hands_of(ice: Ice) -> Hands:
    """How the stones of an ice collide."""
    stone = ice.stone
    return Hands(
        reach=2 * stone.radius,
        restitution=stone.restitution,
        friction=stone.stone_friction,
        rim_mass=stone.mass * stone.radius**2 / stone.inertia,
    )


@inlined
def collide(hands: Hands, a: Any, b: Any) -> bool:
    """Exchange impulses between two stones that touch; False if they are not approaching.

    Impulses are per mass: p along the line of centres, from a to b, and f along the rims.
    """
    nx = b[0] - a[0]
    ny = b[1] - a[1]
    distance = math.sqrt(nx * nx + ny * ny)
    if distance == 0.0:
        return False
    nx /= distance
    ny /= distance
    approach = (a[3] - b[3]) * nx + (a[4] - b[4]) * ny
    if approach <= 0.0:
        return False
    radius = 0.5 * hands.reach
    slip = (a[4] - b[4]) * nx - (a[3] - b[3]) * ny + radius * (a[5] + b[5])
    p = 0.5 * (approach + max(hands.restitution * approach, LEAST_BOUNCE))
    stick = slip / (2.0 + 2.0 * hands.rim_mass)
    f = min(max(stick, -hands.friction * p), hands.friction * p)
    a[3] -= p * nx - f * ny
    a[4] -= p * ny + f * nx
    b[3] += p * nx - f * ny
    b[4] += p * ny + f * nx
    turn = f * hands.rim_mass / radius
    a[5] -= turn
    b[5] -= turn
    return True


@inlined
def _place(path: Any, length: int, k: int, t: float) -> Any:
    """Knot before time t, position and velocity then; at rest at its last place after the end."""
    while k < length - 2 and path[k + 1, 0] <= t:
        k += 1
    if k >= length - 1 or t >= path[length - 1, 0]:
        return k, path[length - 1, 1], path[length - 1, 2], 0.0, 0.0
    h = path[k + 1, 0] - path[k, 0]
    tau = t - path[k, 0]
    # Between knots friction hardly changes: a cubic through places and velocities.
    u = tau / h
    x, vx = _cubic(path[k, 1], path[k, 4], path[k + 1, 1], path[k + 1, 4], h, u)
    y, vy = _cubic(path[k, 2], path[k, 5], path[k + 1, 2], path[k + 1, 5], h, u)
    return k, x, y, vx, vy


@inlined
def _cubic(p0: float, v0: float, p1: float, v1: float, h: float, u: float) -> Any:
    d = p1 - p0 - h * v0
    e = h * (v1 - v0)
    c2 = 3.0 * d - e
    c3 = e - 2.0 * d
    return p0 + u * (h * v0 + u * (c2 + u * c3)), v0 + u * (2.0 * c2 + 3.0 * u * c3) / h


@inlined
def _meeting(table: Table, a: int, b: int, reach: float, start: float, until: float) -> float:
    """When two moving stones first touch while approaching, infinite if not before `until` [s]."""
    first, second = table.paths[a], table.paths[b]
    n, m = table.lengths[a], table.lengths[b]
    t = start
    if table.ends[a] == SlideEnd.LEFT_BOUNDS:
        until = min(until, first[n - 1, 0])
    if table.ends[b] == SlideEnd.LEFT_BOUNDS:
        until = min(until, second[m - 1, 0])
    until = min(until, max(first[n - 1, 0], second[m - 1, 0]))
    j = k = 0
    while t < until:
        j, ax, ay, avx, avy = _place(first, n, j, t)
        k, bx, by, bvx, bvy = _place(second, m, k, t)
        dx = bx - ax
        dy = by - ay
        dvx = bvx - avx
        dvy = bvy - avy
        gap = math.sqrt(dx * dx + dy * dy) - reach
        closing = -(dx * dvx + dy * dvy)
        if gap < MEETING:
            if closing > 0.0:
                return t
            gap = MEETING
        # Friction only slows them; over a fifth of a second it changes little.
        speeds = math.sqrt(avx * avx + avy * avy) + math.sqrt(bvx * bvx + bvy * bvy)
        relative = math.sqrt(dvx * dvx + dvy * dvy)
        t += max(gap / (speeds + 0.02), min(0.2, gap / (relative + 0.05)))
    return np.inf


@inlined
def _advance(table: Table, s: int, t: float) -> None:
    """Take a moving stone to time t on its way."""
    path, n, stone = table.paths[s], table.lengths[s], table.stones[s]
    last = path[n - 1, 0]
    if t >= last:
        for c in range(6):
            stone[c] = path[n - 1, 1 + c]
        if table.ends[s] == SlideEnd.REST:
            table.status[s] = REST
        elif table.ends[s] == SlideEnd.LEFT_BOUNDS:
            table.status[s] = GONE
        return
    k, x, y, vx, vy = _place(path, n, 0, t)
    h = path[k + 1, 0] - path[k, 0]
    u = (t - path[k, 0]) / h
    stone[2], stone[5] = _cubic(path[k, 3], path[k, 6], path[k + 1, 3], path[k + 1, 6], h, u)
    stone[0] = x
    stone[1] = y
    stone[3] = vx
    stone[4] = vy


@compiled
def play(
    law: Law,
    hands: Hands,
    table: Table,
    count: int,
    identity: Any,
    clock: float,
    sweep_start: float,
    sweep_end: float,
    bounds: Any,
) -> Any:
    """Let a throw among other stones run until all are at rest.

    Parameters
    ----------
    law, hands : the ice and its stones
    table : stones[:count] and status[:count] given, MOVING for the thrown stone, which is the last;
        motion with ORDER set; they become the final ones
    count : of stones
    identity : (count,) identifiers of the stones, for effects that ask
    clock : session time of the release [s]
    sweep_start, sweep_end : of the thrown stone, seconds after release [s]
    bounds : (4,) x_min, x_max, y_min, y_max of centres [m]; a stone beyond is out of play

    Returns
    -------
    time : until the last stone rests [s]
    meetings : collisions; MAX_MEETINGS + 1 if they never ended or a stone never stops
    """
    t = 0.0
    meetings = 0
    thrown = count - 1
    while True:
        resting = 0
        moving = 0
        for s in range(count):
            if table.status[s] == REST:
                table.resting[resting, 0] = table.stones[s, 0]
                table.resting[resting, 1] = table.stones[s, 1]
                resting += 1
            elif table.status[s] == MOVING:
                moving += 1
        if moving == 0:
            return t, meetings
        obstacles = table.resting[:resting]
        until = np.inf
        latest = t
        for s in range(count):
            if table.status[s] != MOVING:
                continue
            for c in range(6):
                table.work.states[2, c] = table.stones[s, c]
            table.motion[STONE] = identity[s]
            # Alone, it need not leave a trace.
            path = table.paths[s] if moving > 1 else table.paths[s, :0]
            end, at, _, length = glide(
                law,
                table.motion,
                clock,
                sweep_start if s == thrown else 0.0,
                sweep_end if s == thrown else 0.0,
                bounds,
                obstacles,
                hands.reach,
                1.0,
                table.samples,
                path,
                t,
                table.work,
            )
            if end == SlideEnd.NEVER_STOPS or length > table.paths.shape[1]:
                return at, MAX_MEETINGS + 1
            if length == 0:
                table.paths[s, 0, 0] = at
                for c in range(6):
                    table.paths[s, 0, 1 + c] = table.work.states[2, c]
                length = 1
            table.ends[s] = end
            table.lengths[s] = length
            latest = max(latest, at)
            if end == SlideEnd.CONTACT:
                until = min(until, at)
        if moving > 1:
            for a in range(count):
                for b in range(a + 1, count):
                    if table.status[a] == MOVING and table.status[b] == MOVING:
                        until = min(until, _meeting(table, a, b, hands.reach, t, until))
        t = min(until, latest)
        for s in range(count):
            if table.status[s] == MOVING:
                _advance(table, s, t)
        if until == np.inf:
            continue
        # Stones that touch in a cluster pass the impulse on until none approaches another.
        for _ in range(MAX_MEETINGS):
            passed = False
            for a in range(count):
                for b in range(a + 1, count):
                    if table.status[a] == GONE or table.status[b] == GONE:
                        continue
                    if table.status[a] == REST and table.status[b] == REST:
                        continue
                    dx = table.stones[b, 0] - table.stones[a, 0]
                    dy = table.stones[b, 1] - table.stones[a, 1]
                    near = hands.reach + 3.0 * MEETING
                    if dx * dx + dy * dy > near * near:
                        continue
                    if collide(hands, table.stones[a], table.stones[b]):
                        table.status[a] = MOVING
                        table.status[b] = MOVING
                        meetings += 1
                        passed = True
            if not passed:
                break
        if meetings > MAX_MEETINGS:
            return t, meetings
