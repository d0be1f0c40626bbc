"""One stone sliding alone: the path under the force law, to a micrometre.

Fourth-order Runge–Kutta steps that end where the law is not smooth (cell centres of an
interpolated map, edges of constant cells and patches, the beginning and end of a sweep) and shrink
with the remaining speed, so that a draw takes about eighty of them. Between the ends of a step the
path is the quintic through both states and accelerations; samples, contacts and crossings are read
from it. The last 2 mm/s are uniform deceleration.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from math import fabs, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.effects.motion import (
    CLOCK,
    HEADING,
    MOTION_SIZE,
    ORDER,
    PUSH_SIZE,
    STONE,
    SWEPT,
    T,
)
from curling_env.physics.law import Law, accelerate, compile_law
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, Direction
from curling_env.throw import Release
from curling_env.trajectory import Trajectory

REST_SPEED = 2e-3
"""Speed of centre and band below which the rest is uniform deceleration [m/s]: 20 µm on ice."""
LONGEST_STEP = 0.5
"""Longest step [s]."""
SPEED_SHARE = 0.2
"""Part of its speed that a stone may lose in one step."""
NEAR_BREAK = 2e-3
"""A break closer than this is stepped over [m]: the error is of order 1e-8 m."""
MAX_STEPS = 20_000
"""Steps after which a stone that never stops is given up: ice that drives it."""
MAX_TIME = 180.0
"""Seconds after which a stone that never stops is given up [s]."""


class SlideEnd(IntEnum):
    """Why a slide ended."""

    REST = 0
    LEFT_BOUNDS = 1
    CONTACT = 2
    NEVER_STOPS = 3


@inlined
def _next_break(breaks: NDArray[np.float64], position: float, velocity: float) -> float:
    """Distance ahead to the next break, infinite if there is none [m]."""
    n = breaks.shape[0]
    if n == 0 or velocity == 0.0:
        return np.inf
    if velocity > 0.0:
        k = np.searchsorted(breaks, position + NEAR_BREAK)
        return breaks[k] - position if k < n else np.inf
    k = np.searchsorted(breaks, position - NEAR_BREAK)
    return position - breaks[k - 1] if k > 0 else np.inf


@inlined
def _time_to(distance: float, velocity: float, acceleration: float) -> float:
    """Time to cover a distance along one axis at uniform acceleration, or infinity [s]."""
    speed = fabs(velocity)
    gain = acceleration if velocity > 0.0 else -acceleration
    root = speed * speed + 2.0 * gain * distance
    if distance == np.inf or root <= 0.0:
        return np.inf
    return 2.0 * distance / (speed + sqrt(root))


@inlined
def step_length(law: Law, s: Any, a: Any, t: float, sweep_start: float, sweep_end: float) -> float:
    """How far to step from state s with acceleration a [s]."""
    speed = max(sqrt(s[2] * s[2] + s[3] * s[3]), fabs(s[5]) * law.band_radius)
    rate = max(sqrt(a[0] * a[0] + a[1] * a[1]), fabs(a[2]) * law.band_radius)
    h = min(LONGEST_STEP, SPEED_SHARE * speed / max(rate, 1e-9))
    h = min(h, _time_to(_next_break(law.x_breaks, s[0], s[2]), s[2], a[0]))
    h = min(h, _time_to(_next_break(law.y_breaks, s[1], s[3]), s[3], a[1]))
    if t < sweep_start - 1e-9:
        h = min(h, sweep_start - t)
    elif t < sweep_end - 1e-9:
        h = min(h, sweep_end - t)
    return h


@compiled
def derivative(
    law: Law, motion: Any, push: Any, base_clock: float, t: float, s: Any, a: Any
) -> None:
    """Acceleration a (3,) of state s (x, y, vx, vy, theta, omega) at time t."""
    motion[T] = t
    motion[CLOCK] = base_clock + t
    motion[HEADING] = s[4]
    a[0], a[1], a[2] = accelerate(law, motion, push, s[0], s[1], s[2], s[3], s[5])


@inlined
def _offset(s: Any, velocity: Any, a: Any, h: float, out: Any) -> None:
    """out = s advanced by h along a stage's velocities and accelerations."""
    out[0] = s[0] + h * velocity[2]
    out[1] = s[1] + h * velocity[3]
    out[4] = s[4] + h * velocity[5]
    out[2] = s[2] + h * a[0]
    out[3] = s[3] + h * a[1]
    out[5] = s[5] + h * a[2]


@compiled
def runge_kutta(
    law: Law, motion: Any, push: Any, clock: float, t: float, s: Any, a: Any, h: float, work: Any
) -> None:
    """One classical fourth-order step: s becomes the state at t + h; a must be its acceleration.

    `work` is (6, 6): three stages' states in rows 0–2 and accelerations in rows 3–5.
    """
    s2, s3, s4 = work[0], work[1], work[2]
    a2, a3, a4 = work[3], work[4], work[5]
    _offset(s, s, a, 0.5 * h, s2)
    derivative(law, motion, push, clock, t + 0.5 * h, s2, a2)
    _offset(s, s2, a2, 0.5 * h, s3)
    derivative(law, motion, push, clock, t + 0.5 * h, s3, a3)
    _offset(s, s3, a3, h, s4)
    derivative(law, motion, push, clock, t + h, s4, a4)
    sixth = h / 6.0
    s[0] += sixth * (s[2] + 2.0 * s2[2] + 2.0 * s3[2] + s4[2])
    s[1] += sixth * (s[3] + 2.0 * s2[3] + 2.0 * s3[3] + s4[3])
    s[4] += sixth * (s[5] + 2.0 * s2[5] + 2.0 * s3[5] + s4[5])
    s[2] += sixth * (a[0] + 2.0 * a2[0] + 2.0 * a3[0] + a4[0])
    s[3] += sixth * (a[1] + 2.0 * a2[1] + 2.0 * a3[1] + a4[1])
    s[5] += sixth * (a[2] + 2.0 * a2[2] + 2.0 * a3[2] + a4[2])


@inlined
def _quintic(p0: float, v0: float, a0: float, p1: float, v1: float, a1: float, h: float, u: float):
    """Position and velocity at the fraction u of a step, from both ends' values."""
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
def between(s0: Any, a0: Any, s1: Any, a1: Any, h: float, u: float, out: Any) -> None:
    """State at the fraction u of a step of length h from s0 to s1."""
    out[0], out[2] = _quintic(s0[0], s0[2], a0[0], s1[0], s1[2], a1[0], h, u)
    out[1], out[3] = _quintic(s0[1], s0[3], a0[1], s1[1], s1[3], a1[1], h, u)
    out[4], out[5] = _quintic(s0[4], s0[5], a0[2], s1[4], s1[5], a1[2], h, u)


@inlined
def _clearance(s: Any, bounds: Any, obstacles: Any, reach: float) -> Any:
    """How far inside its bounds and away from obstacles a state is [m]; negative once past one.

    Returns the smaller clearance and whether it is that of an obstacle.
    """
    room = min(min(s[0] - bounds[0], bounds[1] - s[0]), min(s[1] - bounds[2], bounds[3] - s[1]))
    contact = False
    for k in range(obstacles.shape[0]):
        gap = sqrt((s[0] - obstacles[k, 0]) ** 2 + (s[1] - obstacles[k, 1]) ** 2) - reach
        if gap < room:
            room = gap
            contact = True
    return room, contact


@compiled
def slide_kernel(
    law: Law,
    s: Any,
    motion: Any,
    clock: float,
    sweep_start: float,
    sweep_end: float,
    bounds: Any,
    obstacles: Any,
    reach: float,
    dt: float,
    samples: Any,
) -> Any:
    """Slide a stone from state s until it rests, leaves the bounds or comes within reach.

    Parameters
    ----------
    law : the ice
    s : (6,) x, y, vx, vy, theta, omega in the sheet frame; becomes the final state
    motion : (MOTION_SIZE,) with ORDER and STONE set
    clock : session time of the release [s]
    sweep_start, sweep_end : seconds after release [s]
    bounds : (4,) x_min, x_max, y_min, y_max of the centre [m]
    obstacles : (k, 2) centres of resting stones [m]
    reach : distance between centres that ends the slide [m]
    dt : sample interval [s]
    samples : (m, 4) filled with t, x, y, theta at 0, dt, 2 dt …; m = 0 for none

    Returns
    -------
    end : a SlideEnd
    t : time of the end [s]
    count : samples filled
    """
    push = np.empty(PUSH_SIZE)
    work = np.empty((6, 6))
    before = np.empty(6)
    a = np.empty(3)
    a0 = np.empty(3)
    probe = np.empty(6)
    t = 0.0
    count = 0
    room, contact = _clearance(s, bounds, obstacles, reach)
    if room < 0.0:
        return (SlideEnd.CONTACT if contact else SlideEnd.LEFT_BOUNDS), t, count
    motion[SWEPT] = 1.0 if sweep_start <= 0.0 < sweep_end else 0.0
    derivative(law, motion, push, clock, t, s, a)
    for _ in range(MAX_STEPS):
        speed = sqrt(s[2] * s[2] + s[3] * s[3])
        rate = sqrt(a[0] * a[0] + a[1] * a[1])
        if max(speed, fabs(s[5]) * law.band_radius) < REST_SPEED:
            tail = speed / max(rate, 1e-6)
            while count < samples.shape[0] and count * dt <= t + tail:
                u = count * dt - t
                fade = u * (1.0 - 0.5 * u / tail) if tail > 0.0 else 0.0
                samples[count, 0] = count * dt
                samples[count, 1] = s[0] + fade * s[2]
                samples[count, 2] = s[1] + fade * s[3]
                samples[count, 3] = s[4] + fade * s[5]
                count += 1
            s[0] += 0.5 * tail * s[2]
            s[1] += 0.5 * tail * s[3]
            s[4] += 0.5 * tail * s[5]
            s[2] = s[3] = s[5] = 0.0
            return SlideEnd.REST, t + tail, count
        if t > MAX_TIME:
            break
        h = step_length(law, s, a, t, sweep_start, sweep_end)
        before[:] = s
        a0[:] = a
        runge_kutta(law, motion, push, clock, t, s, a, h, work)
        derivative(law, motion, push, clock, t + h, s, a)
        # The stone cannot cover more than speed·h in this step, nor turn back: where all
        # clearances exceed that, nothing was crossed.
        end = -1
        fraction = 1.0
        if room < 1.5 * speed * h + 1e-3:
            low = 0.0
            for k in range(1, 9):
                between(before, a0, s, a, h, k / 8.0, probe)
                if _clearance(probe, bounds, obstacles, reach)[0] < 0.0:
                    fraction = k / 8.0
                    for _ in range(40):
                        middle = 0.5 * (low + fraction)
                        between(before, a0, s, a, h, middle, probe)
                        if _clearance(probe, bounds, obstacles, reach)[0] < 0.0:
                            fraction = middle
                        else:
                            low = middle
                    between(before, a0, s, a, h, fraction, probe)
                    contact = _clearance(probe, bounds, obstacles, reach)[1]
                    end = SlideEnd.CONTACT if contact else SlideEnd.LEFT_BOUNDS
                    break
                low = k / 8.0
        while count < samples.shape[0] and count * dt <= t + fraction * h:
            between(before, a0, s, a, h, (count * dt - t) / h, probe)
            samples[count, 0] = count * dt
            samples[count, 1] = probe[0]
            samples[count, 2] = probe[1]
            samples[count, 3] = probe[4]
            count += 1
        if end >= 0:
            between(before, a0, s, a, h, fraction, probe)
            s[:] = probe
            return end, t + fraction * h, count
        t += h
        room, contact = _clearance(s, bounds, obstacles, reach)
        swept = 1.0 if sweep_start <= t + 1e-9 < sweep_end else 0.0
        if swept != motion[SWEPT]:
            motion[SWEPT] = swept
            derivative(law, motion, push, clock, t, s, a)
    return SlideEnd.NEVER_STOPS, t, count


NO_OBSTACLES = np.empty((0, 2))


@dataclass(frozen=True, kw_only=True)
class Slide:
    """How one stone slid alone.

    Parameters
    ----------
    end : why it ended
    x, y, vx, vy, theta, omega : final state, sheet frame [m, m/s, rad, rad/s]
    time : since release [s]
    trajectory : samples at the asked rate and the final state, or None
    """

    end: SlideEnd
    x: float
    y: float
    vx: float
    vy: float
    theta: float
    omega: float
    time: float
    trajectory: Trajectory | None = field(default=None, repr=False)


def edge_bounds(ice: Ice) -> NDArray[np.float64]:
    """Bounds of a stone's centre while the whole stone is on the ice, (4,) [m]."""
    x = ice.sheet.width / 2 - ice.stone.radius
    y = ice.sheet.length / 2 - ice.stone.radius
    return np.array([-x, x, -y, y])


def play_bounds(ice: Ice, direction: Direction) -> NDArray[np.float64]:
    """Bounds of a stone's centre while it is in play or on its way there, (4,) [m].

    It touches neither side line and is not wholly past the back line it is played to.
    """
    x = ice.sheet.width / 2 - ice.stone.radius
    back = BACK_LINE_Y + ice.stone.radius
    start = max(HOG_LINE_Y, ice.sheet.length / 2)
    return np.array([-x, x, -start, back] if direction > 0 else [-x, x, -back, start])


def slide(
    ice: Ice,
    release: Release,
    *,
    bounds: NDArray[np.float64] | None = None,
    fps: float | None = None,
    throw: int = 0,
) -> Slide:
    """Path of a lone stone on an ice from its release.

    Parameters
    ----------
    ice : map, effects and stone
    release : state at t = 0
    bounds : (4,) x_min, x_max, y_min, y_max of the centre that end it; the ice's edges by default
    fps : samples a second of the trajectory; none is kept without it
    throw : number of the throw in the trajectory

    Raises
    ------
    InputError : a stone that starts outside the bounds, or ice on which it never stops
    """
    law = compile_law(ice)
    bounds = edge_bounds(ice) if bounds is None else bounds
    state = np.array([release.x, release.y, release.vx, release.vy, release.theta, release.omega])
    motion = np.zeros(MOTION_SIZE)
    motion[ORDER] = release.order
    motion[STONE] = release.stone
    dt = 1.0 / fps if fps else 1.0
    samples = np.empty((int(MAX_TIME / dt) + 1 if fps else 0, 4))
    end, time, count = slide_kernel(
        law,
        state,
        motion,
        release.clock,
        release.sweep_start,
        release.sweep_end,
        bounds,
        NO_OBSTACLES,
        0.0,
        dt,
        samples,
    )
    if time == 0.0 and end == SlideEnd.LEFT_BOUNDS:
        raise InputError(f"the stone starts off the ice, at ({release.x:g}, {release.y:g}) m")
    if end == SlideEnd.NEVER_STOPS:
        raise InputError(
            f"the stone never stops on this ice: still {np.hypot(state[2], state[3]):.3g} m/s "
            f"after {time:.0f} s; check its friction and slope"
        )
    trajectory = None
    if fps:
        rows = samples[:count]
        if count == 0 or time > rows[-1, 0] + 1e-9:
            rows = np.vstack([rows, [time, state[0], state[1], state[4]]])
        swept = (rows[:, 0] >= release.sweep_start) & (rows[:, 0] < release.sweep_end)
        trajectory = Trajectory(
            t=rows[:, 0].copy(),
            xy=rows[:, 1:3].copy(),
            theta=rows[:, 3].copy(),
            swept=swept.astype(np.float64),
            throw=throw,
            stone=release.stone,
            clock=release.clock,
        )
    x, y, vx, vy, theta, omega = (float(value) for value in state)
    return Slide(
        end=SlideEnd(end),
        x=x,
        y=y,
        vx=vx,
        vy=vy,
        theta=theta,
        omega=omega,
        time=float(time),
        trajectory=trajectory,
    )
