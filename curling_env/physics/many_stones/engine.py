"""Stones that slide and collide: the compiled law carries them, pymunk resolves their contacts.

Until the delivered stone reaches another it slides by the same kernel as a lone stone (`slide`).
From then on all moving stones slide in common steps (`slide_together`). Contacts are found on those
paths, so that no time step limits how exactly they stand. Which contacts there are then, and by
which law they part, is said in `contacts`; a pymunk space of the stones that touch solves them all
together in a step of no length, and hands back the velocities. It never moves anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.law import compile_law
from curling_env.physics.many_stones.common_steps import (
    MovingStones,
    Pause,
    Phase,
    new_joint_workspace,
    slide_together,
)
from curling_env.physics.many_stones.contacts import contact_law, new_contacts
from curling_env.physics.many_stones.pymunk_contacts import resolve_contacts
from curling_env.physics.many_stones.tuning import (
    APPROACH,
    MAX_CONTACTS,
    OVERLAP_ALLOWED,
)
from curling_env.physics.motion import MOTION_SIZE, ORDER, STONE
from curling_env.physics.one_stone.integrate import Sampling
from curling_env.physics.one_stone.slide import (
    SlideEnd,
    delivery_of,
    is_beyond,
    play_bounds,
    slide_state,
    state_of,
)
from curling_env.physics.one_stone.step import new_workspace
from curling_env.physics.one_stone.surroundings import NO_OBSTACLES, Limits
from curling_env.physics.one_stone.tuning import FINE_TOLERANCE, MAX_TIME
from curling_env.physics.state import State
from curling_env.physics.tuning import MAX_ROUNDS
from curling_env.sheet import HOG_LINE_Y, Direction
from curling_env.throw import Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats

_MOTION = [State.VX, State.VY, State.OMEGA]
_PLACE = [State.X, State.Y, State.THETA]


class Status(StrEnum):
    """What became of a stone."""

    REST = "rest"
    OUT_SIDE = "out_side"
    """Touched a side line."""
    OUT_BACK = "out_back"
    """Passed the back line wholly."""
    HOGGED = "hogged"
    """Delivered, struck nothing, and did not wholly clear the far hog line."""

    @property
    def in_play(self) -> bool:
        """Whether the stone stays on the sheet."""
        return self is Status.REST


@dataclass(frozen=True, kw_only=True)
class StoneState:
    """Place and motion of a stone, sheet frame.

    Parameters
    ----------
    x, y : centre [m]
    vx, vy : velocity [m/s]
    theta : heading of the handle [rad]
    omega : spin, counter-clockwise positive [rad/s]
    stone : identifier, for effects that depend on the stone

    Raises
    ------
    InputError : a number that is not finite
    """

    x: float
    y: float
    vx: float = 0.0
    vy: float = 0.0
    theta: float = 0.0
    omega: float = 0.0
    stone: int = 0

    def __post_init__(self) -> None:
        total = self.x + self.y + self.vx + self.vy + self.theta + self.omega
        if not isfinite(total):
            raise InputError(f"a stone's position and motion must be finite numbers, got {self}")


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Two stones that met.

    Parameters
    ----------
    time : time since release [s]
    first, second : their indices among the stones of the outcome
    speed : closing speed [m/s]
    """

    time: float
    first: int
    second: int
    speed: float


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a throw led to.

    Parameters
    ----------
    stones : final states, first of the stones on the sheet before, then of the delivered one; a
        stone that left play has the state in which it left
    status : status of each stone
    time : time from release until the last stone rested or left [s]
    ends : time at which each stone came to rest or left [s]; 0 for one that never moved
    contacts : contacts in the order of time
    trajectories : paths of the stones that moved, in the order of `stones`, if asked for
    """

    stones: tuple[StoneState, ...]
    status: tuple[Status, ...]
    time: float
    ends: tuple[float, ...]
    contacts: tuple[Contact, ...]
    trajectories: tuple[Trajectory, ...] = field(default=(), repr=False)

    @property
    def delivered(self) -> StoneState:
        """The stone that was thrown."""
        return self.stones[-1]

    @property
    def delivered_status(self) -> Status:
        """The status of the stone that was thrown."""
        return self.status[-1]

    @property
    def moved(self) -> tuple[int, ...]:
        """Indices of the stones that moved, in the order of `trajectories`."""
        return tuple(k for k, end in enumerate(self.ends) if end > 0)

    @property
    def in_play(self) -> tuple[StoneState, ...]:
        """The stones that are on the sheet afterwards."""
        return tuple(
            stone for stone, status in zip(self.stones, self.status, strict=True) if status.in_play
        )


class Engine:
    """Plays throws on one ice among other stones. Each thread needs an engine of its own.

    Parameters
    ----------
    ice : map, effects and stone
    tolerance : how far the rest of a lone stone may be off on the roughest ice, as in `slide` [m]

    Raises
    ------
    InputError : an effect that is not in the catalogue, or parameters its card does not allow
    """

    def __init__(self, ice: Ice, *, tolerance: float = FINE_TOLERANCE) -> None:
        self.ice = ice
        self.law = compile_law(ice)
        self._tolerance = tolerance
        self._work = new_workspace(tolerance)
        self._approach = new_workspace(APPROACH * tolerance)
        self._bounds = {direction: play_bounds(ice, direction) for direction in Direction}

    def __reduce__(self) -> tuple[Any, ...]:
        # The law holds addresses of this process.
        return partial(Engine, self.ice, tolerance=self._tolerance), ()

    def play(
        self,
        release: Release,
        stones: Sequence[StoneState] = (),
        *,
        fps: float | None = None,
        throw: int = 0,
    ) -> Outcome:
        """Throw one stone and let everything come to rest.

        Parameters
        ----------
        release : release of the delivered stone
        stones : the stones on the sheet before, which may already move
        fps : samples per second of the trajectories; without it none are kept
        throw : number of the throw in the trajectories

        Raises
        ------
        InputError : a stone outside the lines, two in one place, or ice on which one never stops
        """
        direction, radius = release.direction, self.ice.stone.radius
        bounds = self._bounds[direction]
        n = len(stones) + 1
        states = np.array([state_of(stone) for stone in (*stones, release)])
        motion = np.zeros((n, MOTION_SIZE))
        motion[:, STONE] = [stone.stone for stone in (*stones, release)]
        motion[:, ORDER] = release.order
        self._check(states, bounds)
        moves = (states[:, _MOTION] != 0).any(axis=1)
        phases = np.where(moves, Phase.MOVING, Phase.RESTING)
        phases[-1] = Phase.MOVING
        ends = np.zeros(n)
        starts = np.where(phases == Phase.MOVING, 0.0, np.inf)
        dt = 1.0 / fps if fps else 1.0
        samples = np.empty((int(MAX_TIME / dt) + 1 if fps else 0, n, 3))
        contacts: list[Contact] = []
        time, frame = 0.0, 0
        sliding = MovingStones(states, phases, ends, motion)
        if not moves[:-1].any():
            time, frame = self._slide_alone(sliding, bounds, release, Sampling(dt, samples))
        limits = Limits(bounds, NO_OBSTACLES, 2 * radius)
        work, pause = new_joint_workspace(n), Pause.CONTACT
        pushing, touching = contact_law(self.ice.stone), new_contacts(n)
        if not (phases == Phase.MOVING).any():
            pause = Pause.REST  # where nothing was touched, what follows need not be compiled
        for _ in range(MAX_CONTACTS if pause is Pause.CONTACT else 0):
            pause, time, _, _, frame = slide_together(
                self.law,
                time,
                sliding,
                delivery_of(release),
                limits,
                Sampling(dt, samples),
                frame,
                work,
            )
            if pause != Pause.CONTACT:
                break
            for _ in range(MAX_ROUNDS):
                pushes = resolve_contacts(pushing, states, phases, touching)
                contacts.extend(
                    Contact(time=time, first=i, second=j, speed=v) for i, j, v in pushes
                )
                if not pushes:
                    break
            moved = (phases == Phase.RESTING) & (states[:, _MOTION] != 0).any(axis=1)
            phases[moved] = Phase.MOVING
            starts[moved] = np.minimum(starts[moved], time)
        if pause != Pause.REST:
            fastest = float(
                np.hypot(states[:, State.VX], states[:, State.VY])[phases == Phase.MOVING].max()
            )
            raise InputError(
                f"a stone never stops on this ice: still {fastest:.3g} m/s after {time:.0f} s; "
                "check its friction and slope"
            )
        final = tuple(
            StoneState(x=x, y=y, vx=vx, vy=vy, theta=theta, omega=omega, stone=stone.stone)
            for stone, (x, y, vx, vy, theta, omega) in zip(
                (*stones, release), states.tolist(), strict=True
            )
        )
        struck = any(n - 1 in (contact.first, contact.second) for contact in contacts)
        status = [_status(state, phases[k], bounds) for k, state in enumerate(final)]
        short = is_hogged(final[-1].y, direction, radius)
        if status[-1] is Status.REST and not struck and short:
            status[-1] = Status.HOGGED
        trajectories = ()
        if fps:
            trajectories = tuple(
                _trajectory(samples[:frame, k], dt, starts[k], ends[k], final[k], release, throw)
                if k < n - 1
                else _trajectory(samples[:frame, k], dt, 0.0, ends[k], final[k], release, throw,
                                 swept=True)
                for k in range(n)
                if np.isfinite(starts[k])
            )  # fmt: skip
        return Outcome(
            stones=final,
            status=tuple(status),
            time=float(ends.max()),
            ends=tuple(ends.tolist()),
            contacts=tuple(contacts),
            trajectories=trajectories,
        )

    def _slide_alone(
        self, stones: MovingStones, bounds: Floats, release: Release, sampling: Sampling
    ) -> tuple[float, int]:
        """Slide the delivered stone until it has ended or reached another; all others rest.

        Returns
        -------
        time since release [s] and the number of samples filled in
        """
        states, samples = stones.states, sampling.rows
        path = np.empty((len(samples), 4))
        others = states[:-1, [State.X, State.Y]].copy()
        end, time, count = slide_state(
            self.law,
            states[-1],
            stones.motion[-1],
            delivery_of(release),
            Limits(bounds, others, 2 * self.ice.stone.radius),
            Sampling(sampling.dt, path),
            self._approach if len(others) else self._work,
        )
        if len(samples):
            samples[:count] = states[:, _PLACE]
            samples[:count, -1] = path[:count, 1:]
        if end in (SlideEnd.REST, SlideEnd.LEFT_BOUNDS):
            stones.phases[-1] = Phase.RESTING if end == SlideEnd.REST else Phase.GONE
            stones.ends[-1] = time
        return float(time), int(count)

    def _check(self, states: Floats, bounds: Floats) -> None:
        x, y = states[:, State.X], states[:, State.Y]
        outside = is_beyond(x, y, bounds)
        if outside.any():
            k = int(np.argmax(outside))
            raise InputError(
                f"a stone must lie inside the side lines and the back line, got one at "
                f"({x[k]:g}, {y[k]:g}) m"
            )
        if len(states) > 1:
            apart = np.hypot(x[:, None] - x, y[:, None] - y)
            apart[np.arange(len(states)), np.arange(len(states))] = np.inf
            if apart.min() < 2 * self.ice.stone.radius - OVERLAP_ALLOWED:
                i, j = (int(k) for k in np.unravel_index(np.argmin(apart), apart.shape))
                raise InputError(
                    f"two stones cannot lie in one place: ({x[i]:g}, {y[i]:g}) and "
                    f"({x[j]:g}, {y[j]:g}) m"
                )


def _status(state: StoneState, phase: int, bounds: Floats) -> Status:
    if phase != Phase.GONE:
        return Status.REST
    by_the_side = left_by_the_side(state.x, state.y, bounds)
    return Status.OUT_SIDE if by_the_side else Status.OUT_BACK


def left_by_the_side(x: Any, y: Any, bounds: Any) -> Any:
    """Whether stones that left play at (x, y) did so over a side line; numbers or arrays.

    Parameters
    ----------
    bounds : x_min, x_max, y_min, y_max of centres in play [m]
    """
    side = np.minimum(x - bounds[0], bounds[1] - x)
    back = np.minimum(y - bounds[2], bounds[3] - y)
    return side <= back


def is_hogged(y: Any, direction: Any, radius: float) -> Any:
    """Whether delivered stones that rest at y have not wholly cleared the far hog line [m]."""
    return direction * y <= HOG_LINE_Y + radius


def _trajectory(
    samples: Floats,
    dt: float,
    start: float,
    end: float,
    final: StoneState,
    release: Release,
    throw: int,
    *,
    swept: bool = False,
) -> Trajectory:
    """The path of a stone, from the last sample before it moved to its end."""
    times = dt * np.arange(len(samples))
    keep = (times > start - dt) & (times < end - 1e-9)
    t = np.append(times[keep], end)
    rows = np.vstack([samples[keep], [final.x, final.y, final.theta]])
    broom = (t >= release.sweep_start) & (t < release.sweep_end) & swept
    return Trajectory(
        t=t,
        xy=rows[:, :2].copy(),
        theta=rows[:, 2].copy(),
        swept=broom.astype(np.float64),
        throw=throw,
        stone=final.stone,
        clock=release.clock,
    )
