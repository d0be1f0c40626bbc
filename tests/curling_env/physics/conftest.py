"""References for the engines, with random ices and throws.

`slide_finely` integrates the public law plainly: fourth-order steps of a tenth of a millisecond,
each cut in two where it crosses a line of the map or the edge of an effect. It shares no steps,
parabolas or tails with the engines. Halving the step moves its rests by a few micrometres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import fabs, floor, sqrt
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from curling_env.ice import ActiveEffect, Ice, load_ice
from curling_env.physics import (
    CLOCK,
    HEADING,
    MOTION_SIZE,
    ORDER,
    PUSH_SIZE,
    STONE,
    SWEPT,
    Law,
    State,
    T,
    accelerate,
    compile_law,
)
from curling_env.physics.compiled import compiled
from curling_env.throw import Release, Throw

STEP = 1e-4
"""[s]"""
COARSE_STEP = 1e-3
"""The same where several stones move [s]; halved until two only just touch."""
AT_REST = 4e-5
"""Speed of centre and band that counts as rest [m/s]: half a millisecond and ten nanometres before
it.
"""


class Rest(NamedTuple):
    """Place and time of a stone's rest, and whether it is inside the bounds."""

    x: float
    y: float
    theta: float
    time: float
    rests: bool


@compiled
def _rates(
    law: Law, motion: Any, push: Any, parts: Any, clock: float, t: float, s: Any, d: Any
) -> None:
    motion[T] = t
    motion[CLOCK] = clock + t
    x, y, vx, vy, spin = s[State.X], s[State.Y], s[State.VX], s[State.VY], s[State.OMEGA]
    motion[HEADING] = s[State.THETA]
    d[State.X] = vx
    d[State.Y] = vy
    d[State.THETA] = spin
    ax, ay, turn = accelerate(law, motion, push, parts, x, y, vx, vy, spin)
    d[State.VX] = ax
    d[State.VY] = ay
    d[State.OMEGA] = turn


@compiled
def _step(
    law: Law,
    motion: Any,
    push: Any,
    parts: Any,
    clock: float,
    t: float,
    h: float,
    s: Any,
    work: Any,
    out: Any,
) -> None:
    """Classical Runge–Kutta from state s (6,) to out."""
    middle = work[4]
    for stage in range(4):
        ahead = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
        for k in range(6):
            middle[k] = s[k] if stage == 0 else s[k] + ahead * work[stage - 1, k]
        _rates(law, motion, push, parts, clock, t + ahead, middle, work[stage])
    for k in range(6):
        out[k] = s[k] + h / 6.0 * (work[0, k] + 2.0 * work[1, k] + 2.0 * work[2, k] + work[3, k])


@compiled
def _cut(law: Law, a: Any, b: Any) -> float:
    """Fraction of the step from a to b at which it crosses a line or an edge; 1 if none."""
    u = 1.0
    for axis in range(2):
        way = b[axis] - a[axis]
        if way == 0.0:
            continue
        origin = law.origin_x if axis == 0 else law.origin_y
        if law.patterned:
            i = floor((a[axis] - origin) / law.cell)
            for line in (i, i + 1):
                share = (origin + line * law.cell - a[axis]) / way
                if 1e-9 < share < u:
                    u = share
        breaks = law.x_breaks if axis == 0 else law.y_breaks
        for k in range(breaks.shape[0]):
            share = (breaks[k] - a[axis]) / way
            if 1e-9 < share < u:
                u = share
    return u


@compiled
def _slide(
    law: Law,
    motion: Any,
    push: Any,
    parts: Any,
    clock: float,
    sweep_start: float,
    sweep_end: float,
    bounds: Any,
    h: float,
    s: Any,
    work: Any,
) -> Any:
    t = 0.0
    after = work[5]
    for _ in range(int(200.0 / h)):
        step = h
        motion[SWEPT] = 1.0 if sweep_start <= t + 1e-12 < sweep_end else 0.0
        for switch in (sweep_start, sweep_end):
            if t + 1e-12 < switch < t + step:
                step = switch - t
        _step(law, motion, push, parts, clock, t, step, s, work, after)
        u = _cut(law, s, after)
        if u < 1.0:
            step *= u * (1.0 + 1e-7)
            _step(law, motion, push, parts, clock, t, step, s, work, after)
        speed = sqrt(s[State.VX] * s[State.VX] + s[State.VY] * s[State.VY])
        if speed < AT_REST and law.band_radius * fabs(s[State.OMEGA]) < AT_REST:
            return t, True
        for k in range(6):
            s[k] = after[k]
        if not (bounds[0] < s[0] < bounds[1] and bounds[2] < s[1] < bounds[3]):
            return t + step, False
        t += step
    return t, False


def _slide_finely(ice: Ice, release: Release, bounds: NDArray[np.float64]) -> Rest:
    """Return the place of rest of a lone stone, or its crossing of the bounds."""
    motion = np.zeros(MOTION_SIZE)
    motion[ORDER], motion[STONE] = release.order, release.stone
    state = np.array([release.x, release.y, release.vx, release.vy, release.theta, release.omega])
    time, rests = _slide(
        compile_law(ice),
        motion,
        np.zeros(PUSH_SIZE),
        np.zeros(6),
        release.clock,
        release.sweep_start,
        release.sweep_end,
        bounds,
        STEP,
        state,
        np.zeros((6, 6)),
    )
    place = state[[State.X, State.Y, State.THETA]].tolist()
    return Rest(*place, float(time), bool(rests))


@compiled
def _play(
    law: Law, motion: Any, push: Any, parts: Any, contact: Any, bounds: Any, stones: Any, work: Any
) -> bool:
    """Step stones (n, 6) until none moves or each has left; return whether this happened."""
    reach, restitution, friction, turning = contact
    n = stones.shape[0]
    after = work[6:]
    for _ in range(int(60.0 / COARSE_STEP)):
        low, step, touching = 0.0, COARSE_STEP, True
        for halving in range(40):
            touching = False
            for i in range(n):
                _step(law, motion, push, parts, 0.0, 0.0, step, stones[i], work, after[i])
                s = stones[i]
                still = s[2] * s[2] + s[3] * s[3] < 1e-8 and fabs(s[5]) < 1e-3
                if still or not (bounds[0] < s[0] < bounds[1] and bounds[2] < s[1] < bounds[3]):
                    for k in range(6):
                        after[i, k] = s[k] if k < 2 or k == 4 else 0.0
            for i in range(n):
                for j in range(i):
                    x, y = after[i, 0] - after[j, 0], after[i, 1] - after[j, 1]
                    closing = x * (after[i, 2] - after[j, 2]) + y * (after[i, 3] - after[j, 3])
                    touching |= x * x + y * y < reach * reach and closing < 0.0
            if not touching and halving == 0:
                break
            if touching:
                high = step
            else:
                low = step
            step = 0.5 * (low + high)
        moves = False
        for i in range(n):
            for k in range(6):
                stones[i, k] = after[i, k]
            moves |= stones[i, 2] != 0.0 or stones[i, 3] != 0.0
        if not moves:
            return True
        if step == COARSE_STEP:
            continue
        for i in range(n):
            for j in range(i):
                a, b = stones[j], stones[i]
                x, y = b[0] - a[0], b[1] - a[1]
                gap = sqrt(x * x + y * y)
                nx, ny = x / gap, y / gap
                normal = (a[2] - b[2]) * nx + (a[3] - b[3]) * ny
                if gap > reach + 1e-9 or normal <= 0.0:
                    continue
                slip = (a[3] - b[3]) * nx - (a[2] - b[2]) * ny + 0.5 * reach * (a[5] + b[5])
                jolt = 0.5 * (1.0 + restitution) * normal
                rub = slip / (2.0 + 0.5 * turning * reach * reach)
                rub = min(max(rub, -friction * jolt), friction * jolt)
                for stone, sign in ((a, -1.0), (b, 1.0)):
                    stone[2] += sign * (jolt * nx - rub * ny)
                    stone[3] += sign * (jolt * ny + rub * nx)
                    stone[5] -= 0.5 * turning * reach * rub
    return False


def _play_finely(
    ice: Ice, stones: NDArray[np.float64], release: Release, bounds: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Final places (k + 1, 2) of stones (k, 2) and the thrown one: small steps, single impulses."""
    states = np.zeros((len(stones) + 1, 6))
    states[:-1, :2] = stones
    states[-1] = [release.x, release.y, release.vx, release.vy, release.theta, release.omega]
    stone = ice.stone
    contact = (
        2 * stone.radius, stone.restitution, stone.stone_friction, stone.mass / stone.inertia,
    )  # fmt: skip
    work = np.zeros((6 + len(states), 6))
    law, motion = compile_law(ice), np.zeros(MOTION_SIZE)
    assert _play(law, motion, np.zeros(PUSH_SIZE), np.zeros(6), contact, bounds, states, work)
    return states[:, :2]


def _draw_ice(rng: np.random.Generator) -> Ice:
    """Standard ice made rough, with some effects on it."""
    ice = load_ice("standard")
    spread = rng.standard_normal(ice.friction.mu.shape)
    if rng.random() < 0.5:  # over 1 m rather than from cell to cell
        spread = gaussian_filter(spread, 1.0 / ice.sheet.cell_size / np.sqrt(2))
    mu = ice.friction.mu * np.exp(rng.uniform(0.03, 0.1) * spread / spread.std())
    interpolation = "bilinear" if rng.random() < 0.5 else "cell"
    ice = replace(ice, friction=replace(ice.friction, mu=mu, interpolation=interpolation))
    x, y = rng.uniform(-1, 1), rng.uniform(-5, 15)
    edge = 0.0 if rng.random() < 0.5 else 0.2
    patch = {"x_min": x - 0.7, "x_max": x + 0.7, "y_min": y - 2, "y_max": y + 2}
    for name, parameters in (
        ("slope", {"x": rng.uniform(-3e-4, 3e-4), "y": rng.uniform(-3e-4, 3e-4)}),
        ("friction_patch", {**patch, "factor": rng.uniform(0.8, 1.3), "edge": edge}),
        ("sweeping", {}),
        ("time_drift", {"rate": rng.uniform(-1e-4, 1e-4)}),
    ):
        if rng.random() < 0.4:
            ice = ice.with_effect(ActiveEffect(name=name, parameters=parameters))
    return ice


def _draw_release(rng: np.random.Generator, slowest: float = 0.6, fastest: float = 2.3) -> Release:
    throw = Throw(
        speed=rng.uniform(slowest, fastest),
        angle=rng.uniform(-0.03, 0.03),
        spin=0.0 if rng.random() < 0.3 else rng.uniform(-4, 4),
    )
    start, end = np.sort(rng.uniform(0, 20, 2)).tolist()
    return throw.release(clock=rng.uniform(0, 1000), sweep=(start, end))


@pytest.fixture
def slide_finely() -> Callable[[Ice, Release, NDArray[np.float64]], Rest]:
    return _slide_finely


@pytest.fixture
def play_finely() -> Callable[..., NDArray[np.float64]]:
    return _play_finely


@pytest.fixture
def draw_ice() -> Callable[[np.random.Generator], Ice]:
    return _draw_ice


@pytest.fixture
def draw_release() -> Callable[..., Release]:
    return _draw_release
