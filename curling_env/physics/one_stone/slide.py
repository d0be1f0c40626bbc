"""One stone sliding alone: its path under the force law, to a tenth of a millimetre."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.compiled import compiled
from curling_env.physics.effects.motion import MOTION_SIZE, ORDER, STONE
from curling_env.physics.law import Law, compile_law
from curling_env.physics.one_stone.integrate import MAX_TIME, SlideEnd, glide
from curling_env.physics.one_stone.step import EXACT, Work, new_work
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, Direction
from curling_env.throw import Release
from curling_env.trajectory import Trajectory

__all__ = [
    "NO_OBSTACLES",
    "Slide",
    "SlideEnd",
    "edge_bounds",
    "new_work",
    "play_bounds",
    "slide",
    "slide_kernel",
]


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
    work: Work,
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
    work : of `new_work`

    Returns
    -------
    end : a SlideEnd
    t : time of the end [s]
    count : samples filled
    """
    state = work.states[2]
    state[0] = s[0]
    state[1] = s[1]
    state[2] = s[4]
    state[3] = s[2]
    state[4] = s[3]
    state[5] = s[5]
    end, t, count, _ = glide(
        law,
        motion,
        clock,
        sweep_start,
        sweep_end,
        bounds,
        obstacles,
        reach,
        dt,
        samples,
        work.knots[:0],
        0.0,
        work,
    )
    s[0] = state[0]
    s[1] = state[1]
    s[2] = state[3]
    s[3] = state[4]
    s[4] = state[2]
    s[5] = state[5]
    return end, t, count


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
    tolerance: float = EXACT,
) -> Slide:
    """Path of a lone stone on an ice from its release.

    Parameters
    ----------
    ice : map, effects and stone
    release : state at t = 0
    bounds : (4,) x_min, x_max, y_min, y_max of the centre that end it; the ice's edges by default
    fps : samples a second of the trajectory; none is kept without it
    throw : number of the throw in the trajectory
    tolerance : how far the rest may be off on the roughest ice; a tenth of it on smooth ice [m]

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
        new_work(tolerance),
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
