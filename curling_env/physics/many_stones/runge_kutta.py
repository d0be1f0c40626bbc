"""Classical Runge–Kutta steps under the law, and the path between their ends.

This is how stones slide that move at the same time. It is independent of `one_stone.step`: fourth
order, with steps that end wherever the law is not smooth (lines of the map, edges of patches, the
beginning and end of a sweep), and a quintic between them through both ends' states and
accelerations.
"""

from __future__ import annotations

from math import fabs, sqrt
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import inlined, part
from curling_env.physics.law import Law, accelerate
from curling_env.physics.many_stones.tuning import (
    JUMP_MARGIN,
    MAX_SPEED_LOSS,
    MAX_STEP,
    SKIPPED_LINE,
)
from curling_env.physics.motion import CLOCK, HEADING, PUSH_SIZE, T
from curling_env.physics.one_stone.integrate import Delivery
from curling_env.physics.one_stone.map_path import quintic
from curling_env.physics.state import State
from curling_env.typing import Floats


class StageWorkspace(NamedTuple):
    """The arrays in which one stone takes a Runge–Kutta step.

    Parameters
    ----------
    push : (PUSH_SIZE,) the effects' output
    terms : (6,) of the law
    states : (3, 6) at the second to fourth stage
    accelerations : (3, 3) there
    """

    push: Floats
    terms: Floats
    states: Floats
    accelerations: Floats


def new_stage_workspace() -> StageWorkspace:
    """Work arrays for `runge_kutta`."""
    return StageWorkspace(
        push=np.empty(PUSH_SIZE),
        terms=np.empty(6),
        states=np.empty((3, 6)),
        accelerations=np.empty((3, 3)),
    )


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
    return ahead + law.cell if law.bilinear and ahead <= SKIPPED_LINE else ahead


@inlined
def _time_short_of(distance: float, velocity: float, acceleration: float) -> float:
    """Time to come close to a jump, and from there to hop over it [s].

    The further off, the less certain the time: so short of it at first, then closer.
    """
    if distance < JUMP_MARGIN:
        return 2.0 * JUMP_MARGIN / max(fabs(velocity), 1e-3)
    short = 0.97 * distance if distance > 1e-3 else distance - 0.5 * JUMP_MARGIN
    return _time_to(short, velocity, acceleration)


@inlined
def step_length(law: Law, s: Any, a: Any, t: float, delivery: Delivery) -> float:
    """Length of the step to take from state s (6,) with acceleration a (3,) at time t [s]."""
    vx, vy = s[State.VX], s[State.VY]
    speed = max(sqrt(vx * vx + vy * vy), fabs(s[State.OMEGA]) * law.band_radius)
    rate = max(sqrt(a[0] * a[0] + a[1] * a[1]), fabs(a[2]) * law.band_radius)
    h = min(MAX_STEP, MAX_SPEED_LOSS * speed / max(rate, 1e-9))
    for axis in range(2):
        breaks = law.x_breaks if axis == 0 else law.y_breaks
        origin = law.origin_x if axis == 0 else law.origin_y
        v = s[State.VX + axis]
        h = min(h, _time_short_of(_next_break(breaks, s[axis], v), v, a[axis]))
        if law.patterned:
            ahead = _next_line(law, origin, s[axis], v)
            if law.bilinear:
                h = min(h, _time_to(ahead, v, a[axis]))
            elif v != 0.0:
                h = min(h, _time_short_of(ahead, v, a[axis]))
    if t < delivery.sweep_start - 1e-9:
        h = min(h, delivery.sweep_start - t)
    elif t < delivery.sweep_end - 1e-9:
        h = min(h, delivery.sweep_end - t)
    return h


@part
def derivative(
    law: Law, motion: Any, work: StageWorkspace, clock: float, t: float, s: Any, a: Any
) -> None:
    """Fill in the acceleration a (3,) of state s (6,) at time t.

    Parameters
    ----------
    law : the ice
    motion : (MOTION_SIZE,) with ORDER, STONE and SWEPT set
    work : work arrays
    clock : session time of the release [s]
    """
    motion[T] = t
    motion[CLOCK] = clock + t
    motion[HEADING] = s[State.THETA]
    x, y, vx, vy = s[State.X], s[State.Y], s[State.VX], s[State.VY]
    a[0], a[1], a[2] = accelerate(law, motion, work.push, work.terms, x, y, vx, vy, s[State.OMEGA])


@inlined
def _offset(s: Any, velocity: Any, a: Any, h: float, out: Any) -> None:
    """Out = s advanced by h along the velocities and accelerations of a stage."""
    out[State.X] = s[State.X] + h * velocity[State.VX]
    out[State.Y] = s[State.Y] + h * velocity[State.VY]
    out[State.THETA] = s[State.THETA] + h * velocity[State.OMEGA]
    out[State.VX] = s[State.VX] + h * a[0]
    out[State.VY] = s[State.VY] + h * a[1]
    out[State.OMEGA] = s[State.OMEGA] + h * a[2]


@inlined
def _add(s: Any, place: int, sixth: float, r1: float, r2: float, r3: float, r4: float) -> None:
    """Add to one quantity of s what its rates at the four stages come to."""
    s[place] += sixth * (r1 + 2.0 * r2 + 2.0 * r3 + r4)


@part
def runge_kutta(
    law: Law,
    motion: Any,
    work: StageWorkspace,
    clock: float,
    t: float,
    s: Any,
    a: Any,
    h: float,
) -> None:
    """One step: s (6,) becomes the state at t + h; a (3,) must be its acceleration at t.

    The other parameters are those of `derivative`.
    """
    s2, s3, s4 = work.states[0], work.states[1], work.states[2]
    a2, a3, a4 = work.accelerations[0], work.accelerations[1], work.accelerations[2]
    _offset(s, s, a, 0.5 * h, s2)
    derivative(law, motion, work, clock, t + 0.5 * h, s2, a2)
    _offset(s, s2, a2, 0.5 * h, s3)
    derivative(law, motion, work, clock, t + 0.5 * h, s3, a3)
    _offset(s, s3, a3, h, s4)
    derivative(law, motion, work, clock, t + h, s4, a4)
    sixth = h / 6.0
    vx, vy, omega = State.VX, State.VY, State.OMEGA
    _add(s, State.X, sixth, s[vx], s2[vx], s3[vx], s4[vx])
    _add(s, State.Y, sixth, s[vy], s2[vy], s3[vy], s4[vy])
    _add(s, State.THETA, sixth, s[omega], s2[omega], s3[omega], s4[omega])
    _add(s, vx, sixth, a[0], a2[0], a3[0], a4[0])
    _add(s, vy, sixth, a[1], a2[1], a3[1], a4[1])
    _add(s, omega, sixth, a[2], a2[2], a3[2], a4[2])


@inlined
def between(s0: Any, a0: Any, s1: Any, a1: Any, h: float, u: float, out: Any) -> None:
    """State at the fraction u of a step of length h from s0 (6,) to s1, accelerations a0 to a1."""
    out[State.X], out[State.VX] = quintic(
        (s0[State.X], s0[State.VX], a0[0]), (s1[State.X], s1[State.VX], a1[0]), h, u
    )
    out[State.Y], out[State.VY] = quintic(
        (s0[State.Y], s0[State.VY], a0[1]), (s1[State.Y], s1[State.VY], a1[1]), h, u
    )
    out[State.THETA], out[State.OMEGA] = quintic(
        (s0[State.THETA], s0[State.OMEGA], a0[2]), (s1[State.THETA], s1[State.OMEGA], a1[2]), h, u
    )
