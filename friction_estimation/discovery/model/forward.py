"""Predicted paths of all throws of a session at the very times at which they were measured.

The one force law, integrated by classical Runge–Kutta steps with quintics between them, at uneven
times, with any number of sweeps and a friction factor per throw: what matching of trajectories asks
for, some thousand times per session. Paths are good to some micrometres, and change smoothly with
every parameter, so that finite differences can be trusted.
"""

from __future__ import annotations

from math import exp, fabs, floor, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.effects.motion import (
    CLOCK,
    HEADING,
    ORDER,
    STONE,
    SWEPT,
    T,
)
from curling_env.physics.law import law_terms, mu_of_map
from curling_env.physics.one_stone.step import quintic
from curling_env.physics.state import State

LONGEST_STEP = 0.5
"""Longest step on ice whose law is smooth [s]."""
PATTERNED_STEP = 0.15
"""Longest step on a map: a few to a cell [s]."""
SPEED_SHARE = 0.2
"""Part of its speed that a stone may lose in one step."""
REST_SPEED = 2e-3
"""Speed of centre and band below which the rest is uniform deceleration [m/s]: 20 µm on ice."""
PAST_BREAK = 1e-6
"""How far beyond a place where the law is not smooth a step ends [s]."""
WORK_SHAPE = (9, 6)
"""Of the array a slide works in."""
MAX_STEPS = 5_000
"""Steps after which a stone that never stops is left where it is."""


class Wear(NamedTuple):
    """What stones that ran before have worn along their paths, as the kernels read it.

    Parameters
    ----------
    passes : (p + 1, rows, columns) over each cell once so many stones had run
    before : (k,) how many had run before each throw
    along_path : change of ln μ by one pass
    origin_x, origin_y : centre of the first cell [m]
    cell : side of the cells [m]
    bilinear : whether friction is interpolated between the cells' centres
    """

    passes: NDArray[np.float64]
    before: NDArray[np.intp]
    along_path: float
    origin_x: float
    origin_y: float
    cell: float
    bilinear: bool


@inlined
def _worn_cell(wear: Any, stones: int, i: int, j: int) -> float:
    """Factor on the friction of cell i, j after some stones; beyond the sheet the nearest."""
    row = min(max(i, 0), wear.passes.shape[1] - 1)
    column = min(max(j, 0), wear.passes.shape[2] - 1)
    return exp(wear.along_path * wear.passes[stones, row, column])


@inlined
def _worn(wear: Any, throw: int, x: float, y: float) -> float:
    """Factor on the friction at a point before a throw."""
    stones = wear.before[throw]
    u = (y - wear.origin_y) / wear.cell
    v = (x - wear.origin_x) / wear.cell
    if not wear.bilinear:
        return _worn_cell(wear, stones, floor(u + 0.5), floor(v + 0.5))
    i, j = floor(u), floor(v)
    u -= i
    v -= j
    near = (1.0 - v) * _worn_cell(wear, stones, i, j) + v * _worn_cell(wear, stones, i, j + 1)
    far = (1.0 - v) * _worn_cell(wear, stones, i + 1, j) + v * _worn_cell(
        wear, stones, i + 1, j + 1
    )
    return near * (1.0 - u) + u * far


@inlined
def _derivative(
    law: Any,
    wear: Any,
    throw: int,
    motion: Any,
    push: Any,
    parts: Any,
    clock: float,
    t: float,
    s: Any,
    d: Any,
):
    """Rate d (6,) of change of the state s (6,) at time t."""
    x, y, vx, vy, spin = s[State.X], s[State.Y], s[State.VX], s[State.VY], s[State.OMEGA]
    motion[T] = t
    motion[CLOCK] = clock + t
    motion[HEADING] = s[State.THETA]
    law_terms(law, motion, push, x, y, vx, vy, spin, parts)
    mu = mu_of_map(law, x, y)
    if wear.along_path != 0.0:
        mu *= _worn(wear, throw, x, y)
    d[State.X] = vx
    d[State.Y] = vy
    d[State.THETA] = spin
    d[State.VX] = mu * parts[0] + parts[3]
    d[State.VY] = mu * parts[1] + parts[4]
    d[State.OMEGA] = mu * parts[2] + parts[5]


@inlined
def _copy(source: Any, target: Any) -> None:
    """Copy a state; compiled code allocates nothing, and a slice would."""
    for j in range(6):
        target[j] = source[j]


@inlined
def _scale(source: Any, factor: float, target: Any) -> None:
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = factor * source[i, j]


@inlined
def _time_to_break(breaks: Any, position: float, velocity: float) -> float:
    """Time until just past the next place where the law is not smooth, at the present speed [s].

    The next step then begins with the law of the far side. The stone slows and may fall short; it
    is nearer each time.
    """
    ahead = np.inf
    if velocity != 0.0:
        for k in range(breaks.shape[0]):
            time = (breaks[k] - position) / velocity
            if time > 0.0:
                ahead = min(ahead, time + PAST_BREAK)
    return ahead


@inlined
def _between(s0: Any, d0: Any, s1: Any, d1: Any, h: float, u: float, out: Any) -> None:
    """State at the fraction u of a step: quintics through both ends' motion."""
    for p in range(3):
        position, rate = (State.THETA, State.OMEGA) if p == 2 else (p, State.VX + p)
        begin = s0[position], s0[rate], d0[rate]
        end = s1[position], s1[rate], d1[rate]
        out[position], out[rate] = quintic(begin, end, h, u)


@compiled
def _slide_at(
    law: Any,
    wear: Any,
    throw: int,
    s: Any,
    motion: Any,
    push: Any,
    clock: float,
    switches: Any,
    times: Any,
    out: Any,
    work: Any,
) -> None:
    """Fill out (n, 6) with the states at `times` of a stone released with state s at t = 0."""
    parts = work[8]
    before, d, d0, middle, d2, d3, d4 = (
        work[0],
        work[1],
        work[2],
        work[3],
        work[4],
        work[5],
        work[6],
    )
    n = times.shape[0]
    longest = PATTERNED_STEP if law.patterned or wear.along_path != 0.0 else LONGEST_STEP
    t = 0.0
    row = 0
    switch = 0
    while row < n and times[row] <= 0.0:
        _copy(s, out[row])
        row += 1
    _derivative(law, wear, throw, motion, push, parts, clock, t, s, d)
    for _ in range(MAX_STEPS):
        if row >= n:
            return
        vx, vy, spin = s[State.VX], s[State.VY], s[State.OMEGA]
        ax, ay, turn = d[State.VX], d[State.VY], d[State.OMEGA]
        speed = sqrt(vx * vx + vy * vy)
        fastest = max(speed, fabs(spin) * law.band_radius)
        rate = sqrt(ax * ax + ay * ay)
        if fastest < REST_SPEED:
            tail = speed / max(rate, 1e-6)
            while row < n:
                u = min(times[row] - t, tail)
                left = 1.0 - u / tail if tail > 0.0 else 0.0
                fade = u * (0.5 + 0.5 * left)
                for p in range(3):
                    position, velocity = (State.THETA, State.OMEGA) if p == 2 else (p, State.VX + p)
                    out[row, position] = s[position] + fade * s[velocity]
                    out[row, velocity] = s[velocity] * left
                row += 1
            return
        if switch < switches.shape[0] and switches[switch] <= t + 1e-9:
            motion[SWEPT] = 1.0 - motion[SWEPT]
            _derivative(law, wear, throw, motion, push, parts, clock, t, s, d)
            switch += 1
        h = SPEED_SHARE * fastest / max(rate, fabs(turn) * law.band_radius, 1e-9)
        h = min(longest, h)
        if switch < switches.shape[0]:
            h = min(h, switches[switch] - t)
        h = min(h, _time_to_break(law.x_breaks, s[State.X], vx))
        h = max(min(h, _time_to_break(law.y_breaks, s[State.Y], vy)), 1e-6)
        _copy(s, before)
        _copy(d, d0)
        for j in range(6):
            middle[j] = s[j] + 0.5 * h * d0[j]
        _derivative(law, wear, throw, motion, push, parts, clock, t + 0.5 * h, middle, d2)
        for j in range(6):
            middle[j] = s[j] + 0.5 * h * d2[j]
        _derivative(law, wear, throw, motion, push, parts, clock, t + 0.5 * h, middle, d3)
        for j in range(6):
            middle[j] = s[j] + h * d3[j]
        _derivative(law, wear, throw, motion, push, parts, clock, t + h, middle, d4)
        for j in range(6):
            s[j] += h / 6.0 * (d0[j] + 2.0 * d2[j] + 2.0 * d3[j] + d4[j])
        _derivative(law, wear, throw, motion, push, parts, clock, t + h, s, d)
        while row < n and times[row] <= t + h:
            _between(before, d0, s, d, h, (times[row] - t) / h, out[row])
            row += 1
        t += h
    while row < n:
        _copy(s, out[row])
        row += 1


@compiled
def slide_session(
    law: Any,
    mu: Any,
    wear: Any,
    factors: Any,
    states: Any,
    orders: Any,
    stones: Any,
    clocks: Any,
    swept_first: Any,
    switches: Any,
    switch_starts: Any,
    times: Any,
    starts: Any,
    out: Any,
    motion: Any,
    push: Any,
    work: Any,
) -> None:
    """States of every throw at its measured times.

    Parameters
    ----------
    law : the ice; its map is a place to work in
    mu : (rows, columns) the map's friction
    wear : along the paths of earlier stones
    factors : (k,) factor on the map's friction, per throw
    states : (k, 6) at release
    orders, stones, clocks, swept_first : (k,) what a throw brings along; swept_first is 0 or 1
    switches, switch_starts : times at which sweeping begins or ends, of throw i from
        switch_starts[i] to switch_starts[i+1] [s]
    times, starts : measured times, of throw i from starts[i] to starts[i+1] [s]
    out : (rows, 6) filled
    motion, push, work : (MOTION_SIZE,), (PUSH_SIZE,) and WORK_SHAPE to work in
    """
    s = work[7]
    for i in range(states.shape[0]):
        _scale(mu, factors[i], law.mu)
        _copy(states[i], s)
        motion[ORDER] = orders[i]
        motion[STONE] = stones[i]
        motion[SWEPT] = swept_first[i]
        _slide_at(
            law,
            wear,
            i,
            s,
            motion,
            push,
            clocks[i],
            switches[switch_starts[i] : switch_starts[i + 1]],
            times[starts[i] : starts[i + 1]],
            out[starts[i] : starts[i + 1]],
            work,
        )
