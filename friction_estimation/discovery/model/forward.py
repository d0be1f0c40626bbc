"""Predicted paths of all throws of a session at the times at which they were measured.

The force law is integrated by classical Runge–Kutta steps, with quintics between them, at uneven
times, with any number of sweeps and a friction factor per throw. A fit asks for this some thousand
times per session. Paths are good to some micrometres and change smoothly with every parameter, so
that finite differences can be trusted.
"""

from __future__ import annotations

from math import exp, fabs, floor, sqrt
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics import State, law_terms, mu_of_map, quintic
from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.motion import (
    CLOCK,
    HEADING,
    MOTION_SIZE,
    ORDER,
    PUSH_SIZE,
    RAN,
    STONE,
    SWEPT,
    T,
)
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.unknown_pushes import UnknownPushes

LONGEST_STEP = 0.5
"""Longest step on uniform ice [s]."""
PATTERNED_STEP = 0.15
"""Longest step on a map, and where something unknown pushes [s]: a few steps to a cell."""
SPEED_SHARE = 0.2
"""Part of its speed that a stone may lose in one step."""
REST_SPEED = 2e-3
"""Speed of centre and band below which the deceleration is taken as uniform [m/s]: the stone has
20 µm to go."""
PAST_BREAK = 1e-6
"""How far beyond a place where the law is not smooth a step ends [s]."""
MOST_STEPS = 5_000
"""Steps after which a stone that never stops is left where it is."""


class Wear(NamedTuple):
    """What earlier stones have worn along their paths, as the kernels read it.

    Parameters
    ----------
    passes : (p + 1, rows, columns) passes over each cell by the first 0, 1, ... p stones
    along_path : change of ln μ by one pass
    origin_x, origin_y : centre of the first cell [m]
    cell : side of the cells [m]
    bilinear : whether friction is interpolated between the cells' centres
    """

    passes: Floats
    along_path: float
    origin_x: float
    origin_y: float
    cell: float
    bilinear: bool


class ThrowInputs(NamedTuple):
    """What the throws of a session bring along, apart from what is fitted.

    Parameters
    ----------
    orders, stones, clocks : (k,) throws played before, stone, and session time of the release [s]
    ran : (k,) how many stones had worn the ice before
    swept_first : (k,) whether the stone is swept at first, 0 or 1
    switches : times at which sweeping begins or ends [s]
    switch_starts : (k+1,) index of the first switch of each throw
    times : (rows,) measured times [s]
    starts : (k+1,) index of the first time of each throw
    pushes : what something unknown does to the stones
    """

    orders: Indices
    stones: Indices
    clocks: Floats
    ran: Indices
    swept_first: Floats
    switches: Floats
    switch_starts: Indices
    times: Floats
    starts: Indices
    pushes: UnknownPushes


class IntegrationWorkspace(NamedTuple):
    """Arrays to work in, since compiled code allocates none.

    Parameters
    ----------
    motion : (MOTION_SIZE,) what effects read
    push : (PUSH_SIZE,) what they write
    parts : (6,) the law's parts
    states : (8, 6) states and their rates of change
    unknown : (4,) pushes of something unknown
    """

    motion: Floats
    push: Floats
    parts: Floats
    states: Floats
    unknown: Floats


def new_workspace() -> IntegrationWorkspace:
    """Arrays for `slide_session` to work in."""
    return IntegrationWorkspace(
        np.zeros(MOTION_SIZE), np.zeros(PUSH_SIZE), np.zeros(6), np.zeros((8, 6)), np.zeros(4)
    )


@inlined
def _worn_cell(wear: Any, stones: int, i: int, j: int) -> float:
    """Factor on the friction of cell i, j after some stones; beyond the sheet the nearest."""
    row = min(max(i, 0), wear.passes.shape[1] - 1)
    column = min(max(j, 0), wear.passes.shape[2] - 1)
    return exp(wear.along_path * wear.passes[stones, row, column])


@inlined
def _worn(wear: Any, stones: int, x: float, y: float) -> float:
    """Factor on the friction at a point after some stones."""
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
def _is_pushed(pushes: Any, throw: int) -> bool:
    """Whether something unknown pushes the stone of a throw."""
    return pushes.starts[throw + 1] - pushes.starts[throw] > 1


@inlined
def _unknown_at(pushes: Any, throw: int, t: float, out: Any) -> None:
    """Fill out (4,) with the pushes of something unknown at a time of a throw."""
    begin, end = pushes.starts[throw], pushes.starts[throw + 1]
    place = min(max(t / pushes.spacing[throw], 0.0), end - begin - 1.0)
    i = min(floor(place), end - begin - 2)
    u = place - i
    for j in range(4):
        out[j] = (1.0 - u) * pushes.sizes[begin + i, j] + u * pushes.sizes[begin + i + 1, j]


@inlined
def _derivative(
    law: Any, wear: Any, throws: Any, throw: int, t: float, s: Any, d: Any, work: Any
) -> None:
    """Fill d (6,) with the rate of change of the state s (6,) at time t."""
    motion, parts = work.motion, work.parts
    x, y, vx, vy, spin = s[State.X], s[State.Y], s[State.VX], s[State.VY], s[State.OMEGA]
    motion[T] = t
    motion[CLOCK] = throws.clocks[throw] + t
    motion[HEADING] = s[State.THETA]
    law_terms(law, motion, work.push, x, y, vx, vy, spin, parts)
    mu = mu_of_map(law, x, y)
    if wear.along_path != 0.0:
        mu *= _worn(wear, throws.ran[throw], x, y)
    pushed = _is_pushed(throws.pushes, throw)
    if pushed:
        _unknown_at(throws.pushes, throw, t, work.unknown)
        mu *= exp(work.unknown[0])
    d[State.X] = vx
    d[State.Y] = vy
    d[State.THETA] = spin
    d[State.VX] = mu * parts[0] + parts[3]
    d[State.VY] = mu * parts[1] + parts[4]
    d[State.OMEGA] = mu * parts[2] + parts[5]
    if pushed:
        left = work.unknown[1] / max(sqrt(vx * vx + vy * vy), 1e-6)
        d[State.VX] += work.unknown[2] - left * vy
        d[State.VY] += left * vx
        d[State.OMEGA] += work.unknown[3]


@compiled
def friction_of_session(
    law: Any, mu: Any, wear: Any, factors: Any, throws: Any, path: Any, out: Any, work: Any
) -> None:
    """Fill out (rows, 3) with the part of the acceleration that is proportional to the map's μ.

    Parameters
    ----------
    law, mu, wear, factors, throws, work : as of `slide_session`
    path : (rows, 6) states at the times of the throws
    """
    motion, parts = work.motion, work.parts
    for i in range(factors.shape[0]):
        _scale(mu, factors[i], law.mu)
        motion[ORDER] = throws.orders[i]
        motion[STONE] = throws.stones[i]
        motion[RAN] = throws.ran[i]
        motion[SWEPT] = throws.swept_first[i]
        switch, last = throws.switch_starts[i], throws.switch_starts[i + 1]
        for row in range(throws.starts[i], throws.starts[i + 1]):
            t = throws.times[row]
            while switch < last and throws.switches[switch] <= t:
                motion[SWEPT] = 1.0 - motion[SWEPT]
                switch += 1
            s = path[row]
            motion[T] = t
            motion[CLOCK] = throws.clocks[i] + t
            motion[HEADING] = s[State.THETA]
            x, y = s[State.X], s[State.Y]
            law_terms(law, motion, work.push, x, y, s[State.VX], s[State.VY], s[State.OMEGA], parts)
            local = mu_of_map(law, x, y)
            if wear.along_path != 0.0:
                local *= _worn(wear, throws.ran[i], x, y)
            if _is_pushed(throws.pushes, i):
                _unknown_at(throws.pushes, i, t, work.unknown)
                local *= exp(work.unknown[0])
            for j in range(3):
                out[row, j] = local * parts[j]


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
def _slide_at(law: Any, wear: Any, throws: Any, throw: int, s: Any, out: Any, work: Any) -> None:
    """Fill out (n, 6) with the states at a throw's times, from the state s at its release."""
    motion, states = work.motion, work.states
    before, d, d0, middle = states[0], states[1], states[2], states[3]
    d2, d3, d4 = states[4], states[5], states[6]
    switches = throws.switches[throws.switch_starts[throw] : throws.switch_starts[throw + 1]]
    times = throws.times[throws.starts[throw] : throws.starts[throw + 1]]
    n = times.shape[0]
    is_even = not law.patterned and wear.along_path == 0.0 and law.wear == 0.0
    is_even = is_even and not _is_pushed(throws.pushes, throw)
    longest = LONGEST_STEP if is_even else PATTERNED_STEP
    t = 0.0
    row = 0
    switch = 0
    while row < n and times[row] <= 0.0:
        _copy(s, out[row])
        row += 1
    _derivative(law, wear, throws, throw, t, s, d, work)
    for _ in range(MOST_STEPS):
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
                remaining = 1.0 - u / tail if tail > 0.0 else 0.0
                fade = u * (0.5 + 0.5 * remaining)
                for p in range(3):
                    position, velocity = (State.THETA, State.OMEGA) if p == 2 else (p, State.VX + p)
                    out[row, position] = s[position] + fade * s[velocity]
                    out[row, velocity] = s[velocity] * remaining
                row += 1
            return
        if switch < switches.shape[0] and switches[switch] <= t + 1e-9:
            motion[SWEPT] = 1.0 - motion[SWEPT]
            _derivative(law, wear, throws, throw, t, s, d, work)
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
        _derivative(law, wear, throws, throw, t + 0.5 * h, middle, d2, work)
        for j in range(6):
            middle[j] = s[j] + 0.5 * h * d2[j]
        _derivative(law, wear, throws, throw, t + 0.5 * h, middle, d3, work)
        for j in range(6):
            middle[j] = s[j] + h * d3[j]
        _derivative(law, wear, throws, throw, t + h, middle, d4, work)
        for j in range(6):
            s[j] += h / 6.0 * (d0[j] + 2.0 * d2[j] + 2.0 * d3[j] + d4[j])
        _derivative(law, wear, throws, throw, t + h, s, d, work)
        while row < n and times[row] <= t + h:
            _between(before, d0, s, d, h, (times[row] - t) / h, out[row])
            row += 1
        t += h
    while row < n:
        _copy(s, out[row])
        row += 1


@compiled
def slide_session(
    law: Any, mu: Any, wear: Any, factors: Any, states: Any, throws: Any, out: Any, work: Any
) -> None:
    """Fill `out` with the states of every throw at its measured times.

    Parameters
    ----------
    law : law of the ice; its map is overwritten with that of each throw
    mu : (rows, columns) friction of the map
    wear : wear along the paths of earlier stones
    factors : (k,) factor on the map's friction, per throw
    states : (k, 6) states at release: x, y, vx, vy, theta, omega
    throws : `ThrowInputs`
    out : (rows, 6) states at the measured times
    work : `IntegrationWorkspace`
    """
    s = work.states[7]
    for i in range(states.shape[0]):
        _scale(mu, factors[i], law.mu)
        _copy(states[i], s)
        work.motion[ORDER] = throws.orders[i]
        work.motion[STONE] = throws.stones[i]
        work.motion[RAN] = throws.ran[i]
        work.motion[SWEPT] = throws.swept_first[i]
        _slide_at(law, wear, throws, i, s, out[throws.starts[i] : throws.starts[i + 1]], work)
