"""One step of a sliding stone: a second or so of motion that still follows every cell of the map.

The law is acceleration = μ(x, y)·P + Q. P and Q, which take exponentials and logarithms, change
smoothly along a path; μ, which takes four table entries, may change in every cell. A step
therefore describes P and Q by parabolas in time through its beginning, middle and end, and follows
the map from line to line with them. The parabolas of the step before, extrapolated, predict; the
law at the predicted middle and end corrects (collocation at the Lobatto points, order four). The
size of the correction tells how long the next step may be.
"""

# Work arrays come untyped through compiled code: what is read from them is unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.effects.motion import CLOCK, HEADING, PUSH_SIZE, T
from curling_env.physics.law import MIN_SPEED, Law, law_terms, patch_of
from curling_env.physics.one_stone.tuning import (
    LENGTH_PER_RADIAN,
    MAX_NODES,
    MAX_PASSES,
    MIN_SPEED_LOSS,
    QUICK_TOLERANCE,
    StepControl,
    step_control,
)
from curling_env.physics.state import NODE_SIZE, Node, State
from curling_env.typing import Floats


class Workspace(NamedTuple):
    """The arrays in which one stone slides, and how fine its steps are.

    Parameters
    ----------
    control : how long steps may be
    push : (PUSH_SIZE,) the effects' output
    states : (3, 6) at the beginning, middle and end of a step
    retraced : (3, 6) the same for following the map a second time
    terms : (3, 6) P and Q there
    curves : (4, 6) P and Q as parabolas of the fraction of the step, and how much more P changes
        with the speed, which a rough map makes uneven
    last_curves : (3, 6) parabolas through P and Q of the step before
    last_velocity : (3, 2) parabola through the velocity of the step before
    direction : (2,) of travel at the beginning of a step, a unit vector
    moments : (5,) ∫ μ·u^k dt for k = 0 to 3, where u is the fraction of the step, and μ at the end
    nodes : (MAX_NODES, NODE_SIZE) of the path within a step
    probe : (6,) a state between nodes
    """

    control: StepControl
    push: Floats
    states: Floats
    retraced: Floats
    terms: Floats
    curves: Floats
    last_curves: Floats
    last_velocity: Floats
    direction: Floats
    moments: Floats
    nodes: Floats
    probe: Floats


def new_workspace(tolerance: float = QUICK_TOLERANCE) -> Workspace:
    """The arrays for one thread that slides stones within a tolerance [m]."""
    return Workspace(
        control=step_control(tolerance),
        push=np.zeros(PUSH_SIZE),
        states=np.zeros((3, 6)),
        retraced=np.zeros((3, 6)),
        terms=np.zeros((3, 6)),
        curves=np.zeros((4, 6)),
        last_curves=np.zeros((3, 6)),
        last_velocity=np.zeros((3, 2)),
        direction=np.zeros(2),
        moments=np.zeros(5),
        nodes=np.zeros((MAX_NODES, NODE_SIZE)),
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
    """P along x or y at the fraction u of a step, at a speed."""
    return curves[0, k] + u * (curves[1, k] + u * curves[2, k]) + speed * curves[3, k]


@inlined
def _parabola(curves: Any, k: int, u: float) -> float:
    """The spin's P, or Q, at the fraction u of a step."""
    return curves[0, k] + u * (curves[1, k] + u * curves[2, k])


@inlined
def _turn(curves: Any, spin: float, h: float, u: float, moments: Any) -> Any:
    """How far a stone has turned up to the fraction u of a step, and its spin then.

    The spin does not steer the stone, so both follow from the moments ∫ μ·u^k dt up to there.
    """
    m0, m1, m2, m3 = moments
    c0, c1, c2 = curves[0, 2], curves[1, 2], curves[2, 2]
    q0, q1, q2 = curves[0, 5], curves[1, 5], curves[2, 5]
    gain = c0 * m0 + c1 * m1 + c2 * m2
    lag = c0 * m1 + c1 * m2 + c2 * m3
    rise = h * u * (q0 + u * (q1 / 2.0 + u * (q2 / 3.0)))
    way = h * h * u * u * (q0 / 2.0 + u * (q1 / 6.0 + u * (q2 / 12.0)))
    return h * (u * (spin + gain) - lag) + way, spin + gain + rise


@compiled
def follow_map(
    law: Law, curves: Any, direction: Any, h: float, states: Any, moments: Any, nodes: Any
) -> int:
    """Follow P and Q through the map for a time h, line by line.

    Within a patch of the map μ along the path is smooth, so each piece is one Simpson step.

    Parameters
    ----------
    law : the ice
    curves, direction : (4, 6) and (2,), as in `Workspace`
    h : length of the step [s]
    states : (3, 6) the first row is given; the middle and the end are filled in
    moments : (5,) filled in, as in `Workspace`
    nodes : (n, NODE_SIZE) filled in; n = 0 for none

    Returns
    -------
    number of nodes
    """
    x: Any = states[0, State.X]
    y: Any = states[0, State.Y]
    vx: Any = states[0, State.VX]
    vy: Any = states[0, State.VY]
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
    tx = direction[0]
    ty = direction[1]
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
    n = 0
    if nodes.shape[0] > 0:
        now = (x, y, vx, vy, ax, ay)
        _write_node(nodes, 0, states, curves, (h, 0.0), (m0, m1, m2, m3), now, mu)
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
            # The speed halfway was guessed from the beginning alone. Now that the end is known as
            # well, the error of that guess, times how P follows the speed, is corrected.
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
            if not law.bilinear and n < nodes.shape[0]:  # μ jumps: a node on each side
                now = (x, y, vx, vy, ax, ay)
                _write_node(nodes, n, states, curves, (h, begun), (m0, m1, m2, m3), now, mu)
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
        if n < nodes.shape[0]:
            now = (x, y, vx, vy, ax, ay)
            _write_node(nodes, n, states, curves, (h, begun), (m0, m1, m2, m3), now, mu)
            n += 1
        if line == 0:
            moved = (m0, m1, m2, m3)
            turned, spin = _turn(curves, states[0, State.OMEGA], h, begun * per_h, moved)
            states[row, State.X] = x
            states[row, State.Y] = y
            states[row, State.VX] = vx
            states[row, State.VY] = vy
            states[row, State.THETA] = states[0, State.THETA] + turned
            states[row, State.OMEGA] = spin
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
def _write_node(
    nodes: Any, n: int, states: Any, curves: Any, times: Any, moments: Any, now: Any, mu: float
) -> None:
    """Fill in node n.

    Parameters
    ----------
    times : length of the step and time since its beginning [s]
    moments : four numbers, ∫ μ·u^k dt up to now
    now : x, y, vx, vy, ax, ay
    """
    h, t = times
    x, y, vx, vy, ax, ay = now
    u = t / h
    turned, spin = _turn(curves, states[0, State.OMEGA], h, u, moments)
    nodes[n, Node.T] = t
    nodes[n, Node.X] = x
    nodes[n, Node.Y] = y
    nodes[n, Node.VX] = vx
    nodes[n, Node.VY] = vy
    nodes[n, Node.THETA] = states[0, State.THETA] + turned
    nodes[n, Node.OMEGA] = spin
    nodes[n, Node.AX] = ax
    nodes[n, Node.AY] = ay
    nodes[n, Node.ALPHA] = mu * _parabola(curves, 2, u) + _parabola(curves, 5, u)


@inlined
def _at_most(value: float, most: float) -> float:
    return min(max(value, -most), most)


@inlined
def _predict(law: Law, work: Workspace, ratio: float) -> None:
    """Predict P and Q of a step from those of the one before; ratio is of their lengths."""
    last, velocity, curves = work.last_curves, work.last_velocity, work.curves
    tx, ty = work.direction[0], work.direction[1]
    b0 = velocity[0, 0] * tx + velocity[0, 1] * ty
    b1 = velocity[1, 0] * tx + velocity[1, 1] * ty
    b2 = velocity[2, 0] * tx + velocity[2, 1] * ty
    # How P and Q followed the speed late in the step before; they do so more as the stone slows.
    slowing = b1 + 1.5 * b2
    then = b0 + 0.75 * (b1 + 0.75 * b2)
    u = 1.0 + 0.5 * ratio
    now = b0 + u * (b1 + u * b2)
    gain = 0.0
    s0 = max(b0 + b1 + b2, MIN_SPEED)
    if law.patterned and slowing < -MIN_SPEED_LOSS * then:
        gain = min(max(then / max(now, MIN_SPEED), 1.0), 2.0) / slowing
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
def _follow_speed(work: Workspace, s0: float, s1: float, s2: float) -> None:
    """Let P of a step that has none before it follow the speed as its beginning and end show."""
    curves = work.curves
    if s2 - s0 > -MIN_SPEED_LOSS * s0:
        return
    for k in range(2):
        follow = (curves[1, k] + curves[2, k]) / (s2 - s0)
        follow = _at_most(follow, math.fabs(curves[0, k]) / s0)
        curves[0, k] -= follow * s0
        curves[1, k] -= follow * (4.0 * s1 - s2 - 3.0 * s0)
        curves[2, k] -= follow * 2.0 * (s2 - 2.0 * s1 + s0)
        curves[3, k] = follow


@inlined
def store_curves(work: Workspace) -> None:
    """Keep the parabolas through P, Q and the velocity for the step that follows."""
    states, terms = work.states, work.terms
    for k in range(6):
        work.last_curves[0, k] = terms[0, k]
        work.last_curves[1, k] = 4.0 * terms[1, k] - terms[2, k] - 3.0 * terms[0, k]
        work.last_curves[2, k] = 2.0 * (terms[2, k] - 2.0 * terms[1, k] + terms[0, k])
    for c in range(2):
        v0, v1, v2 = states[0, State.VX + c], states[1, State.VX + c], states[2, State.VX + c]
        work.last_velocity[0, c] = v0
        work.last_velocity[1, c] = 4.0 * v1 - v2 - 3.0 * v0
        work.last_velocity[2, c] = 2.0 * (v2 - 2.0 * v1 + v0)


@inlined
def take_step(
    law: Law,
    motion: Any,
    work: Workspace,
    times: Any,
    ratio: float,
    time_left: float,
    accepted: float,
) -> Any:
    """Advance by one step: states[2] becomes the state then, terms and curves those of the step.

    Parameters
    ----------
    law : the ice
    motion : (MOTION_SIZE,) with ORDER, STONE and SWEPT set
    work : states[0] is the state at t; if ratio > 0, last_curves are those of the step before
    times : time t since release, session time of the release, length h of the step [s]
    ratio : h over the length of the step before; 0 if there is none to go on from
    time_left : about how long the stone will go on [s]
    accepted : correction small enough to need no further pass [m]

    Returns
    -------
    first : error of the prediction, as a place of rest [m]
    last : correction by the last pass [m]
    """
    t, clock, h = times
    states, terms, curves, moments = work.states, work.terms, work.curves, work.moments
    direction = work.direction
    vx, vy = states[0, State.VX], states[0, State.VY]
    s0 = math.sqrt(vx * vx + vy * vy)
    direction[0] = vx / max(s0, MIN_SPEED)
    direction[1] = vy / max(s0, MIN_SPEED)
    fresh = ratio <= 0.0
    if not fresh:
        _predict(law, work, ratio)
        for k in range(6):
            terms[0, k] = curves[0, k] + s0 * curves[3, k]
    first_node = 0 if fresh else 1
    first = 0.0
    last = 0.0
    for attempt in range(MAX_PASSES):
        for node in range(first_node, 3):
            if node == 1:
                follow_map(law, curves, direction, h, states, moments, work.nodes[:0])
            s = states[node]
            motion[T] = t + 0.5 * node * h
            motion[CLOCK] = clock + motion[T]
            motion[HEADING] = s[State.THETA]
            x, y, vx, vy = s[State.X], s[State.Y], s[State.VX], s[State.VY]
            law_terms(law, motion, work.push, x, y, vx, vy, s[State.OMEGA], terms[node])
            if node == 0:
                for k in range(6):
                    curves[0, k] = terms[0, k]
                    curves[1, k] = 0.0
                    curves[2, k] = 0.0
                    curves[3, k] = 0.0
        first_node = 1
        s1 = states[1, State.VX] * direction[0] + states[1, State.VY] * direction[1]
        s2 = states[2, State.VX] * direction[0] + states[2, State.VY] * direction[1]
        m1, m2, m3 = moments[1], moments[2], moments[3]
        last = 0.0
        for k in range(3):
            # The parabolas through the new P and Q at middle and end, less those used so far.
            p1 = terms[1, k] - _curve(curves, k, 0.5, s1)
            p2 = terms[2, k] - _curve(curves, k, 1.0, s2)
            q1 = terms[1, k + 3] - _parabola(curves, k + 3, 0.5)
            q2 = terms[2, k + 3] - _parabola(curves, k + 3, 1.0)
            p_u = 4.0 * p1 - p2
            p_uu = 2.0 * p2 - 4.0 * p1
            q_u = 4.0 * q1 - q2
            q_uu = 2.0 * q2 - 4.0 * q1
            place = h * (p_u * (m1 - m2) + p_uu * (m2 - m3) + h * (q_u / 6.0 + q_uu / 12.0))
            rate = p_u * m1 + p_uu * m2 + h * (q_u / 2.0 + q_uu / 3.0)
            position = State.THETA if k == 2 else k
            velocity = State.OMEGA if k == 2 else State.VX + k
            states[2, position] += place
            states[2, velocity] += rate
            curves[1, k] += p_u
            curves[2, k] += p_uu
            curves[1, k + 3] += q_u
            curves[2, k + 3] += q_uu
            off = math.fabs(place) + 0.5 * time_left * math.fabs(rate)
            last = max(last, off if k < 2 else LENGTH_PER_RADIAN * off)
        if attempt == 0:
            first = last
            if fresh and law.patterned:
                _follow_speed(work, s0, s1, s2)
        if last <= accepted:
            break
    return first, last


@inlined
def quintic(begin: Any, end: Any, h: float, u: float) -> Any:
    """Position and velocity at the fraction u of an interval of length h.

    Parameters
    ----------
    begin, end : position, velocity and acceleration at both ends
    """
    p0, v0, a0 = begin
    p1, v1, a1 = end
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
def between_nodes(nodes: Any, k: int, tau: float, out: Any) -> None:
    """State (6,) a time tau after node k, before node k + 1."""
    a, b = nodes[k], nodes[k + 1]
    h = b[Node.T] - a[Node.T]
    u = tau / h
    out[State.X], out[State.VX] = quintic(
        (a[Node.X], a[Node.VX], a[Node.AX]), (b[Node.X], b[Node.VX], b[Node.AX]), h, u
    )
    out[State.Y], out[State.VY] = quintic(
        (a[Node.Y], a[Node.VY], a[Node.AY]), (b[Node.Y], b[Node.VY], b[Node.AY]), h, u
    )
    out[State.THETA], out[State.OMEGA] = quintic(
        (a[Node.THETA], a[Node.OMEGA], a[Node.ALPHA]),
        (b[Node.THETA], b[Node.OMEGA], b[Node.ALPHA]),
        h,
        u,
    )
