"""Several stones sliding at once, each as if alone, until two of them touch.

Runge–Kutta steps taken in common by every moving stone. Contact is found on the paths
between the ends of a step, where it happens, so that resting stones cost one comparison a step and
a hit stands to a nanometre. What a contact does is not decided here: see `engine`.
"""

from __future__ import annotations

from enum import IntEnum
from math import fabs, sqrt
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.effects.motion import PUSH_SIZE, SWEPT
from curling_env.physics.law import Law
from curling_env.physics.many_stones.runge_kutta import (
    between,
    derivative,
    runge_kutta,
    step_length,
)
from curling_env.typing import Floats

REST_SPEED = 2e-3
"""Speed of centre and band below which the rest is uniform deceleration [m/s]: 20 µm on ice."""
MAX_STEPS = 20_000
"""Steps after which stones that never stop are given up: ice that drives them."""
MAX_TIME = 180.0
"""Seconds after which stones that never stop are given up [s]."""


CREEP = 1e-3
"""Closing speed below which stones that only just touch are left alone [m/s].

Friction may press two touching stones together, and restitution would then have them bounce ever
faster and lower. Below this speed they overlap instead.
"""
CREEP_OVERLAP = 1e-5
"""Overlap up to which stones may creep closer at CREEP [m]."""
OVERLAPPING_CREEP = 5e-5
"""Closing speed below which stones that overlap by more are left alone [m/s].

Curl can steer a slow stone into one it slides along, for seconds and always slower than CREEP.
"""

PIECES = 8
"""Parts of a step in which the distance of two stones is taken to have at most one minimum."""


class Scratch(NamedTuple):
    """The arrays `slide_together` works in for n stones; none outlives it.

    Parameters
    ----------
    push : (PUSH_SIZE,) what effects write
    parts : (6,) of the law
    stages : (6, 6) of a Runge–Kutta step
    before : (n, 6) states at the beginning of a step
    a0, a1 : (n, 3) accelerations at its beginning and end
    p, q : (6,) states in between
    """

    push: Floats
    parts: Floats
    stages: Floats
    before: Floats
    a0: Floats
    a1: Floats
    p: Floats
    q: Floats


def scratch(n: int) -> Scratch:
    """Work arrays for n stones."""
    return Scratch(
        push=np.empty(PUSH_SIZE),
        parts=np.empty(6),
        stages=np.empty((6, 6)),
        before=np.empty((n, 6)),
        a0=np.zeros((n, 3)),
        a1=np.zeros((n, 3)),
        p=np.empty(6),
        q=np.empty(6),
    )


class Pause(IntEnum):
    """Why the stones were stopped."""

    REST = 0
    CONTACT = 1
    NEVER_STOPS = 2


class Phase(IntEnum):
    """What a stone is doing."""

    RESTING = 0
    MOVING = 1
    GONE = 2


@inlined
def _at(s0: Any, a0: Any, s1: Any, a1: Any, moves: bool, h: float, u: float, out: Any) -> None:
    if moves:
        between(s0, a0, s1, a1, h, u, out)
    else:
        for k in range(6):
            out[k] = s0[k]


@inlined
def _approach(p: Any, q: Any, reach: float) -> Any:
    """Gap between two stones [m] and the speed at which it closes [m/s]."""
    x, y = q[0] - p[0], q[1] - p[1]
    distance = sqrt(x * x + y * y)
    closing = -(x * (q[2] - p[2]) + y * (q[3] - p[3])) / max(distance, 1e-9)
    return distance - reach, closing


@inlined
def _collides(gap: float, closing: float) -> bool:
    """Whether touching stones close too fast to be left alone."""
    return closing > (CREEP if gap > -CREEP_OVERLAP else OVERLAPPING_CREEP)


@compiled
def first_touch(
    p0: Any, pa: Any, p1: Any, pb: Any, p_moves: bool,
    q0: Any, qa: Any, q1: Any, qb: Any, q_moves: bool,
    h: float, reach: float, p: Any, q: Any,
) -> float:  # fmt: skip
    """Fraction of a step at which two stones first touch while closing, or 2 if they do not.

    Parameters
    ----------
    p0, pa, p1, pb, p_moves : one stone's states (6,) and accelerations (3,) at both ends
    q0, qa, q1, qb, q_moves : the other's
    h : length of the step [s]
    reach : distance between centres in contact [m]
    p, q : (6,) work arrays
    """
    low = 0.0
    gap, closing = _approach(p0, q0, reach)
    if gap < 0.0 and _collides(gap, closing):
        return 0.0
    for k in range(1, PIECES + 1):
        high = k / PIECES
        _at(p0, pa, p1, pb, p_moves, h, high, p)
        _at(q0, qa, q1, qb, q_moves, h, high, q)
        next_gap, next_closing = _approach(p, q, reach)
        inside = high
        inside_gap = next_gap
        if next_gap >= 0.0 and gap >= 0.0 and closing > 0.0 > next_closing:
            # They were nearest in between: a graze may hide there.
            a, b = low, high
            for _ in range(40):
                inside = 0.5 * (a + b)
                _at(p0, pa, p1, pb, p_moves, h, inside, p)
                _at(q0, qa, q1, qb, q_moves, h, inside, q)
                inside_gap, rate = _approach(p, q, reach)
                if inside_gap < 0.0:
                    break
                if rate > 0.0:
                    a = inside
                else:
                    b = inside
        if inside_gap < 0.0:
            if gap < 0.0:
                if _collides(next_gap, next_closing):
                    return high
            else:
                a, b = low, inside
                for _ in range(50):
                    middle = 0.5 * (a + b)
                    _at(p0, pa, p1, pb, p_moves, h, middle, p)
                    _at(q0, qa, q1, qb, q_moves, h, middle, q)
                    if _approach(p, q, reach)[0] < 0.0:
                        b = middle
                    else:
                        a = middle
                _at(p0, pa, p1, pb, p_moves, h, b, p)
                _at(q0, qa, q1, qb, q_moves, h, b, q)
                if _approach(p, q, reach)[1] > CREEP:
                    return b
        low, gap, closing = high, next_gap, next_closing
    return 2.0


@inlined
def _room(s: Any, bounds: Any) -> float:
    """How far inside the bounds a stone is [m]; negative once past one."""
    return min(min(s[0] - bounds[0], bounds[1] - s[0]), min(s[1] - bounds[2], bounds[3] - s[1]))


@compiled
def _first_exit(s0: Any, a0: Any, s1: Any, a1: Any, h: float, bounds: Any, p: Any) -> float:
    """Fraction of a step at which a stone leaves the bounds, or 2 if it does not."""
    low = 0.0
    for k in range(1, PIECES + 1):
        high = k / PIECES
        between(s0, a0, s1, a1, h, high, p)
        if _room(p, bounds) < 0.0:
            for _ in range(40):
                middle = 0.5 * (low + high)
                between(s0, a0, s1, a1, h, middle, p)
                if _room(p, bounds) < 0.0:
                    high = middle
                else:
                    low = middle
            return high
        low = high
    return 2.0


@compiled
def slide_together(
    law: Law,
    t: float,
    states: Any,
    phases: Any,
    ends: Any,
    motion: Any,
    delivered: int,
    clock: float,
    sweep_start: float,
    sweep_end: float,
    bounds: Any,
    reach: float,
    dt: float,
    samples: Any,
    frame: int,
    scratch: Scratch,
) -> Any:
    """Slide stones until none moves or two touch.

    Parameters
    ----------
    law : the ice
    t : seconds since release at which this begins [s]
    states : (n, 6) x, y, vx, vy, theta, omega in the sheet frame; become the final states
    phases : (n,) `Phase` of each stone; updated as they rest or leave
    ends : (n,) time at which a stone came to rest or left [s]; updated
    motion : (n, MOTION_SIZE) with ORDER and STONE set
    delivered : index of the stone that was thrown, the only one that is swept
    clock : session time of the release [s]
    sweep_start, sweep_end : seconds after release [s]
    bounds : (4,) x_min, x_max, y_min, y_max of a centre in play [m]
    reach : distance between centres in contact [m]
    dt : sample interval [s]
    samples : (m, n, 3) filled with x, y, theta of every stone at k·dt; m = 0 for none
    frame : samples filled before
    scratch : work arrays

    Returns
    -------
    pause : a Pause
    t : time of the pause [s]
    first, second : the stones in contact, or -1
    frame : samples filled
    """
    n = states.shape[0]
    push, parts, stages, before, a0, a, p, q = scratch
    fresh = True
    for _ in range(MAX_STEPS):
        swept = 1.0 if sweep_start <= t + 1e-9 < sweep_end else 0.0
        if swept != motion[delivered, SWEPT]:
            motion[delivered, SWEPT] = swept
            fresh = True
        moving = 0
        h = np.inf
        for i in range(n):
            if phases[i] != Phase.MOVING:
                continue
            s = states[i]
            if fresh:
                derivative(law, motion[i], push, parts, clock, t, s, a[i])
            speed = sqrt(s[2] * s[2] + s[3] * s[3])
            if max(speed, fabs(s[5]) * law.band_radius) < REST_SPEED:
                tail = speed / max(sqrt(a[i, 0] * a[i, 0] + a[i, 1] * a[i, 1]), 1e-6)
                s[0] += 0.5 * tail * s[2]
                s[1] += 0.5 * tail * s[3]
                s[4] += 0.5 * tail * s[5]
                s[2] = s[3] = s[5] = 0.0
                phases[i] = Phase.RESTING
                ends[i] = t + tail
                continue
            moving += 1
            h = min(h, step_length(law, s, a[i], t, sweep_start, sweep_end))
        if moving == 0:
            return Pause.REST, t, -1, -1, frame
        if t > MAX_TIME:
            break
        for i in range(n):
            for k in range(6):
                before[i, k] = states[i, k]
            if phases[i] == Phase.MOVING:
                for k in range(3):
                    a0[i, k] = a[i, k]
                runge_kutta(law, motion[i], push, parts, clock, t, states[i], a[i], h, stages)
                derivative(law, motion[i], push, parts, clock, t + h, states[i], a[i])
        fraction, first, second, leaver = 2.0, -1, -1, -1
        for i in range(n):
            if phases[i] != Phase.MOVING:
                continue
            # No stone goes further in a step than its greater speed times h; where there is more
            # room than that, nothing happens.
            travel = h * _greater_speed(before[i], states[i])
            if _room(before[i], bounds) < travel:
                u = _first_exit(before[i], a0[i], states[i], a[i], h, bounds, p)
                if u < fraction:
                    fraction, first, second, leaver = u, -1, -1, i
            for j in range(n):
                j_moves = phases[j] == Phase.MOVING
                if phases[j] == Phase.GONE or j == i or (j_moves and j < i):
                    continue
                nearest = travel + (h * _greater_speed(before[j], states[j]) if j_moves else 0.0)
                if _approach(before[i], before[j], reach)[0] > nearest:
                    continue
                u = first_touch(
                    before[i], a0[i], states[i], a[i], True,
                    before[j], a0[j], states[j], a[j], j_moves,
                    h, reach, p, q,
                )  # fmt: skip
                if u < fraction:
                    fraction, first, second, leaver = u, i, j, -1
        whole = fraction > 1.0
        share = 1.0 if whole else fraction
        while frame < samples.shape[0] and frame * dt <= t + share * h:
            for i in range(n):
                moves = phases[i] == Phase.MOVING
                u = min(max((frame * dt - t) / h, 0.0), 1.0)
                _at(before[i], a0[i], states[i], a[i], moves, h, u, p)
                samples[frame, i, 0] = p[0]
                samples[frame, i, 1] = p[1]
                samples[frame, i, 2] = p[4]
            frame += 1
        t += share * h
        fresh = not whole
        if whole:
            continue
        for i in range(n):
            if phases[i] == Phase.MOVING:
                between(before[i], a0[i], states[i], a[i], h, share, p)
                for k in range(6):
                    states[i, k] = p[k]
        if leaver >= 0:
            phases[leaver] = Phase.GONE
            ends[leaver] = t
        else:
            return Pause.CONTACT, t, first, second, frame
    return Pause.NEVER_STOPS, t, -1, -1, frame


@inlined
def _greater_speed(s0: Any, s1: Any) -> float:
    """A bound on the speed within a step, from its ends [m/s]."""
    before = sqrt(s0[2] * s0[2] + s0[3] * s0[3])
    after = sqrt(s1[2] * s1[2] + s1[3] * s1[3])
    return 1.05 * max(before, after) + 1e-3
