"""Path of a stone through the cells of the map, while P and Q of the law are given curves.

See `step` for these curves. The nodes of the path hold its state and acceleration; between nodes
the path is a quintic.
"""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any

import numpy as np

from curling_env.physics.compiled import compiled, inlined, part
from curling_env.physics.law import Law, mu_in, patch_of
from curling_env.physics.state import Node, State


@inlined
def _time_to(distance: float, velocity: float, gain: float, within: float) -> float:
    """Return the time to cover a distance at speed `velocity` changing at `gain`; infinite if not
    `within`.
    """
    if velocity * within + 0.5 * max(gain, 0.0) * within * within < distance:
        return np.inf
    root = velocity * velocity + 2.0 * gain * distance
    if root <= 0.0:
        return np.inf
    return 2.0 * distance / (velocity + math.sqrt(root))


@inlined
def curve_at(curves: Any, k: int, u: float, speed: float) -> float:
    """Return P along x or y at the fraction u of a step, at a speed."""
    return curves[0, k] + u * (curves[1, k] + u * curves[2, k]) + speed * curves[3, k]


@inlined
def parabola_at(curves: Any, k: int, u: float) -> float:
    """Return the spin's P, or Q, at the fraction u of a step."""
    return curves[0, k] + u * (curves[1, k] + u * curves[2, k])


@inlined
def _turn(curves: Any, spin: float, h: float, u: float, moments: Any) -> Any:
    """Return the angle of rotation up to the fraction u of a step, and the spin then.

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


@inlined
def _follow_even_ice(
    mu: float, curves: Any, h: float, states: Any, moments: Any, nodes: Any
) -> int:
    """Run `follow_map` on uniform friction: a polynomial in time.

    P does not depend on the speed.
    """
    traced = nodes.shape[0] > 0
    for row in range(0 if traced else 1, 3):
        u = 0.5 * row
        t = u * h
        there = states[row]
        for axis in range(2):
            a0 = mu * curves[0, axis] + curves[0, 3 + axis]
            a1 = mu * curves[1, axis] + curves[1, 3 + axis]
            a2 = mu * curves[2, axis] + curves[2, 3 + axis]
            x, v = states[0, State.X + axis], states[0, State.VX + axis]
            there[State.X + axis] = x + t * (v + t * (a0 / 2.0 + u * (a1 / 6.0 + u * (a2 / 12.0))))
            there[State.VX + axis] = v + t * (a0 + u * (a1 / 2.0 + u * (a2 / 3.0)))
            if traced:
                nodes[row, Node.AX + axis] = a0 + u * (a1 + u * a2)
        now = (mu * t, mu * t * u / 2.0, mu * t * u * u / 3.0, mu * t * u * u * u / 4.0)
        turned, spin = _turn(curves, states[0, State.OMEGA], h, u, now)
        there[State.THETA] = states[0, State.THETA] + turned
        there[State.OMEGA] = spin
        if traced:
            nodes[row, Node.T] = t
            for k in range(6):
                nodes[row, Node.X + k] = there[k]
            nodes[row, Node.ALPHA] = mu * parabola_at(curves, 2, u) + parabola_at(curves, 5, u)
    for k in range(4):
        moments[k] = mu * h / (k + 1.0)
    moments[4] = mu
    return 3 if traced else 0


@part
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
    if not law.patterned:
        return _follow_even_ice(law.mu[0, 0], curves, h, states, moments, nodes)
    x, y, vx, vy = states[0, State.X], states[0, State.Y], states[0, State.VX], states[0, State.VY]
    cell: Any = law.cell
    per_cell = 1.0 / cell
    per_h = 1.0 / h
    i = math.floor((y - law.origin_y) * per_cell)
    j = math.floor((x - law.origin_x) * per_cell)
    low_y: Any = law.origin_y + i * cell
    low_x: Any = law.origin_x + j * cell
    patch = patch_of(law, i, j)
    mu: Any = mu_in(patch, (y - low_y) * per_cell, (x - low_x) * per_cell)
    tx, ty = direction[0], direction[1]
    speed: Any = vx * tx + vy * ty
    px = curves[0, 0] + speed * curves[3, 0]
    py = curves[0, 1] + speed * curves[3, 1]
    ax: Any = mu * px + curves[0, 3]
    ay: Any = mu * py + curves[0, 4]
    m0 = m1 = m2 = m3 = begun = 0.0
    target = 0.5 * h
    row = 1
    n = 0
    if nodes.shape[0] > 0:
        now = (x, y, vx, vy, ax, ay)
        _write_node(nodes, 0, states, curves, (h, 0.0), (m0, m1, m2, m3), now, mu)
        n = 1
    while True:
        dt = target - begun
        line = 0
        step_i = step_j = 0
        # The next line ahead on each axis; one already passed is used immediately.
        if vy != 0.0:
            step_i = 1 if vy > 0.0 else -1
            ahead = low_y + cell - y if vy > 0.0 else y - low_y
            until = 0.0 if ahead <= 0.0 else _time_to(ahead, math.fabs(vy), ay * step_i, dt)
            if until < dt:
                dt, line = until, 1
        if vx != 0.0:
            step_j = 1 if vx > 0.0 else -1
            ahead = low_x + cell - x if vx > 0.0 else x - low_x
            until = 0.0 if ahead <= 0.0 else _time_to(ahead, math.fabs(vx), ax * step_j, dt)
            if until < dt:
                dt, line = until, 2
        if dt > 0.0:
            half = 0.5 * dt
            sixth = dt / 6.0
            mid_x = x + half * (vx + 0.5 * half * ax)
            mid_y = y + half * (vy + 0.5 * half * ay)
            end_x = x + dt * (vx + half * ax)
            end_y = y + dt * (vy + half * ay)
            mu_mid = mu_in(patch, (mid_y - low_y) * per_cell, (mid_x - low_x) * per_cell)
            mu_end = mu_in(patch, (end_y - low_y) * per_cell, (end_x - low_x) * per_cell)
            f0 = begun * per_h
            f = (begun + half) * per_h
            speed = (vx + half * ax) * tx + (vy + half * ay) * ty
            mid_ax = mu_mid * curve_at(curves, 0, f, speed) + parabola_at(curves, 3, f)
            mid_ay = mu_mid * curve_at(curves, 1, f, speed) + parabola_at(curves, 4, f)
            begun = begun + dt if line != 0 else target
            f1 = begun * per_h
            speed = (vx + dt * mid_ax) * tx + (vy + dt * mid_ay) * ty
            px = curve_at(curves, 0, f1, speed)
            py = curve_at(curves, 1, f1, speed)
            end_ax = mu_end * px + parabola_at(curves, 3, f1)
            end_ay = mu_end * py + parabola_at(curves, 4, f1)
            # The speed halfway was guessed from the beginning alone. Now that the end is known as
            # well, the error of that guess, times the derivative of P by the speed, is corrected.
            along_x = 8.0 * mid_ax - 7.0 * ax - end_ax
            along_y = 8.0 * mid_ay - 7.0 * ay - end_ay
            late = sixth * sixth * mu_mid * (along_x * tx + along_y * ty)
            late_x = late * curves[3, 0]
            late_y = late * curves[3, 1]
            x += dt * (vx + sixth * (ax + 2.0 * mid_ax) + 0.5 * late_x)
            y += dt * (vy + sixth * (ay + 2.0 * mid_ay) + 0.5 * late_y)
            vx += sixth * (ax + 4.0 * mid_ax + end_ax) + late_x
            vy += sixth * (ay + 4.0 * mid_ay + end_ay) + late_y
            w0, w, w1 = sixth * mu, 4.0 * sixth * mu_mid, sixth * mu_end
            m0 += w0 + w + w1
            w0, w, w1 = w0 * f0, w * f, w1 * f1
            m1 += w0 + w + w1
            w0, w, w1 = w0 * f0, w * f, w1 * f1
            m2 += w0 + w + w1
            m3 += w0 * f0 + w * f + w1 * f1
            mu, ax, ay = mu_end, end_ax, end_ay
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
            patch = patch_of(law, i, j)
            if not law.bilinear:
                ax += (patch[0] - mu) * px
                ay += (patch[0] - mu) * py
                mu = patch[0]
        if n < nodes.shape[0]:
            now = (x, y, vx, vy, ax, ay)
            _write_node(nodes, n, states, curves, (h, begun), (m0, m1, m2, m3), now, mu)
            n += 1
        if line == 0:
            moved = (m0, m1, m2, m3)
            turned, spin = _turn(curves, states[0, State.OMEGA], h, begun * per_h, moved)
            states[row, State.X], states[row, State.Y] = x, y
            states[row, State.VX], states[row, State.VY] = vx, vy
            states[row, State.THETA] = states[0, State.THETA] + turned
            states[row, State.OMEGA] = spin
            if row == 2:
                break
            row = 2
            target = h
    moments[0], moments[1], moments[2], moments[3], moments[4] = m0, m1, m2, m3, mu
    return n


@inlined
def _write_node(
    nodes: Any, n: int, states: Any, curves: Any, times: Any, moments: Any, now: Any, mu: float
) -> None:
    """Fill in node n; `moments` are ∫ μ·u^k dt up to now, k = 0 to 3."""
    h, t = times
    u = t / h
    turned, spin = _turn(curves, states[0, State.OMEGA], h, u, moments)
    node = nodes[n]
    node[Node.T] = t
    node[Node.X], node[Node.Y], node[Node.VX], node[Node.VY], node[Node.AX], node[Node.AY] = now
    node[Node.THETA], node[Node.OMEGA] = states[0, State.THETA] + turned, spin
    node[Node.ALPHA] = mu * parabola_at(curves, 2, u) + parabola_at(curves, 5, u)


@inlined
def _quintic(begin: Any, end: Any, places: Any, tau: float) -> Any:
    """Return position and velocity a time tau after the first of two nodes.

    Parameters
    ----------
    begin, end : the nodes
    places : places of position, velocity and acceleration in a node
    """
    x, v, a = places
    p0, v0, a0 = begin[x], begin[v], begin[a]
    p1, v1, a1 = end[x], end[v], end[a]
    h = end[Node.T] - begin[Node.T]
    u = tau / h
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
def place_between_nodes(nodes: Any, k: int, tau: float, out: Any) -> None:
    """Return position and velocity of a state (6,) a time tau after node k, before node k + 1."""
    a, b = nodes[k], nodes[k + 1]
    out[State.X], out[State.VX] = _quintic(a, b, (Node.X, Node.VX, Node.AX), tau)
    out[State.Y], out[State.VY] = _quintic(a, b, (Node.Y, Node.VY, Node.AY), tau)


@inlined
def between_nodes(nodes: Any, k: int, tau: float, out: Any) -> None:
    """Return the state (6,) a time tau after node k, before node k + 1."""
    place_between_nodes(nodes, k, tau, out)
    places = (Node.THETA, Node.OMEGA, Node.ALPHA)
    out[State.THETA], out[State.OMEGA] = _quintic(nodes[k], nodes[k + 1], places, tau)


@compiled
def sample_path(
    path: Any, length: int, dt: float, first: int, until: float, probe: Any, rows: Any
) -> int:
    """Fill in x, y and heading of a path at the times k·dt, from k = first up to a time.

    Parameters
    ----------
    path : (m, NODE_SIZE), of which `length` nodes are given
    until : last time [s]; beyond its end the path stays at its last position
    probe : (6,) work array
    rows : (samples, 3) filled in

    Returns
    -------
    the number k of the first sample after `until`
    """
    node = 0
    k = first
    while k < rows.shape[0] and k * dt <= until:
        t = k * dt
        while node < length - 2 and path[node + 1, Node.T] <= t:
            node += 1
        if t < path[length - 1, Node.T]:
            between_nodes(path, node, max(t - path[node, Node.T], 0.0), probe)
            rows[k, 0], rows[k, 1] = probe[State.X], probe[State.Y]
            rows[k, 2] = probe[State.THETA]
        else:
            rows[k, 0], rows[k, 1] = path[length - 1, Node.X], path[length - 1, Node.Y]
            rows[k, 2] = path[length - 1, Node.THETA]
        k += 1
    return k
