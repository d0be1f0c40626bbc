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
from curling_env.physics.law import SLOWEST, Law, feel, patch_of

MOST_KNOTS = 256
"""Places along one stride that `march` can keep; strides are kept shorter than this many lines."""
KNOT_SIZE = 10
"""A knot: time since the stride began, x, y, theta, their rates, their accelerations."""
PASSES = 4
"""Times the law is asked about one stride before a shorter one is taken."""
STEADY = 1e-3
"""A stone that loses less than this part of its speed in a stride tells nothing of how P and Q
follow the speed."""
SPIN_LENGTH = 0.01
"""A heading off by one radian counts as a position off by this [m]."""


class Pace(NamedTuple):
    """How long strides may be.

    Parameters
    ----------
    aim : error of a stride's prediction that is aimed at, at the least [m]; what is left of it
        after the correction is some fiftieth
    aim_share : the same as a part of speed × time to rest, twice the way that is left
    first_share, longest_share : length of a stride that has none before it, and of the longest,
        over the time to rest
    rest_speed : of centre and band below which the rest is uniform deceleration [m/s]
    """

    aim: float
    aim_share: float
    first_share: float
    longest_share: float
    rest_speed: float


QUICK, EXACT = 1e-3, 1e-4
"""Tolerances of very many throws and of a single one [m]."""


def pace_of(tolerance: float) -> Pace:
    """How long strides may be for lone rests to be right within a tolerance, on any ice [m].

    Held to 0.1 ms Runge–Kutta steps on 300 ices that vary by up to a tenth from cell to cell, with
    patches, slopes, sweeping and drift: the worst rest at `QUICK` was 0.8 mm and 17 ms off,
    and 0.7 mm and 10 ms on standard ice whose every cell differs.
    """
    fine = tolerance / QUICK
    return Pace(
        aim=2e-4 * fine**2.7,
        aim_share=4e-5 * fine**2.7,
        first_share=0.1 * fine**0.5,
        longest_share=0.4 * fine**0.2,
        rest_speed=6e-3 * fine,
    )


class Work(NamedTuple):
    """What a slide works with: how fine it is, and arrays, none of which outlives it.

    Parameters
    ----------
    pace : how long strides may be
    push : (PUSH_SIZE,) what effects write
    states : (3, 6) x, y, theta, vx, vy, spin at a stride's beginning, middle and end
    again : (3, 6) the same for marching a second time
    parts : (3, 6) P and Q there
    curves : (4, 6) P and Q as parabolas of the fraction of the stride, and how much more P changes
        with the speed, which a rough map makes uneven
    last_curves, last_velocity : (3, 6), (3, 2) parabolas through P and Q and through the velocity
        of the stride before
    towards : (2,) direction of travel at a stride's beginning
    moments : (5,) ∫ μ·u^k dt for k = 0 to 3, over the fraction u, and μ at the end
    knots : (MOST_KNOTS, KNOT_SIZE)
    probe : (6,) a state between knots
    """

    pace: Pace
    push: NDArray[np.float64]
    states: NDArray[np.float64]
    again: NDArray[np.float64]
    parts: NDArray[np.float64]
    curves: NDArray[np.float64]
    last_curves: NDArray[np.float64]
    last_velocity: NDArray[np.float64]
    towards: NDArray[np.float64]
    moments: NDArray[np.float64]
    knots: NDArray[np.float64]
    probe: NDArray[np.float64]


def new_work(tolerance: float = QUICK) -> Work:
    """What one thread slides stones with, to within a tolerance [m]."""
    return Work(
        pace=pace_of(tolerance),
        push=np.zeros(PUSH_SIZE),
        states=np.zeros((3, 6)),
        again=np.zeros((3, 6)),
        parts=np.zeros((3, 6)),
        curves=np.zeros((4, 6)),
        last_curves=np.zeros((3, 6)),
        last_velocity=np.zeros((3, 2)),
        towards=np.zeros(2),
        moments=np.zeros(5),
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


@inlined
def _curve(curves: Any, k: int, u: float, speed: float) -> float:
    """P along x or y at the fraction u of a stride, at a speed."""
    return curves[0, k] + u * (curves[1, k] + u * curves[2, k]) + speed * curves[3, k]


@inlined
def _parabola(curves: Any, k: int, u: float) -> float:
    """The spin's P, or Q, at the fraction u of a stride."""
    return curves[0, k] + u * (curves[1, k] + u * curves[2, k])


@inlined
def _turn(curves: Any, spin: float, h: float, u: float, m0: float, m1: float, m2: float, m3: float):
    """How far a stone has turned up to the fraction u of a stride, and its spin then.

    The spin does not steer: it follows from the moments ∫ μ·u^k dt up to there.
    """
    c0, c1, c2 = curves[0, 2], curves[1, 2], curves[2, 2]
    q0, q1, q2 = curves[0, 5], curves[1, 5], curves[2, 5]
    gain = c0 * m0 + c1 * m1 + c2 * m2
    lag = c0 * m1 + c1 * m2 + c2 * m3
    rise = h * u * (q0 + u * (q1 / 2.0 + u * (q2 / 3.0)))
    way = h * h * u * u * (q0 / 2.0 + u * (q1 / 6.0 + u * (q2 / 12.0)))
    return h * (u * (spin + gain) - lag) + way, spin + gain + rise


@compiled
def march(
    law: Law, curves: Any, towards: Any, h: float, states: Any, moments: Any, knots: Any
) -> int:
    """Follow P and Q through the map for a time h, line by line.

    Within a patch of the map μ along the path is smooth, so each piece is one Simpson step.

    Parameters
    ----------
    law : the ice
    curves, towards : (4, 6), (2,) P and Q along the stride, as of `Work`
    h : length of the stride [s]
    states : (3, 6) the first row given; the middle and the end are filled
    moments : (5,) filled with ∫ μ·u^k dt, k = 0 to 3, and μ at the end
    knots : (n, KNOT_SIZE) filled where n > 0

    Returns
    -------
    number of knots
    """
    x: Any = states[0, 0]
    y: Any = states[0, 1]
    vx: Any = states[0, 3]
    vy: Any = states[0, 4]
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
    tx = towards[0]
    ty = towards[1]
    speed: Any = vx * tx + vy * ty
    px = curves[0, 0] + speed * curves[3, 0]
    py = curves[0, 1] + speed * curves[3, 1]
    ax: Any = mu * px + curves[0, 3]
    ay: Any = mu * py + curves[0, 4]
    m0: Any = 0.0
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
        _keep(knots, 0, states, curves, h, 0.0, m0, m1, m2, m3, x, y, vx, vy, ax, ay, mu)
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
            sixth = dt / 6.0
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
            speed = (vx + half * ax) * tx + (vy + half * ay) * ty
            mid_ax = mu_mid * _curve(curves, 0, f, speed) + _parabola(curves, 3, f)
            mid_ay = mu_mid * _curve(curves, 1, f, speed) + _parabola(curves, 4, f)
            begun = begun + dt if line != 0 else target
            f1 = begun * per_h
            speed = (vx + dt * mid_ax) * tx + (vy + dt * mid_ay) * ty
            px = _curve(curves, 0, f1, speed)
            py = _curve(curves, 1, f1, speed)
            end_ax = mu_end * px + _parabola(curves, 3, f1)
            end_ay = mu_end * py + _parabola(curves, 4, f1)
            # Halfway its speed was guessed from the beginning; now the end is known as well, and
            # what the guess was off by, times how P follows the speed, is made good.
            along_x = 8.0 * mid_ax - 7.0 * ax - end_ax
            along_y = 8.0 * mid_ay - 7.0 * ay - end_ay
            late = sixth * sixth * mu_mid * (along_x * tx + along_y * ty)
            late_x = late * curves[3, 0]
            late_y = late * curves[3, 1]
            x += dt * (vx + sixth * (ax + 2.0 * mid_ax) + 0.5 * late_x)
            y += dt * (vy + sixth * (ay + 2.0 * mid_ay) + 0.5 * late_y)
            vx += sixth * (ax + 4.0 * mid_ax + end_ax) + late_x
            vy += sixth * (ay + 4.0 * mid_ay + end_ay) + late_y
            w0 = sixth * mu
            w = 4.0 * sixth * mu_mid
            w1 = sixth * mu_end
            m0 += w0 + w + w1
            w0 *= f0
            w *= f
            w1 *= f1
            m1 += w0 + w + w1
            w0 *= f0
            w *= f
            w1 *= f1
            m2 += w0 + w + w1
            m3 += w0 * f0 + w * f + w1 * f1
            mu = mu_end
            ax = end_ax
            ay = end_ay
        if line != 0:
            if keep and not law.bilinear and n < knots.shape[0]:  # μ jumps: a knot on each side
                _keep(knots, n, states, curves, h, begun, m0, m1, m2, m3, x, y, vx, vy, ax, ay, mu)
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
                mu = base
        if keep and n < knots.shape[0]:
            _keep(knots, n, states, curves, h, begun, m0, m1, m2, m3, x, y, vx, vy, ax, ay, mu)
            n += 1
        if line == 0:
            turned, spin = _turn(curves, states[0, 5], h, begun * per_h, m0, m1, m2, m3)
            states[row, 0] = x
            states[row, 1] = y
            states[row, 2] = states[0, 2] + turned
            states[row, 3] = vx
            states[row, 4] = vy
            states[row, 5] = spin
            if row == 2:
                break
            row = 2
            target = h
    moments[0] = m0
    moments[1] = m1
    moments[2] = m2
    moments[3] = m3
    moments[4] = mu
    return n


@inlined
def _keep(
    knots: Any,
    n: int,
    states: Any,
    curves: Any,
    h: float,
    t: float,
    m0: float,
    m1: float,
    m2: float,
    m3: float,
    x: float,
    y: float,
    vx: float,
    vy: float,
    ax: float,
    ay: float,
    mu: float,
) -> None:
    u = t / h
    turned, spin = _turn(curves, states[0, 5], h, u, m0, m1, m2, m3)
    knots[n, 0] = t
    knots[n, 1] = x
    knots[n, 2] = y
    knots[n, 3] = states[0, 2] + turned
    knots[n, 4] = vx
    knots[n, 5] = vy
    knots[n, 6] = spin
    knots[n, 7] = ax
    knots[n, 8] = ay
    knots[n, 9] = mu * _parabola(curves, 2, u) + _parabola(curves, 5, u)


@inlined
def _at_most(value: float, most: float) -> float:
    return min(max(value, -most), most)


@inlined
def _go_on(law: Law, work: Work, ratio: float) -> None:
    """Predict P and Q of a stride from those of the one before; ratio is of their lengths."""
    last, velocity, curves = work.last_curves, work.last_velocity, work.curves
    tx, ty = work.towards[0], work.towards[1]
    b0 = velocity[0, 0] * tx + velocity[0, 1] * ty
    b1 = velocity[1, 0] * tx + velocity[1, 1] * ty
    b2 = velocity[2, 0] * tx + velocity[2, 1] * ty
    # How P and Q followed the speed late in the stride before; nearer to rest they do so the more.
    slowing = b1 + 1.5 * b2
    then = b0 + 0.75 * (b1 + 0.75 * b2)
    u = 1.0 + 0.5 * ratio
    now = b0 + u * (b1 + u * b2)
    gain = 0.0
    s0 = max(b0 + b1 + b2, SLOWEST)
    if law.patterned and slowing < -STEADY * then:
        gain = min(max(then / max(now, SLOWEST), 1.0), 2.0) / slowing
    for k in range(6):
        c0, c1, c2 = last[0, k], last[1, k], last[2, k]
        follow = 0.0
        if k < 2:
            follow = _at_most(gain * (c1 + 1.5 * c2), math.fabs(c0 + c1 + c2) / s0)
        curves[0, k] = c0 + c1 + c2 - follow * (b0 + b1 + b2)
        curves[1, k] = ratio * (c1 + 2.0 * c2 - follow * (b1 + 2.0 * b2))
        curves[2, k] = ratio * ratio * (c2 - follow * b2)
        curves[3, k] = follow


@inlined
def _follow_speed(work: Work, s0: float, s1: float, s2: float) -> None:
    """Let P and Q of a stride that has none before it follow the speed, as its ends say."""
    curves = work.curves
    if s2 - s0 > -STEADY * s0:
        return
    for k in range(2):
        follow = (curves[1, k] + curves[2, k]) / (s2 - s0)
        follow = _at_most(follow, math.fabs(curves[0, k]) / s0)
        curves[0, k] -= follow * s0
        curves[1, k] -= follow * (4.0 * s1 - s2 - 3.0 * s0)
        curves[2, k] -= follow * 2.0 * (s2 - 2.0 * s1 + s0)
        curves[3, k] = follow


@inlined
def remember(work: Work) -> None:
    """Keep the parabolas through P, Q and the velocity, for the stride that goes on from here."""
    states, parts = work.states, work.parts
    for k in range(6):
        work.last_curves[0, k] = parts[0, k]
        work.last_curves[1, k] = 4.0 * parts[1, k] - parts[2, k] - 3.0 * parts[0, k]
        work.last_curves[2, k] = 2.0 * (parts[2, k] - 2.0 * parts[1, k] + parts[0, k])
    for c in range(2):
        v0, v1, v2 = states[0, c + 3], states[1, c + 3], states[2, c + 3]
        work.last_velocity[0, c] = v0
        work.last_velocity[1, c] = 4.0 * v1 - v2 - 3.0 * v0
        work.last_velocity[2, c] = 2.0 * (v2 - 2.0 * v1 + v0)


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
    towards = work.towards
    vx, vy = states[0, 3], states[0, 4]
    s0 = math.sqrt(vx * vx + vy * vy)
    towards[0] = vx / max(s0, SLOWEST)
    towards[1] = vy / max(s0, SLOWEST)
    fresh = ratio <= 0.0
    if not fresh:
        _go_on(law, work, ratio)
        for k in range(6):
            parts[0, k] = curves[0, k] + s0 * curves[3, k]
    first_node = 0 if fresh else 1
    first = 0.0
    last = 0.0
    for attempt in range(PASSES):
        for node in range(first_node, 3):
            if node == 1:
                march(law, curves, towards, h, states, moments, work.knots[:0])
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
                    curves[3, k] = 0.0
        first_node = 1
        s1 = states[1, 3] * towards[0] + states[1, 4] * towards[1]
        s2 = states[2, 3] * towards[0] + states[2, 4] * towards[1]
        m1, m2, m3 = moments[1], moments[2], moments[3]
        last = 0.0
        for k in range(3):
            # The parabolas through the new P and Q at middle and end, less those marched with.
            p1 = parts[1, k] - _curve(curves, k, 0.5, s1)
            p2 = parts[2, k] - _curve(curves, k, 1.0, s2)
            q1 = parts[1, k + 3] - _parabola(curves, k + 3, 0.5)
            q2 = parts[2, k + 3] - _parabola(curves, k + 3, 1.0)
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
            if fresh and law.patterned:
                _follow_speed(work, s0, s1, s2)
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
