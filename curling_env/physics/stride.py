"""One stride of a sliding stone: a second or so of motion that still follows every cell.

The law is acceleration = μ(x, y)·P + Q. P and Q, which cost exponentials and logarithms, change
smoothly along a path; μ, which costs four table entries, may change in every cell. A stride
therefore takes P and Q as parabolas in time through its beginning, middle and end, and marches
through the map from line to line with them. The parabolas of the stride before, extrapolated,
predict; the law at the predicted middle and end corrects (collocation at the Lobatto points, order
four), and the size of the correction says how long the next stride may be.
"""

# Work arrays come untyped through compiled code: what is read from them is unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.effects.motion import CLOCK, HEADING, PUSH_SIZE, T
from curling_env.physics.law import Law, feel, patch_of

MOST_KNOTS = 256
"""Places along one stride that `march` can keep; strides are kept shorter than this many lines."""
KNOT_SIZE = 10
"""A knot: time since the stride began, x, y, theta, their rates, their accelerations."""
PASSES = 4
"""Times the law is asked about one stride before a shorter one is taken."""
SPIN_LENGTH = 0.01
"""A heading off by one radian counts as a position off by this [m]."""


class Work(NamedTuple):
    """The arrays a slide works in; none outlives it.

    Parameters
    ----------
    push : (PUSH_SIZE,) what effects write
    states : (3, 6) x, y, theta, vx, vy, spin at a stride's beginning, middle and end
    again : (3, 6) the same for marching a second time
    parts : (3, 6) P and Q there
    curves : (3, 6) P and Q as parabolas of the fraction of the stride
    last_curves : (3, 6) those of the stride before
    moments : (4,) ∫ μ·u^k dt for k = 1, 2, 3, over the fraction u, and μ at the end
    knots : (MOST_KNOTS, KNOT_SIZE)
    probe : (6,) a state between knots
    """

    push: NDArray[np.float64]
    states: NDArray[np.float64]
    again: NDArray[np.float64]
    parts: NDArray[np.float64]
    curves: NDArray[np.float64]
    last_curves: NDArray[np.float64]
    moments: NDArray[np.float64]
    knots: NDArray[np.float64]
    probe: NDArray[np.float64]


def new_work() -> Work:
    """Work arrays for one thread."""
    return Work(
        push=np.zeros(PUSH_SIZE),
        states=np.zeros((3, 6)),
        again=np.zeros((3, 6)),
        parts=np.zeros((3, 6)),
        curves=np.zeros((3, 6)),
        last_curves=np.zeros((3, 6)),
        moments=np.zeros(4),
        knots=np.zeros((MOST_KNOTS, KNOT_SIZE)),
        probe=np.zeros(6),
    )


@inlined
def _time_to(distance: float, velocity: float, gain: float, within: float) -> float:
    """Time to cover a distance at speed `velocity` changing at `gain`; infinite if not `within`."""
    if velocity * within + 0.5 * max(gain, 0.0) * within * within < distance:
        return np.inf
    root = velocity * velocity + 2.0 * gain * distance
    if root <= 0.0:
        return np.inf
    return 2.0 * distance / (velocity + math.sqrt(root))


@compiled
def march(law: Law, curves: Any, h: float, states: Any, moments: Any, knots: Any) -> int:
    """Follow P and Q through the map for a time h, line by line.

    Within a patch of the map μ along the path is smooth, so each piece is one Simpson step.

    Parameters
    ----------
    law : the ice
    curves : (3, 6) P and Q as parabolas of the fraction u of the stride
    h : length of the stride [s]
    states : (3, 6) the first row given; the middle and the end are filled
    moments : (4,) filled with ∫ μ·u^k dt, k = 1, 2, 3, and μ at the end
    knots : (n, KNOT_SIZE) filled where n > 0

    Returns
    -------
    number of knots
    """
    x: Any = states[0, 0]
    y: Any = states[0, 1]
    theta: Any = states[0, 2]
    vx: Any = states[0, 3]
    vy: Any = states[0, 4]
    spin: Any = states[0, 5]
    cell: Any = law.cell
    per_cell = 1.0 / cell
    i = math.floor((y - law.origin_y) * per_cell)
    j = math.floor((x - law.origin_x) * per_cell)
    low_y: Any = law.origin_y + i * cell
    low_x: Any = law.origin_x + j * cell
    base, across, along, twist = patch_of(law, i, j)
    u: Any = (y - low_y) * per_cell
    v: Any = (x - low_x) * per_cell
    mu: Any = base + across * v + along * u + twist * u * v
    px = curves[0, 0]
    py = curves[0, 1]
    pt = curves[0, 2]
    ax: Any = mu * px + curves[0, 3]
    ay: Any = mu * py + curves[0, 4]
    at: Any = mu * pt + curves[0, 5]
    m1: Any = 0.0
    m2: Any = 0.0
    m3: Any = 0.0
    per_h = 1.0 / h
    begun: float = 0.0
    target = 0.5 * h
    row = 1
    keep = knots.shape[0] > 0
    n = 0
    if keep:
        _keep(knots, 0, 0.0, x, y, theta, vx, vy, spin, ax, ay, at)
        n = 1
    while True:
        dt: float = target - begun
        line = 0
        step_i = step_j = 0
        if law.patterned:
            # The next line ahead on each axis; one already passed is taken at once.
            if vy != 0.0:
                step_i = 1 if vy > 0.0 else -1
                ahead = low_y + cell - y if vy > 0.0 else y - low_y
                until = 0.0 if ahead <= 0.0 else _time_to(ahead, math.fabs(vy), ay * step_i, dt)
                if until < dt:
                    dt = until
                    line = 1
            if vx != 0.0:
                step_j = 1 if vx > 0.0 else -1
                ahead = low_x + cell - x if vx > 0.0 else x - low_x
                until = 0.0 if ahead <= 0.0 else _time_to(ahead, math.fabs(vx), ax * step_j, dt)
                if until < dt:
                    dt = until
                    line = 2
        if dt > 0.0:
            half = 0.5 * dt
            mid_x = x + half * (vx + 0.5 * half * ax)
            mid_y = y + half * (vy + 0.5 * half * ay)
            end_x = x + dt * (vx + half * ax)
            end_y = y + dt * (vy + half * ay)
            u = (mid_y - low_y) * per_cell
            v = (mid_x - low_x) * per_cell
            mu_mid = base + across * v + along * u + twist * u * v
            u = (end_y - low_y) * per_cell
            v = (end_x - low_x) * per_cell
            mu_end = base + across * v + along * u + twist * u * v
            f0 = begun * per_h
            f = (begun + half) * per_h
            mid_ax = mu_mid * (curves[0, 0] + f * (curves[1, 0] + f * curves[2, 0]))
            mid_ax += curves[0, 3] + f * (curves[1, 3] + f * curves[2, 3])
            mid_ay = mu_mid * (curves[0, 1] + f * (curves[1, 1] + f * curves[2, 1]))
            mid_ay += curves[0, 4] + f * (curves[1, 4] + f * curves[2, 4])
            mid_at = mu_mid * (curves[0, 2] + f * (curves[1, 2] + f * curves[2, 2]))
            mid_at += curves[0, 5] + f * (curves[1, 5] + f * curves[2, 5])
            begun = begun + dt if line != 0 else target
            f1 = begun * per_h
            px = curves[0, 0] + f1 * (curves[1, 0] + f1 * curves[2, 0])
            py = curves[0, 1] + f1 * (curves[1, 1] + f1 * curves[2, 1])
            pt = curves[0, 2] + f1 * (curves[1, 2] + f1 * curves[2, 2])
            end_ax = mu_end * px + curves[0, 3] + f1 * (curves[1, 3] + f1 * curves[2, 3])
            end_ay = mu_end * py + curves[0, 4] + f1 * (curves[1, 4] + f1 * curves[2, 4])
            end_at = mu_end * pt + curves[0, 5] + f1 * (curves[1, 5] + f1 * curves[2, 5])
            sixth = dt / 6.0
            x += dt * (vx + sixth * (ax + 2.0 * mid_ax))
            y += dt * (vy + sixth * (ay + 2.0 * mid_ay))
            theta += dt * (spin + sixth * (at + 2.0 * mid_at))
            vx += sixth * (ax + 4.0 * mid_ax + end_ax)
            vy += sixth * (ay + 4.0 * mid_ay + end_ay)
            spin += sixth * (at + 4.0 * mid_at + end_at)
            w0 = mu * f0
            w = 4.0 * mu_mid * f
            w1 = mu_end * f1
            m1 += sixth * (w0 + w + w1)
            w0 *= f0
            w *= f
            w1 *= f1
            m2 += sixth * (w0 + w + w1)
            m3 += sixth * (w0 * f0 + w * f + w1 * f1)
            mu = mu_end
            ax = end_ax
            ay = end_ay
            at = end_at
        if line != 0:
            if keep and not law.bilinear and n < knots.shape[0]:  # μ jumps: a knot on each side
                _keep(knots, n, begun, x, y, theta, vx, vy, spin, ax, ay, at)
                n += 1
            if line == 1:
                i += step_i
                low_y = law.origin_y + i * cell
            else:
                j += step_j
                low_x = law.origin_x + j * cell
            base, across, along, twist = patch_of(law, i, j)
            if not law.bilinear:
                ax += (base - mu) * px
                ay += (base - mu) * py
                at += (base - mu) * pt
                mu = base
        if keep and n < knots.shape[0]:
            _keep(knots, n, begun, x, y, theta, vx, vy, spin, ax, ay, at)
            n += 1
        if line == 0:
            _set_state(states, row, x, y, theta, vx, vy, spin)
            if row == 2:
                break
            row = 2
            target = h
    moments[0] = m1
    moments[1] = m2
    moments[2] = m3
    moments[3] = mu
    return n


@inlined
def _set_state(
    states: Any, row: int, x: float, y: float, theta: float, vx: float, vy: float, spin: float
) -> None:
    states[row, 0] = x
    states[row, 1] = y
    states[row, 2] = theta
    states[row, 3] = vx
    states[row, 4] = vy
    states[row, 5] = spin


@inlined
def _keep(
    knots: Any,
    n: int,
    t: float,
    x: float,
    y: float,
    theta: float,
    vx: float,
    vy: float,
    spin: float,
    ax: float,
    ay: float,
    at: float,
) -> None:
    knots[n, 0] = t
    knots[n, 1] = x
    knots[n, 2] = y
    knots[n, 3] = theta
    knots[n, 4] = vx
    knots[n, 5] = vy
    knots[n, 6] = spin
    knots[n, 7] = ax
    knots[n, 8] = ay
    knots[n, 9] = at


@inlined
def stride(
    law: Law,
    motion: Any,
    work: Work,
    t: float,
    clock: float,
    h: float,
    ratio: float,
    time_left: float,
    close: float,
) -> Any:
    """Advance by h: states[2] becomes the state then, parts and curves those of the stride.

    Parameters
    ----------
    law : the ice
    motion : (MOTION_SIZE,) with ORDER, STONE and SWEPT set
    work : states[0] is the state at t; if ratio > 0, last_curves are those of the stride before
    t, clock : time since release and session time of the release [s]
    h : [s]
    ratio : h over the length of the stride before; 0 if there is none to go on from
    time_left : about how long the stone will go on [s]
    close : correction small enough to need no other pass [m]

    Returns
    -------
    first : what the prediction was off by, as a place of rest [m]
    last : what the last pass corrected [m]
    """
    states, parts, curves, moments = work.states, work.parts, work.curves, work.moments
    first_node = 1
    if ratio > 0.0:
        for k in range(6):
            c0 = work.last_curves[0, k]
            c1 = work.last_curves[1, k]
            c2 = work.last_curves[2, k]
            curves[0, k] = c0 + c1 + c2
            parts[0, k] = curves[0, k]
            curves[1, k] = ratio * (c1 + 2.0 * c2)
            curves[2, k] = ratio * ratio * c2
    else:
        first_node = 0
    first = 0.0
    last = 0.0
    for attempt in range(PASSES):
        for node in range(first_node, 3):
            if node == 1:
                march(law, curves, h, states, moments, work.knots[:0])
            s = states[node]
            motion[T] = t + 0.5 * node * h
            motion[CLOCK] = clock + motion[T]
            motion[HEADING] = s[2]
            feel(law, motion, work.push, s[0], s[1], s[3], s[4], s[5], parts[node])
            if node == 0:
                for k in range(6):
                    curves[0, k] = parts[0, k]
                    curves[1, k] = 0.0
                    curves[2, k] = 0.0
        first_node = 1
        m1, m2, m3 = moments[0], moments[1], moments[2]
        last = 0.0
        for k in range(3):
            # The parabolas through the new P and Q at middle and end, less those marched with.
            p1 = parts[1, k] - curves[0, k] - 0.5 * curves[1, k] - 0.25 * curves[2, k]
            p2 = parts[2, k] - curves[0, k] - curves[1, k] - curves[2, k]
            q1 = parts[1, k + 3] - curves[0, k + 3] - 0.5 * curves[1, k + 3]
            q1 -= 0.25 * curves[2, k + 3]
            q2 = parts[2, k + 3] - curves[0, k + 3] - curves[1, k + 3] - curves[2, k + 3]
            p_u = 4.0 * p1 - p2
            p_uu = 2.0 * p2 - 4.0 * p1
            q_u = 4.0 * q1 - q2
            q_uu = 2.0 * q2 - 4.0 * q1
            place = h * (p_u * (m1 - m2) + p_uu * (m2 - m3) + h * (q_u / 6.0 + q_uu / 12.0))
            rate = p_u * m1 + p_uu * m2 + h * (q_u / 2.0 + q_uu / 3.0)
            states[2, k] += place
            states[2, k + 3] += rate
            curves[1, k] += p_u
            curves[2, k] += p_uu
            curves[1, k + 3] += q_u
            curves[2, k + 3] += q_uu
            off = math.fabs(place) + 0.5 * time_left * math.fabs(rate)
            last = max(last, off if k < 2 else SPIN_LENGTH * off)
        if attempt == 0:
            first = last
        if last <= close:
            break
    return first, last


@inlined
def quintic(p0: float, v0: float, a0: float, p1: float, v1: float, a1: float, h: float, u: float):
    """Position and velocity at the fraction u of an interval, from both ends' values."""
    d = p1 - p0 - h * (v0 + 0.5 * h * a0)
    e = h * (v1 - v0 - h * a0)
    f = h * h * (a1 - a0)
    c3 = 10.0 * d - 4.0 * e + 0.5 * f
    c4 = -15.0 * d + 7.0 * e - f
    c5 = 6.0 * d - 3.0 * e + 0.5 * f
    position = p0 + u * (h * v0 + u * (0.5 * h * h * a0 + u * (c3 + u * (c4 + u * c5))))
    velocity = v0 + u * (h * a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)) / h)
    return position, velocity


@inlined
def between_knots(knots: Any, k: int, tau: float, out: Any) -> None:
    """State (x, y, theta, vx, vy, spin) a time tau after knot k, before knot k + 1."""
    h = knots[k + 1, 0] - knots[k, 0]
    u = tau / h
    for c in range(3):
        out[c], out[c + 3] = quintic(
            knots[k, 1 + c],
            knots[k, 4 + c],
            knots[k, 7 + c],
            knots[k + 1, 1 + c],
            knots[k + 1, 4 + c],
            knots[k + 1, 7 + c],
            h,
            u,
        )
