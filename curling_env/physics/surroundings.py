"""Obstacles of a sliding stone: bounds and resting stones, and the time until it reaches them."""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import inlined
from curling_env.physics.contacts import collides
from curling_env.physics.map_path import between_nodes, place_between_nodes
from curling_env.physics.state import Node, State
from curling_env.physics.tuning import ACCELERATION_MARGIN, CONTACT_GAP, CREEP_TIME, MAX_TIME
from curling_env.typing import Floats

NO_BOUNDS = np.array([-np.inf, np.inf, -np.inf, np.inf])
"""Bounds of a slide that ends only at rest. Copy them before changing one."""
NO_OBSTACLES = np.empty((0, 2))
"""Obstacles of a slide on an empty sheet."""
_FAR = 1e3
"""Distance beyond any slide, instead of a bound [m]."""
_LAST_BIT = 62
"""Bit that represents all obstacles from this one on."""
ALL = -1
"""Mask of all obstacles."""


class Limits(NamedTuple):
    """Limits of a slide, which end it before the stone rests.

    Parameters
    ----------
    bounds : (4,) x_min, x_max, y_min, y_max of the centre [m]
    obstacles : (k, 2) centres of resting stones [m]
    reach : distance between two centres in contact [m]
    until : maximum time since release [s]
    """

    bounds: Floats
    obstacles: Floats
    reach: float
    until: float = MAX_TIME


@inlined
def room(s: Any, bounds: Any) -> float:
    """Return the distance of a state from its nearest bound [m]; negative outside."""
    x, y = s[State.X], s[State.Y]
    return min(min(x - bounds[0], bounds[1] - x), min(y - bounds[2], bounds[3] - y))


@inlined
def max_acceleration(nodes: Any, n: int) -> float:
    """Return a bound of the acceleration on a path of n nodes [m/s²]."""
    most = 0.0
    for k in range(n):
        ax, ay = nodes[k, Node.AX], nodes[k, Node.AY]
        most = max(most, ax * ax + ay * ay)
    return ACCELERATION_MARGIN * math.sqrt(most) + 1e-3


@inlined
def free_time(gap: float, closing: float, most: float) -> float:
    """Return the minimum time until a gap closes, at a speed and an acceleration of up to `most`
    [s].

    The distance of a moving centre from a point bends towards it no more than the centre's path.
    """
    root = math.sqrt(closing * closing + 2.0 * most * gap)
    return 2.0 * gap / (closing + root) if closing > 0.0 else (root - closing) / most


@inlined
def look_around(s: Any, limits: Limits, near: int, most: float) -> Any:
    """Find the next obstacle of a stone.

    Parameters
    ----------
    s : its state
    limits : bounds and obstacles
    near : candidate obstacles, see `nearby`
    most : its maximum acceleration [m/s²]

    Returns
    -------
    gap : distance to the nearest bound or obstacle that it approaches [m]. For an obstacle that it
        touches and creeps towards, the distance before the next check
    contact : true if that is an obstacle
    free : time in which it certainly reaches nothing [s]
    """
    gap = room(s, limits.bounds)
    contact = False
    obstacles = limits.obstacles
    x, y, vx, vy = s[State.X], s[State.Y], s[State.VX], s[State.VY]
    free = free_time(min(max(gap, 0.0), _FAR), math.sqrt(vx * vx + vy * vy), most)
    for k in range(obstacles.shape[0]):
        if (near >> min(k, _LAST_BIT)) & 1 == 0:
            continue
        dx = x - obstacles[k, 0]
        dy = y - obstacles[k, 1]
        distance = math.sqrt(dx * dx + dy * dy)
        closing = -(dx * vx + dy * vy) / max(distance, 1e-9)
        ahead = distance - limits.reach
        if ahead >= CONTACT_GAP:
            free = min(free, free_time(ahead, closing, most))
            touches = True
        else:
            free = min(free, max(free_time(0.0, closing, most), CREEP_TIME))
            touches = collides(ahead, closing)
            if not touches:
                ahead = max(CREEP_TIME * (math.fabs(vx) + math.fabs(vy)), 2.0 * CONTACT_GAP)
        if closing > 0.0 and ahead < gap:
            gap = ahead
            contact = touches
    return gap, contact, free


@inlined
def is_stuck(s: Any, limits: Limits) -> bool:
    """Return whether a stone is beyond a bound or within reach of an obstacle."""
    stuck = room(s, limits.bounds) < 0.0
    obstacles = limits.obstacles
    for k in range(obstacles.shape[0]):
        dx, dy = s[State.X] - obstacles[k, 0], s[State.Y] - obstacles[k, 1]
        stuck = stuck or dx * dx + dy * dy < limits.reach * limits.reach
    return stuck


@inlined
def _square_from(x: float, y: float, a: Any, b: Any) -> float:
    """Return the square of the distance of a point from the straight line between two states
    [m²].
    """
    ax, ay = x - a[State.X], y - a[State.Y]
    bx, by = b[State.X] - a[State.X], b[State.Y] - a[State.Y]
    along = ax * bx + ay * by
    length = bx * bx + by * by
    part = 0.0 if along <= 0.0 else min(along / max(length, 1e-18), 1.0)
    dx, dy = ax - part * bx, ay - part * by
    return dx * dx + dy * dy


@inlined
def nearby(states: Any, bulge: float, limits: Limits) -> int:
    """Return the obstacles that a step may come within reach of: bit k for obstacle k.

    Its path is within `bulge` of the straight lines between beginning, middle and end.
    """
    far = limits.reach + bulge
    x0, x1, x2 = states[0, State.X], states[1, State.X], states[2, State.X]
    y0, y1, y2 = states[0, State.Y], states[1, State.Y], states[2, State.Y]
    left, right = min(min(x0, x1), x2) - far, max(max(x0, x1), x2) + far
    low, high = min(min(y0, y1), y2) - far, max(max(y0, y1), y2) + far
    near = 0
    obstacles = limits.obstacles
    for k in range(obstacles.shape[0]):
        x, y = obstacles[k, 0], obstacles[k, 1]
        if not (low < y < high and left < x < right):
            continue
        first = _square_from(x, y, states[0], states[1])
        if min(first, _square_from(x, y, states[1], states[2])) < far * far:
            near |= 1 << min(k, _LAST_BIT)
    return near


@inlined
def may_leave(states: Any, bulge: float, bounds: Any) -> bool:
    """Return whether a step may cross a bound; `bulge` as in `nearby`."""
    return room(states[1], bounds) < bulge or room(states[2], bounds) < bulge


@inlined
def first_touch(nodes: Any, n: int, probe: Any, limits: Limits, near: int) -> Any:
    """Find where the path of a step first crosses a bound or comes within reach of an obstacle.

    From each place the stone moves on only for a time in which it certainly touches nothing, so
    that even the slightest contact is found.

    Returns
    -------
    node, tau : a time tau after that node, or -1 if nothing is touched; the state is in probe
    contact : true if it is an obstacle
    """
    most = max_acceleration(nodes, n)
    t = nodes[0, Node.T]
    for k in range(n - 1):
        while t < nodes[k + 1, Node.T]:
            tau = max(t - nodes[k, Node.T], 0.0)
            place_between_nodes(nodes, k, tau, probe)
            gap, contact, free = look_around(probe, limits, near, most)
            if gap < CONTACT_GAP:
                between_nodes(nodes, k, tau, probe)
                return k, tau, contact
            fastest = math.fabs(probe[State.VX]) + math.fabs(probe[State.VY])
            t += max(free, CONTACT_GAP / max(fastest, 1e-6))
    return -1, 0.0, False
