"""Step of a sliding stone: a second or so of motion that still follows every cell of the map.

The law is acceleration = μ(x, y)·P + Q. P and Q, which take exponentials and logarithms, change
smoothly along a path; μ, which takes four table entries, may change in every cell. A step
therefore describes P and Q by parabolas in time through its beginning, middle and end, and follows
the map from line to line with them. The parabolas of the step before, extrapolated, predict; the
law at the predicted middle and end corrects (collocation at the Lobatto points, order four). The
size of the correction sets the length of the next step.
"""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import inlined
from curling_env.physics.law import MIN_SPEED, Law, law_terms
from curling_env.physics.map_path import curve_at, follow_map, parabola_at
from curling_env.physics.motion import CLOCK, HEADING, PUSH_SIZE, T
from curling_env.physics.state import NODE_SIZE, Node, State
from curling_env.physics.tuning import (
    LENGTH_PER_RADIAN,
    MAX_NODES,
    MAX_PASSES,
    MIN_SPEED_LOSS,
    QUICK_TOLERANCE,
    StepControl,
    step_control,
)
from curling_env.typing import Floats


class Workspace(NamedTuple):
    """Work arrays of one sliding stone, and the fineness of its steps.

    Parameters
    ----------
    control : limits on the length of steps
    push : (PUSH_SIZE,) the effects' output
    states : (3, 6) at the beginning, middle and end of a step
    retraced : (3, 6) the same for following the map a second time
    terms : (3, 6) P and Q there
    curves : (4, 6) P and Q as parabolas of the fraction of the step, and the further change of P
        with the speed, which a rough map makes uneven
    changes : (3, 4) changes of the parabolas by the last pass: u and u² of P, then of Q
    last_curves : (3, 6) parabolas through P and Q of the step before
    last_velocity : (3, 2) parabola through the velocity of the step before
    direction : (2,) direction of travel at the beginning of a step, a unit vector
    moments : (5,) ∫ μ·u^k dt for k = 0 to 3, where u is the fraction of the step, and μ at the end
    nodes : (MAX_NODES, NODE_SIZE) nodes of the path within a step
    probe : (6,) a state between nodes
    """

    control: StepControl
    push: Floats
    states: Floats
    retraced: Floats
    terms: Floats
    curves: Floats
    changes: Floats
    last_curves: Floats
    last_velocity: Floats
    direction: Floats
    moments: Floats
    nodes: Floats
    probe: Floats


def new_workspace(tolerance: float = QUICK_TOLERANCE) -> Workspace:
    """Allocate the arrays for one thread that slides stones within a tolerance [m]."""
    return Workspace(
        control=step_control(tolerance),
        push=np.zeros(PUSH_SIZE),
        states=np.zeros((3, 6)),
        retraced=np.zeros((3, 6)),
        terms=np.zeros((3, 6)),
        curves=np.zeros((4, 6)),
        changes=np.zeros((3, 4)),
        last_curves=np.zeros((3, 6)),
        last_velocity=np.zeros((3, 2)),
        direction=np.zeros(2),
        moments=np.zeros(5),
        nodes=np.zeros((MAX_NODES, NODE_SIZE)),
        probe=np.zeros(6),
    )


@inlined
def _parabola(begin: float, middle: float, end: float) -> Any:
    """Return coefficients of the parabola through values at the fractions 0, 1/2 and 1 of a
    step.
    """
    return begin, 4.0 * middle - end - 3.0 * begin, 2.0 * (end - 2.0 * middle + begin)


@inlined
def _at_most(value: float, most: float) -> float:
    return min(max(value, -most), most)


@inlined
def _predict(work: Workspace, ratio: float, patterned: bool) -> None:
    """Predict P and Q of a step from those of the one before; ratio is of their lengths."""
    last, velocity, curves = work.last_curves, work.last_velocity, work.curves
    tx, ty = work.direction[0], work.direction[1]
    b0 = velocity[0, 0] * tx + velocity[0, 1] * ty
    b1 = velocity[1, 0] * tx + velocity[1, 1] * ty
    b2 = velocity[2, 0] * tx + velocity[2, 1] * ty
    # Dependence of P and Q on the speed late in the step before; it grows as the stone slows.
    speed_rate = b1 + 1.5 * b2
    then = b0 + 0.75 * (b1 + 0.75 * b2)
    u = 1.0 + 0.5 * ratio
    now = b0 + u * (b1 + u * b2)
    gain = 0.0
    s0 = max(b0 + b1 + b2, MIN_SPEED)
    if patterned and speed_rate < -MIN_SPEED_LOSS * then:
        gain = min(max(then / max(now, MIN_SPEED), 1.0), 2.0) / speed_rate
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
    """Let P of a first step follow the speed as at its beginning and end."""
    curves = work.curves
    if s2 - s0 > -MIN_SPEED_LOSS * s0:
        return
    v0, v1, v2 = _parabola(s0, s1, s2)
    for k in range(2):
        follow = (curves[1, k] + curves[2, k]) / (s2 - s0)
        follow = _at_most(follow, math.fabs(curves[0, k]) / s0)
        curves[0, k] -= follow * v0
        curves[1, k] -= follow * v1
        curves[2, k] -= follow * v2
        curves[3, k] = follow


@inlined
def store_curves(work: Workspace) -> None:
    """Store the parabolas through P, Q and the velocity for the next step."""
    states, terms = work.states, work.terms
    curves, velocity = work.last_curves, work.last_velocity
    for k in range(6):
        found = _parabola(terms[0, k], terms[1, k], terms[2, k])
        curves[0, k], curves[1, k], curves[2, k] = found
    for c in range(2):
        v = State.VX + c
        found = _parabola(states[0, v], states[1, v], states[2, v])
        velocity[0, c], velocity[1, c], velocity[2, c] = found


@inlined
def take_step(
    law: Law,
    motion: Any,
    work: Workspace,
    times: Any,
    ratio: float,
    time_left: float,
    accepted: float,
    nodes: Any,
) -> Any:
    """Advance by one step: states[2] becomes the state then, terms and curves those of the step.

    Parameters
    ----------
    law : the ice
    motion : (MOTION_SIZE,) with ORDER, STONE and SWEPT set
    work : states[0] is the state at t; if ratio > 0, last_curves are those of the step before
    times : time t since release, session time of the release, length h of the step [s]
    ratio : h over the length of the step before; 0 for a first step
    time_left : approximate time until the stone rests [s]
    accepted : correction that needs no further pass [m]
    nodes : (n, NODE_SIZE) filled in with the path within the step; n = 0 for none

    Returns
    -------
    first : error of the prediction, as a place of rest [m]
    last : correction by the last pass [m]
    count : number of nodes
    """
    t, clock, h = times
    states, terms, curves, moments = work.states, work.terms, work.curves, work.moments
    direction, changes = work.direction, work.changes
    vx, vy = states[0, State.VX], states[0, State.VY]
    s0 = math.sqrt(vx * vx + vy * vy)
    direction[0] = vx / max(s0, MIN_SPEED)
    direction[1] = vy / max(s0, MIN_SPEED)
    fresh = ratio <= 0.0
    if not fresh:
        _predict(work, ratio, law.patterned)
        for k in range(6):
            terms[0, k] = curves[0, k] + s0 * curves[3, k]
    first_node = 0 if fresh else 1
    first = last = 0.0
    count = 0
    for attempt in range(MAX_PASSES):
        for node in range(first_node, 3):
            if node == 1:
                count = follow_map(law, curves, direction, h, states, moments, nodes)
            s = states[node]
            motion[T] = t + 0.5 * node * h
            motion[CLOCK] = clock + motion[T]
            motion[HEADING] = s[State.THETA]
            x, y, vx, vy = s[State.X], s[State.Y], s[State.VX], s[State.VY]
            law_terms(law, motion, work.push, x, y, vx, vy, s[State.OMEGA], terms[node])
            if node == 0:
                for k in range(6):
                    curves[0, k] = terms[0, k]
                    curves[1, k] = curves[2, k] = curves[3, k] = 0.0
        first_node = 1
        s1 = states[1, State.VX] * direction[0] + states[1, State.VY] * direction[1]
        s2 = states[2, State.VX] * direction[0] + states[2, State.VY] * direction[1]
        m1, m2, m3 = moments[1], moments[2], moments[3]
        last = 0.0
        for k in range(3):
            # The parabolas through the new P and Q at middle and end, minus those used before.
            p1 = terms[1, k] - curve_at(curves, k, 0.5, s1)
            p2 = terms[2, k] - curve_at(curves, k, 1.0, s2)
            q1 = terms[1, k + 3] - parabola_at(curves, k + 3, 0.5)
            q2 = terms[2, k + 3] - parabola_at(curves, k + 3, 1.0)
            p_u, p_uu = 4.0 * p1 - p2, 2.0 * p2 - 4.0 * p1
            q_u, q_uu = 4.0 * q1 - q2, 2.0 * q2 - 4.0 * q1
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
            changes[k, 0], changes[k, 1], changes[k, 2], changes[k, 3] = p_u, p_uu, q_u, q_uu
            off = math.fabs(place) + 0.5 * time_left * math.fabs(rate)
            last = max(last, off if k < 2 else LENGTH_PER_RADIAN * off)
        if attempt == 0:
            first = last
            if fresh and law.patterned:
                _follow_speed(work, s0, s1, s2)
        if last <= accepted:
            break
    if count > 0:
        _correct_nodes(work, nodes, count, h)
    return first, last, count


@inlined
def _correct_nodes(work: Workspace, nodes: Any, n: int, h: float) -> None:
    """Add the correction of a step's last pass to its nodes, as if on uniform friction.

    The correction is so small that the variation of the friction within a step does not matter.
    """
    mu = work.moments[0] / h
    for i in range(1, n):
        t = nodes[i, Node.T]
        u = t / h
        for k in range(3):
            linear = mu * work.changes[k, 0] + work.changes[k, 2]
            square = mu * work.changes[k, 1] + work.changes[k, 3]
            position = Node.THETA if k == 2 else Node.X + k
            velocity = Node.OMEGA if k == 2 else Node.VX + k
            acceleration = Node.ALPHA if k == 2 else Node.AX + k
            nodes[i, position] += t * t * u * (linear / 6.0 + square * u / 12.0)
            nodes[i, velocity] += t * u * (linear / 2.0 + square * u / 3.0)
            nodes[i, acceleration] += u * (linear + square * u)
    for c in range(6):
        nodes[n - 1, Node.X + c] = work.states[2, c]
