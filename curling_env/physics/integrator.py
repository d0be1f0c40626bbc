"""Path of one stone, step by step, until something ends it.

A draw takes about twenty steps (see `take_step`). A step ends where an effect is not smooth, at the
edge of a patch or when a sweep begins or ends. Near a bound or an obstacle its path is followed
from node to node. The last few mm/s are one parabola.
"""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.law import MIN_SPEED, Law, mu_of_map
from curling_env.physics.map_path import follow_map
from curling_env.physics.motion import GRAVITY, SWEPT
from curling_env.physics.state import Node, State
from curling_env.physics.step import Workspace, store_curves, take_step
from curling_env.physics.surroundings import (
    ALL,
    Limits,
    first_touch,
    is_stuck,
    look_around,
    may_leave,
    nearby,
    room,
)
from curling_env.physics.tuning import (
    EDGE_MARGIN,
    MAX_NODES,
    MAX_STEP,
    MAX_STEPS,
    MIN_STEP,
    REPEAT_ABOVE,
    SECOND_STEP,
    SHORTEN_ABOVE,
    TRACK_STEP,
)


class ThrowTimes(NamedTuple):
    """Times of a throw in addition to its state.

    Parameters
    ----------
    clock : session time of the release [s]
    sweep_start, sweep_end : interval in which the delivered stone is swept, after release [s]
    """

    clock: float
    sweep_start: float
    sweep_end: float


class SlideEnd(IntEnum):
    """End of a slide; a stone that slides longer than the time limit never stops."""

    REST = 0
    LEFT_BOUNDS = 1
    CONTACT = 2
    NEVER_STOPS = 3


REST, LEFT_BOUNDS, CONTACT, NEVER_STOPS = map(int, SlideEnd)
"""The same as numbers: Python has to look up every enum that a kernel returns."""


@inlined
def _ahead(breaks: Any, position: float, velocity: float) -> float:
    """Return the distance to the next break in the direction of motion, infinite if none [m]."""
    nearest = np.inf
    for k in range(breaks.shape[0]):
        distance = breaks[k] - position if velocity > 0.0 else position - breaks[k]
        if 0.0 <= distance < nearest:
            nearest = distance
    return nearest


@inlined
def _crosses(breaks: Any, axis: int, states: Any, h: float) -> bool:
    """Return whether a step crosses a break, even there and back."""
    if breaks.shape[0] == 0:
        return False
    low = min(states[0, axis], min(states[1, axis], states[2, axis]))
    high = max(states[0, axis], max(states[1, axis], states[2, axis]))
    for half in range(2):
        before = states[half, State.VX + axis]
        after = states[half + 1, State.VX + axis]
        if before * after < 0.0:
            turn = states[half, axis] + 0.25 * h * before * before / (before - after)
            low = min(low, turn)
            high = max(high, turn)
    crossed = False
    for k in range(breaks.shape[0]):
        crossed = crossed or low < breaks[k] < high
    return crossed


@inlined
def _time_short_of(distance: float, velocity: float, acceleration: float) -> float:
    """Return the time to come close to the edge of an effect; 0 at it, infinite if it is not
    reached [s].

    The further away, the less certain the time: therefore well short of it at first, then closer.
    """
    speed = math.fabs(velocity)
    if distance == np.inf or speed == 0.0:
        return np.inf
    if distance < EDGE_MARGIN:
        return 0.0
    distance = 0.97 * distance if distance > 1e-3 else distance - 0.5 * EDGE_MARGIN
    root = speed * speed + 2.0 * (acceleration if velocity > 0.0 else -acceleration) * distance
    return 2.0 * distance / (speed + math.sqrt(root)) if root > 0.0 else np.inf


@inlined
def _way_to_rest(speed: float, rate: float, tail: float) -> float:
    """Return distance over speed [s], along a parabola that begins at this rate and rests at
    `tail`.
    """
    return tail * (2.0 / 3.0 - rate * tail / (6.0 * max(speed, MIN_SPEED)))


@inlined
def _come_to_rest(now: Any, speed: float, rim: float, rate: float, turn: float) -> float:
    """Bring centre and band to rest together; return the time that it takes [s].

    Parameters
    ----------
    speed, rim : speeds of the centre and of the band [m/s]
    rate, turn : their accelerations [m/s²]
    """
    both = max(math.sqrt(speed * speed + rim * rim), MIN_SPEED)
    tail = both / max((speed * rate + rim * turn) / both, 1e-6)
    way = _way_to_rest(speed, rate, tail)
    now[State.X] += way * now[State.VX]
    now[State.Y] += way * now[State.VY]
    now[State.THETA] += _way_to_rest(rim, turn, tail) * now[State.OMEGA]
    now[State.VX] = now[State.VY] = now[State.OMEGA] = 0.0
    return tail


@inlined
def _hop_over_edge(now: Any, ax: float, ay: float, at: float, x_ahead: float) -> float:
    """Move a stone across the edge of an effect; return the time that it takes [s]."""
    vx, vy, spin = now[State.VX], now[State.VY], now[State.OMEGA]
    across = math.fabs(vx if x_ahead < EDGE_MARGIN else vy)
    hop = 2.0 * EDGE_MARGIN / max(across, 1e-3)
    now[State.X] += hop * (vx + 0.5 * hop * ax)
    now[State.Y] += hop * (vy + 0.5 * hop * ay)
    now[State.THETA] += hop * (spin + 0.5 * hop * at)
    now[State.VX] += hop * ax
    now[State.VY] += hop * ay
    now[State.OMEGA] += hop * at
    return hop


@inlined
def _acceleration_between(a: Any, b: Any, tau: float) -> Any:
    """Return the acceleration a time tau after node a, before node b: along x, along y and of the
    spin.
    """
    u = tau / (b[Node.T] - a[Node.T])
    return (
        a[Node.AX] + u * (b[Node.AX] - a[Node.AX]),
        a[Node.AY] + u * (b[Node.AY] - a[Node.AY]),
        a[Node.ALPHA] + u * (b[Node.ALPHA] - a[Node.ALPHA]),
    )


@inlined
def append_node(path: Any, m: int, nodes: Any, k: int, t: float) -> int:
    """Copy a node of the step that began at t to the path; return the new length of the path."""
    node = nodes[k]
    acceleration = (node[Node.AX], node[Node.AY], node[Node.ALPHA])
    return append_state(path, m, node[Node.X :], t + node[Node.T], acceleration)


@inlined
def append_state(path: Any, m: int, state: Any, t: float, acceleration: Any) -> int:
    """Add a state to the path; return the new length of the path."""
    if path.shape[0] == 0:
        return 0
    if m < path.shape[0]:
        path[m, Node.T] = t
        for c in range(6):
            path[m, Node.X + c] = state[c]
        path[m, Node.AX], path[m, Node.AY], path[m, Node.ALPHA] = acceleration
    return m + 1


@compiled
def integrate(
    law: Law,
    motion: Any,
    delivery: ThrowTimes,
    limits: Limits,
    path: Any,
    start: float,
    work: Workspace,
) -> Any:
    """Slide a stone on from the state in work.states[2], which becomes the final one.

    Parameters
    ----------
    law : the ice
    motion : (MOTION_SIZE,) with ORDER and STONE set
    delivery : clock and sweep
    limits : limits that end the slide before the stone rests
    path : (m, NODE_SIZE) filled in with the nodes of the path, at times since release; m = 0 for
        none
    start : time since release at which the stone is in that state [s]
    work : work arrays

    Returns
    -------
    end : number of a `SlideEnd`
    t : time of the end [s]
    length : number of nodes of the path; more than m if they did not fit
    """
    states, terms, control = work.states, work.terms, work.control
    x_breaks, y_breaks = law.x_breaks, law.y_breaks
    now = states[2]
    t = start
    length = 0
    if is_stuck(now, limits):
        gap, contact, _ = look_around(now, limits, ALL, 1.0)
        if gap < 0.0:
            return (CONTACT if contact else LEFT_BOUNDS), t, length
    watched = path.shape[0] > 0
    traced = work.nodes if watched else work.nodes[:0]
    motion[SWEPT] = 1.0 if delivery.sweep_start <= t < delivery.sweep_end else 0.0
    fresh = True
    share = control.first_share
    before = 1.0
    end = NEVER_STOPS
    for _ in range(MAX_STEPS):
        vx, vy = now[State.VX], now[State.VY]
        speed = math.sqrt(vx * vx + vy * vy)
        rim = law.band_radius * math.fabs(now[State.OMEGA])
        ax = ay = at = 0.0
        mu = work.moments[4]
        if fresh:
            # P and Q are not known yet: the map's friction alone gives the scale of time.
            rate = GRAVITY * mu_of_map(law, now[State.X], now[State.Y])
            turn = rate
        else:
            ax = mu * terms[2, 0] + terms[2, 3]
            ay = mu * terms[2, 1] + terms[2, 4]
            at = mu * terms[2, 2] + terms[2, 5]
            rate = math.sqrt(ax * ax + ay * ay)
            turn = law.band_radius * math.fabs(at)
        if max(speed, rim) < control.rest_speed:
            if length == 0:
                length = append_state(path, length, now, t, (ax, ay, at))
            t += _come_to_rest(now, speed, rim, rate, turn)
            length = append_state(path, length, now, t, (0.0, 0.0, 0.0))
            # The last millimetres to rest are not checked.
            end = REST if room(now, limits.bounds) >= 0.0 else LEFT_BOUNDS
            break
        if t >= limits.until:
            break
        time_left = max(speed, rim) / max(rate, turn, 1e-6)
        h = min(share * time_left, MAX_STEP)
        if law.patterned:
            h = min(h, MAX_NODES / 8.0 * law.cell / max(speed, 1e-6))
        if law.wear != 0.0:
            h = min(h, TRACK_STEP / max(speed, 1e-6))
        if x_breaks.shape[0] > 0 or y_breaks.shape[0] > 0:
            x_ahead = _ahead(x_breaks, now[State.X], vx)
            y_ahead = _ahead(y_breaks, now[State.Y], vy)
            until = min(_time_short_of(x_ahead, vx, ax), _time_short_of(y_ahead, vy, ay))
            if until == 0.0:
                t += _hop_over_edge(now, ax, ay, at, x_ahead)
                motion[SWEPT] = 1.0 if delivery.sweep_start <= t < delivery.sweep_end else 0.0
                fresh = True
                share = control.first_share
                continue
            h = min(h, until)
        switch = np.inf
        if t < delivery.sweep_start:
            switch = delivery.sweep_start
        elif t < delivery.sweep_end:
            switch = delivery.sweep_end
        h = min(h, switch - t)
        for k in range(6):
            states[0, k] = now[k]
        ratio = 0.0 if fresh else h / before
        target = control.target_error + control.relative_error * speed * time_left
        accepted = REPEAT_ABOVE * target
        times = (t, delivery.clock, h)
        first, last, n = take_step(law, motion, work, times, ratio, time_left, accepted, traced)
        shorter = 1.0
        if _crosses(x_breaks, 0, states, h) or _crosses(y_breaks, 1, states, h):
            shorter = 0.5
        elif last > accepted or (first > SHORTEN_ABOVE * target and not fresh):
            shorter = 0.3 if fresh else max(0.3, 0.8 * math.sqrt(math.sqrt(target / first)))
        if shorter < 1.0 and h > MIN_STEP:
            for k in range(6):
                now[k] = states[0, k]
                terms[2, k] = terms[0, k]
            work.moments[4] = mu
            share = shorter * h / time_left
            continue
        bulge = rate * h * h / 16.0 + 2e-3
        near = nearby(states, bulge, limits)
        watch = near != 0 or may_leave(states, bulge, limits.bounds)
        if watch or watched:
            nodes = work.nodes
            if watch:  # and so the end of a slide does not depend on who samples it
                for k in range(6):
                    work.retraced[0, k] = states[0, k]
                n = follow_map(
                    law, work.curves, work.direction, h, work.retraced, work.probe, nodes
                )
            at_node, tau, contact = -1, 0.0, False
            if watch:
                at_node, tau, contact = first_touch(nodes, n, work.probe, limits, near)
            for k in range(n if at_node < 0 else at_node + 1):
                if k > 0 or fresh:
                    length = append_node(path, length, nodes, k, t)
            if at_node >= 0:
                for k in range(6):
                    now[k] = work.probe[k]
                t += nodes[at_node, Node.T] + tau
                if tau > 0.0:
                    there = _acceleration_between(nodes[at_node], nodes[at_node + 1], tau)
                    length = append_state(path, length, now, t, there)
                end = CONTACT if contact else LEFT_BOUNDS
                break
        # The error of a prediction grows with the fourth power of the step.
        factor = SECOND_STEP if fresh else math.sqrt(math.sqrt(target / max(first, 1e-2 * target)))
        share = min(control.longest_share, h / time_left * min(max(factor, 0.3), 2.5))
        store_curves(work)
        before = h
        fresh = False
        if h == switch - t:
            t = switch
            motion[SWEPT] = 1.0 if delivery.sweep_start <= t < delivery.sweep_end else 0.0
            fresh = True
            share = control.first_share
        else:
            t += h
    return end, t, length
