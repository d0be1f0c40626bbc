"""Classical Runge–Kutta steps under the law, and the path between their ends.

The engine's own way of integrating, independent of `stride`: fourth order, steps that end wherever
the law is not smooth (lines of the map, edges of patches, the beginning and end of a sweep), and a
quintic through both ends' states and accelerations between them.
"""

from __future__ import annotations

from math import fabs, sqrt
from typing import Any

import numpy as np

from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.effects.motion import CLOCK, HEADING, T
from curling_env.physics.law import Law, accelerate
from curling_env.physics.one_stone.step import quintic

LONGEST_STEP = 0.5
"""Longest step [s]."""
SPEED_SHARE = 0.2
"""Part of its speed that a stone may lose in one step."""
NEAR_BEND = 2e-3
"""A line across which friction bends is stepped over from this close [m]: 1e-8 m of error."""
NEAR_JUMP = 1e-5
"""Steps end this far before a place where friction jumps, and hop over it [m].

A stage beyond it would feel for a whole step what lies there: at 2 m/s millimetres at rest.
"""


@inlined
def _time_to(distance: float, velocity: float, acceleration: float) -> float:
    """Time to cover a distance along one axis at uniform acceleration, or infinity [s]."""
    speed = fabs(velocity)
    gain = acceleration if velocity > 0.0 else -acceleration
    root = speed * speed + 2.0 * gain * distance
    if distance == np.inf or root <= 0.0:
        return np.inf
    return 2.0 * distance / (speed + sqrt(root))


@inlined
def _next_break(breaks: Any, position: float, velocity: float) -> float:
    """Distance ahead to the next break of an effect, infinite if there is none [m]."""
    nearest = np.inf
    for k in range(breaks.shape[0]):
        ahead = breaks[k] - position if velocity > 0.0 else position - breaks[k]
        if 0.0 <= ahead < nearest:
            nearest = ahead
    return nearest


@inlined
def _next_line(law: Law, origin: float, position: float, velocity: float) -> float:
    """Distance ahead to the next line of the map [m]."""
    place = (position - origin) / law.cell
    share = place - np.floor(place)
    ahead = (1.0 - share if velocity > 0.0 else share) * law.cell
    return ahead + law.cell if law.bilinear and ahead <= NEAR_BEND else ahead


@inlined
def _time_short_of(distance: float, velocity: float, acceleration: float) -> float:
    """Time to come close to a jump, and from there to hop over it [s].

    The further off, the less certain the time: so short of it at first, then closer.
    """
    if distance < NEAR_JUMP:
        return 2.0 * NEAR_JUMP / max(fabs(velocity), 1e-3)
    short = 0.97 * distance if distance > 1e-3 else distance - 0.5 * NEAR_JUMP
    return _time_to(short, velocity, acceleration)


@inlined
def step_length(law: Law, s: Any, a: Any, t: float, sweep_start: float, sweep_end: float) -> float:
    """How far to step from state s with acceleration a [s]."""
    speed = max(sqrt(s[2] * s[2] + s[3] * s[3]), fabs(s[5]) * law.band_radius)
    rate = max(sqrt(a[0] * a[0] + a[1] * a[1]), fabs(a[2]) * law.band_radius)
    h = min(LONGEST_STEP, SPEED_SHARE * speed / max(rate, 1e-9))
    for axis in range(2):
        breaks = law.x_breaks if axis == 0 else law.y_breaks
        origin = law.origin_x if axis == 0 else law.origin_y
        h = min(h, _time_short_of(_next_break(breaks, s[axis], s[axis + 2]), s[axis + 2], a[axis]))
        if law.patterned:
            ahead = _next_line(law, origin, s[axis], s[axis + 2])
            if law.bilinear:
                h = min(h, _time_to(ahead, s[axis + 2], a[axis]))
            elif s[axis + 2] != 0.0:
                h = min(h, _time_short_of(ahead, s[axis + 2], a[axis]))
    if t < sweep_start - 1e-9:
        h = min(h, sweep_start - t)
    elif t < sweep_end - 1e-9:
        h = min(h, sweep_end - t)
    return h


@compiled
def derivative(
    law: Law, motion: Any, push: Any, parts: Any, base_clock: float, t: float, s: Any, a: Any
) -> None:
    """Acceleration a (3,) of state s (x, y, vx, vy, theta, omega) at time t."""
    motion[T] = t
    motion[CLOCK] = base_clock + t
    motion[HEADING] = s[4]
    a[0], a[1], a[2] = accelerate(law, motion, push, parts, s[0], s[1], s[2], s[3], s[5])


@inlined
def _offset(s: Any, velocity: Any, a: Any, h: float, out: Any) -> None:
    """Out = s advanced by h along a stage's velocities and accelerations."""
    out[0] = s[0] + h * velocity[2]
    out[1] = s[1] + h * velocity[3]
    out[4] = s[4] + h * velocity[5]
    out[2] = s[2] + h * a[0]
    out[3] = s[3] + h * a[1]
    out[5] = s[5] + h * a[2]


@compiled
def runge_kutta(
    law: Law,
    motion: Any,
    push: Any,
    parts: Any,
    clock: float,
    t: float,
    s: Any,
    a: Any,
    h: float,
    stages: Any,
) -> None:
    """One step: s becomes the state at t + h; a must be its acceleration at t.

    `stages` is (6, 6): three stages' states in rows 0–2 and accelerations in rows 3–5.
    """
    s2, s3, s4 = stages[0], stages[1], stages[2]
    a2, a3, a4 = stages[3], stages[4], stages[5]
    _offset(s, s, a, 0.5 * h, s2)
    derivative(law, motion, push, parts, clock, t + 0.5 * h, s2, a2)
    _offset(s, s2, a2, 0.5 * h, s3)
    derivative(law, motion, push, parts, clock, t + 0.5 * h, s3, a3)
    _offset(s, s3, a3, h, s4)
    derivative(law, motion, push, parts, clock, t + h, s4, a4)
    sixth = h / 6.0
    s[0] += sixth * (s[2] + 2.0 * s2[2] + 2.0 * s3[2] + s4[2])
    s[1] += sixth * (s[3] + 2.0 * s2[3] + 2.0 * s3[3] + s4[3])
    s[4] += sixth * (s[5] + 2.0 * s2[5] + 2.0 * s3[5] + s4[5])
    s[2] += sixth * (a[0] + 2.0 * a2[0] + 2.0 * a3[0] + a4[0])
    s[3] += sixth * (a[1] + 2.0 * a2[1] + 2.0 * a3[1] + a4[1])
    s[5] += sixth * (a[2] + 2.0 * a2[2] + 2.0 * a3[2] + a4[2])


@inlined
def between(s0: Any, a0: Any, s1: Any, a1: Any, h: float, u: float, out: Any) -> None:
    """State at the fraction u of a step of length h from s0 to s1."""
    out[0], out[2] = quintic(s0[0], s0[2], a0[0], s1[0], s1[2], a1[0], h, u)
    out[1], out[3] = quintic(s0[1], s0[3], a0[1], s1[1], s1[3], a1[1], h, u)
    out[4], out[5] = quintic(s0[4], s0[5], a0[2], s1[4], s1[5], a1[2], h, u)
