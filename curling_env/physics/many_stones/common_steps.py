"""Several stones sliding at once, each as if alone, until two of them touch.

All moving stones take Runge–Kutta steps in common. Contact is found on the paths between the ends
of a step, so that a hit stands to a nanometre and a resting stone costs one comparison per step.
What a contact does is decided in `engine`.
"""

from __future__ import annotations

from enum import IntEnum
from math import fabs, sqrt
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import compiled, inlined, part
from curling_env.physics.law import Law
from curling_env.physics.many_stones.contacts import collides
from curling_env.physics.many_stones.runge_kutta import (
    StageWorkspace,
    between,
    derivative,
    new_stage_workspace,
    runge_kutta,
    step_length,
)
from curling_env.physics.many_stones.tuning import (
    MAX_STEPS,
    PIECES_OF_A_STEP,
    REST_SPEED,
)
from curling_env.physics.motion import SWEPT
from curling_env.physics.one_stone.integrate import Delivery, Sampling
from curling_env.physics.one_stone.surroundings import Limits
from curling_env.physics.one_stone.tuning import MAX_TIME
from curling_env.physics.state import State
from curling_env.physics.tuning import CREEP
from curling_env.typing import Floats, Integers


class MovingStones(NamedTuple):
    """All stones of a throw, the delivered one last.

    Parameters
    ----------
    states : (n, 6) as in `State`
    phases : (n,) `Phase` of each
    ends : (n,) time at which each came to rest or left [s]
    motion : (n, MOTION_SIZE) with ORDER and STONE set
    """

    states: Floats
    phases: Integers
    ends: Floats
    motion: Floats


class JointWorkspace(NamedTuple):
    """The arrays in which n stones slide together.

    Parameters
    ----------
    stages : of a Runge–Kutta step
    before : (n, 6) states at the beginning of a step
    a0, a1 : (n, 3) accelerations at its beginning and end
    p, q : (6,) states in between
    """

    stages: StageWorkspace
    before: Floats
    a0: Floats
    a1: Floats
    p: Floats
    q: Floats


def new_joint_workspace(n: int) -> JointWorkspace:
    """Work arrays for n stones."""
    return JointWorkspace(
        stages=new_stage_workspace(),
        before=np.empty((n, 6)),
        a0=np.zeros((n, 3)),
        a1=np.zeros((n, 3)),
        p=np.empty(6),
        q=np.empty(6),
    )


class Segment(NamedTuple):
    """The path of one stone during a step.

    Parameters
    ----------
    begin, end : (6,) states
    a0, a1 : (3,) accelerations then
    moves : whether it moves; a stone that rests stays at `begin`
    """

    begin: Floats
    a0: Floats
    end: Floats
    a1: Floats
    moves: bool


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
def _at(segment: Segment, h: float, u: float, out: Any) -> None:
    """State of a stone at the fraction u of a step of length h."""
    if segment.moves:
        between(segment.begin, segment.a0, segment.end, segment.a1, h, u, out)
    else:
        for k in range(6):
            out[k] = segment.begin[k]


@inlined
def _approach(p: Any, q: Any, reach: float) -> Any:
    """Gap between two stones [m] and the speed at which it closes [m/s]."""
    x, y = q[State.X] - p[State.X], q[State.Y] - p[State.Y]
    vx, vy = q[State.VX] - p[State.VX], q[State.VY] - p[State.VY]
    distance = sqrt(x * x + y * y)
    closing = -(x * vx + y * vy) / max(distance, 1e-9)
    return distance - reach, closing


@compiled
def first_touch(
    first: Segment, second: Segment, h: float, reach: float, work: JointWorkspace
) -> float:
    """Fraction of a step at which two stones first touch while closing, or 2 if they do not.

    Parameters
    ----------
    first, second : their paths
    h : length of the step [s]
    reach : distance between centres in contact [m]
    work : work arrays
    """
    p, q = work.p, work.q
    low = 0.0
    gap, closing = _approach(first.begin, second.begin, reach)
    if gap < 0.0 and collides(gap, closing):
        return 0.0
    for k in range(1, PIECES_OF_A_STEP + 1):
        high = k / PIECES_OF_A_STEP
        _at(first, h, high, p)
        _at(second, h, high, q)
        next_gap, next_closing = _approach(p, q, reach)
        inside = high
        inside_gap = next_gap
        if next_gap >= 0.0 and gap >= 0.0 and closing > 0.0 > next_closing:
            # They were nearest in between: a graze may hide there.
            a, b = low, high
            for _ in range(40):
                inside = 0.5 * (a + b)
                _at(first, h, inside, p)
                _at(second, h, inside, q)
                inside_gap, rate = _approach(p, q, reach)
                if inside_gap < 0.0:
                    break
                if rate > 0.0:
                    a = inside
                else:
                    b = inside
        if inside_gap < 0.0:
            if gap < 0.0:
                if collides(next_gap, next_closing):
                    return high
            else:
                a, b = low, inside
                for _ in range(50):
                    middle = 0.5 * (a + b)
                    _at(first, h, middle, p)
                    _at(second, h, middle, q)
                    if _approach(p, q, reach)[0] < 0.0:
                        b = middle
                    else:
                        a = middle
                _at(first, h, b, p)
                _at(second, h, b, q)
                if _approach(p, q, reach)[1] > CREEP:
                    return b
        low, gap, closing = high, next_gap, next_closing
    return 2.0


@inlined
def _room(s: Any, bounds: Any) -> float:
    """How far inside the bounds a stone is [m]; negative once past one."""
    x, y = s[State.X], s[State.Y]
    return min(min(x - bounds[0], bounds[1] - x), min(y - bounds[2], bounds[3] - y))


@part
def _first_exit(segment: Segment, h: float, bounds: Any, p: Any) -> float:
    """Fraction of a step at which a stone leaves the bounds, or 2 if it does not."""
    low = 0.0
    for k in range(1, PIECES_OF_A_STEP + 1):
        high = k / PIECES_OF_A_STEP
        _at(segment, h, high, p)
        if _room(p, bounds) < 0.0:
            for _ in range(40):
                middle = 0.5 * (low + high)
                _at(segment, h, middle, p)
                if _room(p, bounds) < 0.0:
                    high = middle
                else:
                    low = middle
            return high
        low = high
    return 2.0


@inlined
def _greater_speed(s0: Any, s1: Any) -> float:
    """A bound on the speed within a step, from its ends [m/s]."""
    vx, vy = s0[State.VX], s0[State.VY]
    before = sqrt(vx * vx + vy * vy)
    vx, vy = s1[State.VX], s1[State.VY]
    after = sqrt(vx * vx + vy * vy)
    return 1.05 * max(before, after) + 1e-3


@inlined
def _segment(stones: MovingStones, work: JointWorkspace, i: int) -> Segment:
    """The path of stone i during the step just taken."""
    moves = stones.phases[i] == Phase.MOVING
    return Segment(work.before[i], work.a0[i], stones.states[i], work.a1[i], moves)


@inlined
def _stop_uniformly(s: Any, a: Any, speed: float) -> float:
    """Bring a slow stone to rest where uniform deceleration does; returns the time it takes [s]."""
    tail = speed / max(sqrt(a[0] * a[0] + a[1] * a[1]), 1e-6)
    s[State.X] += 0.5 * tail * s[State.VX]
    s[State.Y] += 0.5 * tail * s[State.VY]
    s[State.THETA] += 0.5 * tail * s[State.OMEGA]
    s[State.VX] = s[State.VY] = s[State.OMEGA] = 0.0
    return tail


@part
def _first_event(stones: MovingStones, limits: Limits, h: float, work: JointWorkspace) -> Any:
    """The first contact or exit during a step of length h.

    Returns
    -------
    fraction : of the step at which it happens, or 2 if nothing does
    first, second : the stones in contact, or -1
    leaver : the stone that leaves the bounds, or -1
    """
    states, phases, before = stones.states, stones.phases, work.before
    n = states.shape[0]
    fraction, first, second, leaver = 2.0, -1, -1, -1
    for i in range(n):
        if phases[i] != Phase.MOVING:
            continue
        # In a step no stone goes further than its greater speed times h. Where there is more room
        # than that, nothing happens.
        travel = h * _greater_speed(before[i], states[i])
        if _room(before[i], limits.bounds) < travel:
            u = _first_exit(_segment(stones, work, i), h, limits.bounds, work.p)
            if u < fraction:
                fraction, first, second, leaver = u, -1, -1, i
        for j in range(n):
            j_moves = phases[j] == Phase.MOVING
            if phases[j] == Phase.GONE or j == i or (j_moves and j < i):
                continue
            nearest = travel + (h * _greater_speed(before[j], states[j]) if j_moves else 0.0)
            if _approach(before[i], before[j], limits.reach)[0] > nearest:
                continue
            pair = _segment(stones, work, i), _segment(stones, work, j)
            u = first_touch(pair[0], pair[1], h, limits.reach, work)
            if u < fraction:
                fraction, first, second, leaver = u, i, j, -1
    return fraction, first, second, leaver


@compiled
def slide_together(
    law: Law,
    t: float,
    stones: MovingStones,
    delivery: Delivery,
    limits: Limits,
    sampling: Sampling,
    frame: int,
    work: JointWorkspace,
) -> Any:
    """Slide stones until none moves or two touch.

    Parameters
    ----------
    law : the ice
    t : time since release at which this begins [s]
    stones : become what they are at the end; the last one is the delivered one, which alone is
        swept
    delivery : clock and sweep
    limits : bounds of a centre in play, and distance of centres in contact
    sampling : rows (m, n, 3) filled in with x, y, theta of every stone at k·dt; m = 0 for none
    frame : number of samples filled in before
    work : work arrays

    Returns
    -------
    pause : a `Pause`
    t : time of the pause [s]
    first, second : the stones in contact, or -1
    frame : number of samples filled in
    """
    states, phases, motion = stones.states, stones.phases, stones.motion
    before, a0, a = work.before, work.a0, work.a1
    n = states.shape[0]
    fresh = True
    for _ in range(MAX_STEPS):
        swept = 1.0 if delivery.sweep_start <= t + 1e-9 < delivery.sweep_end else 0.0
        if swept != motion[n - 1, SWEPT]:
            motion[n - 1, SWEPT] = swept
            fresh = True
        moving = 0
        h = np.inf
        for i in range(n):
            if phases[i] != Phase.MOVING:
                continue
            s = states[i]
            if fresh:
                derivative(law, motion[i], work.stages, delivery.clock, t, s, a[i])
            speed = sqrt(s[State.VX] * s[State.VX] + s[State.VY] * s[State.VY])
            if max(speed, fabs(s[State.OMEGA]) * law.band_radius) < REST_SPEED:
                stones.ends[i] = t + _stop_uniformly(s, a[i], speed)
                # This last way is not watched.
                phases[i] = Phase.RESTING if _room(s, limits.bounds) >= 0.0 else Phase.GONE
                continue
            moving += 1
            h = min(h, step_length(law, s, a[i], t, delivery))
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
                clock = delivery.clock
                runge_kutta(law, motion[i], work.stages, clock, t, states[i], a[i], h)
                derivative(law, motion[i], work.stages, clock, t + h, states[i], a[i])
        fraction, first, second, leaver = _first_event(stones, limits, h, work)
        whole = fraction > 1.0
        share = 1.0 if whole else fraction
        while frame < sampling.rows.shape[0] and frame * sampling.dt <= t + share * h:
            for i in range(n):
                u = min(max((frame * sampling.dt - t) / h, 0.0), 1.0)
                _at(_segment(stones, work, i), h, u, work.p)
                sampling.rows[frame, i, 0] = work.p[State.X]
                sampling.rows[frame, i, 1] = work.p[State.Y]
                sampling.rows[frame, i, 2] = work.p[State.THETA]
            frame += 1
        t += share * h
        fresh = not whole
        if whole:
            continue
        for i in range(n):
            if phases[i] == Phase.MOVING:
                _at(_segment(stones, work, i), h, share, work.p)
                for k in range(6):
                    states[i, k] = work.p[k]
        if leaver >= 0:
            phases[leaver] = Phase.GONE
            stones.ends[leaver] = t
        else:
            return Pause.CONTACT, t, first, second, frame
    return Pause.NEVER_STOPS, t, -1, -1, frame
