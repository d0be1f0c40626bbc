"""Whole slides on even ice from a table.

On ice without a map, where every effect follows the speed and the spin alone, what becomes of a
stone depends on nothing else, wherever it is and whichever way it goes. Speed and spin then run
along one of a family of curves, each of which is a slide: the table holds these slides, by the spin
that they have at the greatest speed. Where a stone is on its curve tells the rest of its way, which
is turned and moved to where it goes on: a dozen places of the path, each a cubic in speed and spin,
in place of some twenty steps of which each waits for the one before.
"""

# Work arrays come untyped through compiled code: what is read from them is unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from curling_env.physics.compiled import compiled, inlined, part
from curling_env.physics.law import Law, accelerate
from curling_env.physics.motion import MOTION_SIZE, PUSH_SIZE
from curling_env.physics.one_stone.integrate import (
    CONTACT,
    LEFT_BOUNDS,
    REST,
    Delivery,
    Sampling,
    append_node,
    append_state,
    integrate,
)
from curling_env.physics.one_stone.step import Workspace
from curling_env.physics.one_stone.surroundings import (
    ALL,
    Limits,
    first_touch,
    look_around,
    may_leave,
    nearby,
    room,
)
from curling_env.physics.state import Node, State
from curling_env.typing import Floats

SLOWEST, FASTEST = 0.02, 4.5
"""Speeds between which slides begin in the table, and which its rows cover [m/s]."""
ROWS = 96
"""Speeds of the table; their roots are evenly spaced."""
SPIN_OFFSET = 2.0**-6
"""Added to the spin at the greatest speed, whose logarithm is evenly spaced [rad/s]."""
PER_OCTAVE, OCTAVES = 4, 9
SLIDES = PER_OCTAVE * OCTAVES + 1
"""Slides of the table for each sign of the spin; the fastest begins with 8 rad/s."""
_OMEGA, _HX, _HY, _X, _Y, _THETA, _T, _ALONG, _LEFT, _ALPHA = range(10)
COLUMNS = 10
"""Spin, direction of travel, place, heading, time, acceleration along the travel and to its left,
and of the spin. The last row of a slide holds its rest."""
_LOW, _HIGH = math.sqrt(SLOWEST), math.sqrt(FASTEST)
_BETWEEN = (_HIGH - _LOW) / (ROWS - 1)
_STEPS_A_ROW = 2
_LAST_STEPS = 60
"""Steps of the last way, from the slowest row to the `_AT_REST`."""
_AT_REST = 1e-4
"""Speed at which a slide of the table ends; it would go 0.1 µm more [m/s]."""
LEAST_SPIN, SPINS_ABOVE = 0.01, 0.15
"""Spin that a slide must still have at this speed [rad/s, m/s]. A stone that stops to turn before
it rests does so at one moment, across which nothing is interpolated; in its last decimetre or two
that does not count."""
_SPIN_ROW = round((math.sqrt(SPINS_ABOVE) - _LOW) / _BETWEEN)
_LEAST_BRAKE = 1e-3
"""A deceleration below which slides are not tabled [m/s²]."""
_MOST_BACK = 0.02
"""Spin to the other side above which slides are not tabled: they would not be told apart by their
spin [rad/s]."""
FIRST_PIECES, PIECES_PER_SPEED, PIECES_EXPONENT = 5, 4.0, 1.4
"""Pieces of a path: some, and so many more for each m/s; the speeds at their ends fall as a power
of what is left of them."""


def slide_spins() -> Floats:
    """Spins (2, SLIDES) at the greatest speed: the positive ones, then the negative ones."""
    spins = SPIN_OFFSET * 2.0 ** (np.arange(SLIDES) / PER_OCTAVE) - SPIN_OFFSET
    return np.stack([spins, -spins])


@inlined
def _rates(law: Law, work: Any, u: float, y: Any, out: Any) -> float:
    """Derivatives of (spin, direction, x, y, heading, time) by the root of the speed.

    Returns the deceleration; fills in the three accelerations behind the six derivatives.
    """
    motion, push, terms = work
    v = u * u
    ax, ay, turn = accelerate(law, motion, push, terms, 0.0, 0.0, 0.0, v, y[0])
    per = 2.0 * u / ay
    out[0] = turn * per
    out[1] = -ax / v * per
    out[2] = -v * math.sin(y[1]) * per
    out[3] = v * math.cos(y[1]) * per
    out[4] = y[0] * per
    out[5] = per
    out[6] = ay
    out[7] = -ax
    out[8] = turn
    return -ay


@compiled
def _fill(law: Law, spins: Any, work: Any, k: Any, y: Any, table: Any) -> bool:
    """Fill in the table (2, SLIDES, ROWS + 1, COLUMNS); whether every slide can be tabled.

    Parameters
    ----------
    spins : (2, SLIDES) at the greatest speed
    work : motion, push and terms
    k, y : (5, 9) and (2, 6) work arrays
    """
    for sign in range(2):
        for s in range(SLIDES):
            y[0, 0] = spins[sign, s]
            for q in range(1, 6):
                y[0, q] = 0.0
            u = _HIGH
            for row in range(ROWS - 1, -2, -1):
                steps = _STEPS_A_ROW if row >= 0 else _LAST_STEPS
                width = -_BETWEEN if row >= 0 else math.sqrt(_AT_REST) - _LOW
                if row < ROWS - 1:
                    h = width / steps
                    for _ in range(steps):
                        for stage in range(4):
                            part_of = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
                            for q in range(6):
                                y[1, q] = y[0, q] + (
                                    h * part_of * k[stage - 1, q] if stage else 0.0
                                )
                            if _rates(law, work, u + h * part_of, y[1], k[stage]) < _LEAST_BRAKE:
                                return False
                        for q in range(6):
                            whole = k[0, q] + 2.0 * (k[1, q] + k[2, q]) + k[3, q]
                            y[0, q] += h / 6.0 * whole
                        u += h
                turns_back = (y[0, 0] if sign == 0 else -y[0, 0]) < -_MOST_BACK
                if turns_back or _rates(law, work, u, y[0], k[4]) < _LEAST_BRAKE:
                    return False
                out = table[sign, s, row if row >= 0 else ROWS]
                out[_OMEGA] = y[0, 0]
                out[_HX], out[_HY] = -math.sin(y[0, 1]), math.cos(y[0, 1])
                for q in range(4):
                    out[_X + q] = y[0, 2 + q]
                for q in range(3):
                    out[_ALONG + q] = k[4, 6 + q]
    return True


def slide_table(law: Law) -> Floats | None:
    """The table (2, SLIDES, ROWS + 1, COLUMNS) of a law; None where slides depend on more.

    Making it takes as long as some hundred throws among stones. It is kept, as laws come again.
    """
    follows_more = law.patterned or law.tabled < len(law.kernels) or law.table.shape[0] == 0
    if follows_more or len(law.x_breaks) or len(law.y_breaks):
        return None
    numbers = float(law.mu[0, 0]), law.band_radius, law.turning
    arrays = law.kernels.tobytes(), law.offsets.tobytes(), law.theta.tobytes()
    return _made(_Content((*numbers, *arrays), law))


@dataclass(frozen=True)
class _Content:
    """A law by what slides follow."""

    mark: tuple[Any, ...]
    law: Law = field(compare=False)


@lru_cache(maxsize=8)
def _made(content: _Content) -> Floats | None:
    table = np.zeros((2, SLIDES, ROWS + 1, COLUMNS))
    work = np.zeros(MOTION_SIZE), np.empty(PUSH_SIZE), np.empty(6)
    spins, k, y = slide_spins(), np.empty((5, 9)), np.empty((2, 6))
    return table if _fill(content.law, spins, work, k, y, table) else None


@inlined
def _weights(f: float) -> Any:
    """Lagrange's weights of the nodes at -1, 0, 1, 2."""
    a, b, c = f + 1.0, f - 1.0, f - 2.0
    return -f * b * c / 6.0, a * b * c / 2.0, -a * f * c / 2.0, a * f * b / 6.0


@inlined
def _at_row(slide: Any, i: int, w: Any, q: int) -> float:
    """A column of one slide between four rows from i on."""
    w0, w1, w2, w3 = w
    return (w0 * slide[i, q] + w1 * slide[i + 1, q]) + (w2 * slide[i + 2, q] + w3 * slide[i + 3, q])


@inlined
def _rows_at(v: float) -> Any:
    """First of the four rows about a speed, and their weights."""
    place = (math.sqrt(v) - _LOW) / _BETWEEN
    i = min(max(int(place), 1), ROWS - 3)
    return i - 1, _weights(place - i)


@inlined
def _find(half: Any, v: float, spin: float) -> Any:
    """First of the four slides about a speed and a spin, and their weights; -1 beyond the table.

    Slides do not cross: at one speed the spin rises from slide to slide.
    """
    i, w = _rows_at(v)
    low, high = 0, SLIDES - 1
    size = math.fabs(spin)
    if size > math.fabs(_at_row(half[high], i, w, _OMEGA)):
        return -1, w
    while high - low > 1:
        middle = (low + high) // 2
        if math.fabs(_at_row(half[middle], i, w, _OMEGA)) > size:
            high = middle
        else:
            low = middle
    j = min(max(low, 1), SLIDES - 3)
    if math.fabs(half[j - 1, _SPIN_ROW, _OMEGA]) < LEAST_SPIN:
        return -1, w
    s0 = math.fabs(_at_row(half[j - 1], i, w, _OMEGA))
    s1 = math.fabs(_at_row(half[j], i, w, _OMEGA))
    s2 = math.fabs(_at_row(half[j + 1], i, w, _OMEGA))
    s3 = math.fabs(_at_row(half[j + 2], i, w, _OMEGA))
    a = math.fabs(_at_row(half[low], i, w, _OMEGA))
    b = math.fabs(_at_row(half[low + 1], i, w, _OMEGA))
    f = low - j + (size - a) / max(b - a, 1e-12)
    for _ in range(3):
        w0, w1, w2, w3 = _weights(f)
        f -= (w0 * s0 + w1 * s1 + w2 * s2 + w3 * s3 - size) / max(b - a, 1e-12)
    return (j - 1 if -1.0 <= f <= 2.0 else -1), _weights(f)


@inlined
def _look(half: Any, j: int, by_slide: Any, i: int, by_row: Any, out: Any) -> None:
    """All columns between four slides and four rows."""
    c0, c1, c2, c3 = by_slide
    for q in range(COLUMNS):
        out[q] = (c0 * _at_row(half[j], i, by_row, q) + c1 * _at_row(half[j + 1], i, by_row, q)) + (
            c2 * _at_row(half[j + 2], i, by_row, q) + c3 * _at_row(half[j + 3], i, by_row, q)
        )


@part
def slide_from_table(
    table: Any,
    law: Law,
    motion: Any,
    delivery: Delivery,
    limits: Limits,
    sampling: Sampling,
    path: Any,
    start: float,
    work: Workspace,
) -> Any:
    """What `integrate` does, from the table where it covers the slide; there are no samples.

    Parameters
    ----------
    table : see `slide_table`
    law, motion, delivery, limits, sampling, path, start, work : as in `integrate`
    """
    nodes, now = work.nodes, work.states[2]
    vx, vy, spin = now[State.VX], now[State.VY], now[State.OMEGA]
    v = math.sqrt(vx * vx + vy * vy)
    j = -1
    half = table[0 if spin >= 0.0 else 1]
    by_slide = (0.0, 0.0, 0.0, 0.0)
    if SLOWEST < v < FASTEST:
        j, by_slide = _find(half, v, spin)
    if j < 0:
        return integrate(law, motion, delivery, limits, sampling, path, start, work)
    gap, contact, _ = look_around(now, limits, ALL, 1.0)
    if gap < 0.0:
        return (CONTACT if contact else LEFT_BOUNDS), start, 0, 0
    out = nodes[nodes.shape[0] - 1]  # no path is that long
    i, by_row = _rows_at(v)
    _look(half, j, by_slide, i, by_row, out)
    # The table's frame, turned by (c, s) and moved, is that in which the stone goes on.
    size = math.sqrt(out[_HX] * out[_HX] + out[_HY] * out[_HY]) * v
    c = (vx * out[_HX] + vy * out[_HY]) / size
    s = (vy * out[_HX] - vx * out[_HY]) / size
    x0 = now[State.X] - (c * out[_X] - s * out[_Y])
    y0 = now[State.Y] - (s * out[_X] + c * out[_Y])
    theta0 = now[State.THETA] - out[_THETA]
    t0 = start - out[_T]
    pieces = FIRST_PIECES + int(PIECES_PER_SPEED * v)
    for k in range(pieces + 1):
        u = v * (1.0 - k / pieces) ** PIECES_EXPONENT
        if k > 0 and k < pieces:
            i, by_row = _rows_at(max(u, SLOWEST))
            u = max(u, SLOWEST)
            _look(half, j, by_slide, i, by_row, out)
        elif k == pieces:
            c0, c1, c2, c3 = by_slide
            for q in range(COLUMNS):
                out[q] = (c0 * half[j, ROWS, q] + c1 * half[j + 1, ROWS, q]) + (
                    c2 * half[j + 2, ROWS, q] + c3 * half[j + 3, ROWS, q]
                )
        hx, hy = c * out[_HX] - s * out[_HY], s * out[_HX] + c * out[_HY]
        node = nodes[k]
        node[Node.T] = t0 + out[_T]
        node[Node.X] = x0 + c * out[_X] - s * out[_Y]
        node[Node.Y] = y0 + s * out[_X] + c * out[_Y]
        node[Node.VX] = u * hx
        node[Node.VY] = u * hy
        node[Node.THETA] = theta0 + out[_THETA]
        node[Node.OMEGA] = out[_OMEGA] if k < pieces else 0.0
        node[Node.AX] = out[_ALONG] * hx - out[_LEFT] * hy
        node[Node.AY] = out[_ALONG] * hy + out[_LEFT] * hx
        node[Node.ALPHA] = out[_ALPHA]
    return _follow(nodes, pieces + 1, limits, path, work)


@inlined
def _follow(nodes: Any, n: int, limits: Limits, path: Any, work: Workspace) -> Any:
    """Go along the n nodes of a whole slide until it ends; returns what `integrate` does."""
    states, now = work.states, work.states[2]
    length = append_node(path, 0, nodes, 0, 0.0)
    k = 0
    while k < n - 1:
        last = min(k + 2, n - 1)
        longest = 0.0
        rate = 0.0
        for m in range(3):
            node = nodes[min(k + m, last)]
            for q in range(6):
                states[m, q] = node[Node.X + q]
            rate = max(rate, math.fabs(node[Node.AX]) + math.fabs(node[Node.AY]))
        for m in range(k, last):
            longest = max(longest, nodes[m + 1, Node.T] - nodes[m, Node.T])
        bulge = 0.25 * rate * longest * longest + 2e-3
        near = nearby(states, bulge, limits)
        if near != 0 or may_leave(states, bulge, limits.bounds):
            at, tau, contact = first_touch(
                nodes[k : last + 1], last + 1 - k, work.probe, limits, near
            )
            if at >= 0:
                for m in range(k + 1, k + at + 1):
                    length = append_node(path, length, nodes, m, 0.0)
                for q in range(6):
                    now[q] = work.probe[q]
                a, b = nodes[k + at], nodes[k + at + 1]
                t = a[Node.T] + tau
                if tau > 0.0:
                    f = tau / (b[Node.T] - a[Node.T])
                    there = (
                        a[Node.AX] + f * (b[Node.AX] - a[Node.AX]),
                        a[Node.AY] + f * (b[Node.AY] - a[Node.AY]),
                        a[Node.ALPHA] + f * (b[Node.ALPHA] - a[Node.ALPHA]),
                    )
                    length = append_state(path, length, now, t, there)
                return (CONTACT if contact else LEFT_BOUNDS), t, 0, length
        for m in range(k + 1, last + 1):
            length = append_node(path, length, nodes, m, 0.0)
        k = last
    for q in range(6):
        now[q] = nodes[n - 1, Node.X + q]
    end = REST if room(now, limits.bounds) >= 0.0 else LEFT_BOUNDS
    return end, nodes[n - 1, Node.T], 0, length
