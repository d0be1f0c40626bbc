"""One stone sliding alone: its path under the force law."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.integrator import SlideEnd, ThrowTimes, integrate
from curling_env.physics.law import compile_law
from curling_env.physics.map_path import sample_path
from curling_env.physics.motion import MOTION_SIZE, ORDER, STONE
from curling_env.physics.state import NODE_SIZE, State
from curling_env.physics.step import new_workspace
from curling_env.physics.surroundings import NO_BOUNDS as NO_BOUNDS
from curling_env.physics.surroundings import NO_OBSTACLES, Limits
from curling_env.physics.tuning import FINE_TOLERANCE
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, Direction
from curling_env.throw import Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats

USUAL_NODES = 1024
"""Capacity for the nodes of a path; the few longer ones are computed a second time."""


@dataclass(frozen=True)
class Slide:
    """Course of one stone that slid alone.

    Parameters
    ----------
    end : reason for its end
    x, y, vx, vy, theta, omega : final state, sheet frame [m, m/s, rad, rad/s]
    time : time from release to the end [s]
    trajectory : samples at the requested rate, and the final state; or None
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


def edge_bounds(ice: Ice) -> Floats:
    """Return bounds of a stone's centre while the whole stone is on the ice, (4,) [m]."""
    x = ice.sheet.width / 2 - ice.stone.radius
    y = ice.sheet.length / 2 - ice.stone.radius
    return np.array([-x, x, -y, y])


def play_bounds(ice: Ice, direction: Direction) -> Floats:
    """Return bounds of a stone's centre while it is in play or before play, (4,) [m].

    Within them the stone touches neither side line and is not wholly past the far back line.
    """
    x = ice.sheet.width / 2 - ice.stone.radius
    back = BACK_LINE_Y + ice.stone.radius
    start = max(HOG_LINE_Y, ice.sheet.length / 2)
    return np.array([-x, x, -start, back] if direction > 0 else [-x, x, -back, start])


def state_of(stone: Any) -> Floats:
    """Return the state (6,) of a `Release`, or of any object with the same fields."""
    return np.array([stone.x, stone.y, stone.vx, stone.vy, stone.theta, stone.omega])


def delivery_of(release: Release) -> ThrowTimes:
    """Return clock and sweep of a release."""
    return ThrowTimes(release.clock, release.sweep_start, release.sweep_end)


def slide(
    ice: Ice,
    release: Release,
    *,
    bounds: Floats | None = None,
    fps: float | None = None,
    throw: int = 0,
    tolerance: float = FINE_TOLERANCE,
) -> Slide:
    """Return the path of a lone stone on an ice from its release.

    Parameters
    ----------
    bounds : (4,) x_min, x_max, y_min, y_max of the centre that end the slide; the edges of the ice
        by default
    fps : samples per second of the trajectory; without it none is kept
    throw : number of the throw in the trajectory
    tolerance : maximum error of the rest on the roughest ice; a tenth of it on smooth ice [m]

    Raises
    ------
    InputError : a stone that starts outside the bounds, or ice on which it never stops
    """
    law, motion, work = compile_law(ice), np.zeros(MOTION_SIZE), new_workspace(tolerance)
    motion[[ORDER, STONE]] = release.order, release.stone
    limits = Limits(edge_bounds(ice) if bounds is None else bounds, NO_OBSTACLES, 0.0)
    path = np.empty((USUAL_NODES if fps else 0, NODE_SIZE))
    while True:
        state = work.states[2]
        state[:] = state_of(release)
        end, time, length = integrate(law, motion, delivery_of(release), limits, path, 0.0, work)
        if length <= len(path):
            break
        path = np.empty((length, NODE_SIZE))
    if time == 0.0 and end == SlideEnd.LEFT_BOUNDS:
        raise InputError(f"the stone starts off the ice, at ({release.x:g}, {release.y:g}) m")
    if end == SlideEnd.NEVER_STOPS:
        speed = np.hypot(state[State.VX], state[State.VY])
        raise InputError(
            f"the stone never stops on this ice: still {speed:.3g} m/s after {time:.0f} s; "
            "check its friction and slope"
        )
    trajectory = None
    if fps:
        dt = 1.0 / fps
        rows = np.empty((int(time / dt) + 1, 3))
        count = sample_path(path, length, dt, 0, time, work.probe, rows) if length else 0
        t: Floats = dt * np.arange(count, dtype=np.float64)
        rows = rows[:count]
        if count == 0 or time > t[-1] + 1e-9:
            t = np.append(t, time)
            rows = np.vstack([rows, state[[State.X, State.Y, State.THETA]]])
        trajectory = Trajectory(
            t=t,
            xy=rows[:, :2].copy(),
            theta=rows[:, 2].copy(),
            swept=((t >= release.sweep_start) & (t < release.sweep_end)).astype(np.float64),
            throw=throw,
            stone=release.stone,
            clock=release.clock,
        )
    return Slide(SlideEnd(end), *state.tolist(), time=float(time), trajectory=trajectory)
