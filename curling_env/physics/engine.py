"""One throw among other stones, whose contacts pymunk resolves.

Stones slide as in the batch, by the same integrator and the same loop of events (`advance`). At a
contact a pymunk space of the touching stones solves all contacts together in a step of zero length,
and returns the velocities. It never moves anything.
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
from curling_env.physics.contacts import GONE, contact_law
from curling_env.physics.events import (
    MOVING,
    REST,
    PlayWorkspace,
    advance_and_sample,
    new_play_workspace,
    update_after_contacts,
)
from curling_env.physics.law import compile_law
from curling_env.physics.motion import ORDER
from curling_env.physics.pymunk_contacts import Push, resolve_contacts
from curling_env.physics.refusals import refuse_impossible_positions
from curling_env.physics.slides import SlideEnd, delivery_of, play_bounds, state_of
from curling_env.physics.state import State
from curling_env.physics.step import Workspace
from curling_env.physics.tuning import FINE_TOLERANCE, MAX_COLLISIONS, MAX_ROUNDS, MAX_TIME
from curling_env.sheet import HOG_LINE_Y, Direction
from curling_env.throw import Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Integers


class Status(StrEnum):
    """Fate of a stone."""

    REST = "rest"
    OUT_SIDE = "out_side"
    """Touched a side line."""
    OUT_BACK = "out_back"
    """Passed the back line wholly."""
    HOGGED = "hogged"
    """Delivered, struck nothing, and did not wholly clear the far hog line."""

    @property
    def in_play(self) -> bool:
        """True if the stone stays on the sheet."""
        return self is Status.REST


@dataclass(frozen=True, kw_only=True)
class StoneState:
    """Position and motion of a stone, sheet frame.

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
    """Contact of two stones.

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
    """Outcome of a throw.

    Parameters
    ----------
    stones : final states, first of the stones on the sheet before, then of the delivered one; a
        stone that left play has the state in which it left
    status : status of each stone
    time : time from release until the last stone rested or left [s]
    ends : time at which each stone came to rest or left [s]; 0 for one that never moved
    contacts : contacts in the order of time
    trajectories : paths of the stones that moved, in the order of `stones`, if requested
    """

    stones: tuple[StoneState, ...]
    status: tuple[Status, ...]
    time: float
    ends: tuple[float, ...]
    contacts: tuple[Contact, ...]
    trajectories: tuple[Trajectory, ...] = field(default=(), repr=False)

    @property
    def delivered(self) -> StoneState:
        """Thrown stone."""
        return self.stones[-1]

    @property
    def delivered_status(self) -> Status:
        """Status of the thrown stone."""
        return self.status[-1]

    @property
    def moved(self) -> tuple[int, ...]:
        """Indices of the stones that moved, in the order of `trajectories`."""
        return tuple(k for k, end in enumerate(self.ends) if end > 0)

    @property
    def in_play(self) -> tuple[StoneState, ...]:
        """Stones on the sheet afterwards."""
        return tuple(
            stone for stone, status in zip(self.stones, self.status, strict=True) if status.in_play
        )


class Engine:
    """Engine for throws on one ice among other stones. Each thread needs its own.

    Parameters
    ----------
    ice : map, effects and stone
    tolerance : maximum error of a lone stone's rest on the roughest ice, as in `slide` [m]

    Raises
    ------
    InputError : an effect that is not in the catalogue, or parameters its card does not allow
    """

    def __init__(self, ice: Ice, *, tolerance: float = FINE_TOLERANCE) -> None:
        self.ice = ice
        self.law = compile_law(ice)
        self._tolerance = tolerance
        self._contact = contact_law(ice.stone)
        self._workspaces: dict[int, tuple[PlayWorkspace, Workspace, Workspace]] = {}
        self._bounds = {direction: play_bounds(ice, direction) for direction in Direction}

    def __reduce__(self) -> tuple[Any, ...]:
        # The law contains addresses of this process.
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
        stones : stones on the sheet before, which may already move
        fps : samples per second of the trajectories; without it none are kept
        throw : number of the throw in the trajectories

        Raises
        ------
        InputError : a stone outside the lines, two in one place, or ice on which one never stops
        """
        n, dt = len(stones) + 1, 1.0 / fps if fps else 1.0
        position = self._begin(release, stones)
        moved_at = np.where(position.status == MOVING, 0.0, np.inf)
        samples = np.empty((n, int(MAX_TIME * fps) + 1 if fps else 0, 3))
        contacts, count = self._run(release, position, samples, dt)
        for contact in contacts:
            for k in (contact.first, contact.second):
                moved_at[k] = min(moved_at[k], contact.time)
        final = tuple(
            StoneState(x=x, y=y, vx=vx, vy=vy, theta=theta, omega=omega, stone=stone.stone)
            for stone, (x, y, vx, vy, theta, omega) in zip(
                (*stones, release), position.stones.tolist(), strict=True
            )
        )
        ends = tuple(position.finished.tolist())
        times: Floats = dt * np.arange(count, dtype=np.float64)

        def path_of(k: int) -> Trajectory:
            # From the last sample before the stone moved to its end.
            keep = (times > moved_at[k] - dt) & (times < ends[k] - 1e-9)
            t = np.append(times[keep], ends[k])
            last = [final[k].x, final[k].y, final[k].theta]
            rows = np.vstack([samples[k, :count][keep], last])
            swept = (t >= release.sweep_start) & (t < release.sweep_end) & (k == n - 1)
            return Trajectory(
                t=t,
                xy=rows[:, :2].copy(),
                theta=rows[:, 2].copy(),
                swept=swept.astype(np.float64),
                throw=throw,
                stone=final[k].stone,
                clock=release.clock,
            )

        struck = any(n - 1 in (contact.first, contact.second) for contact in contacts)
        return Outcome(
            stones=final,
            status=self._status(final, position.status, release.direction, struck=struck),
            time=max(ends),
            ends=ends,
            contacts=tuple(contacts),
            trajectories=tuple(path_of(k) for k in range(n) if fps and np.isfinite(moved_at[k])),
        )

    def _begin(self, release: Release, stones: Sequence[StoneState]) -> PlayWorkspace:
        """Return the position before the throw, in the arrays cached for that number of stones."""
        n = len(stones) + 1
        if n not in self._workspaces:
            self._workspaces[n] = new_play_workspace(self.ice, n, self._tolerance)
        position, _, _ = self._workspaces[n]
        position.stones[:] = [state_of(stone) for stone in (*stones, release)]
        position.identity[:] = [stone.stone for stone in (*stones, release)]
        refuse_impossible_positions(
            position.stones[None],
            self.ice.stone.radius,
            self._bounds[release.direction],
            "the side lines and the back line",
            bounded=n,
        )
        moves = (position.stones[:, [State.VX, State.VY, State.OMEGA]] != 0).any(axis=1)
        position.status[:] = np.where(moves, MOVING, REST)
        position.status[-1] = MOVING
        position.lengths[:] = 0
        position.finished[:] = 0.0
        position.motion[ORDER] = release.order
        return position

    def _run(
        self, release: Release, position: PlayWorkspace, samples: Floats, dt: float
    ) -> tuple[list[Contact], int]:
        """Let the stones slide until none moves; return contacts and the number of samples."""
        bounds, delivery = self._bounds[release.direction], delivery_of(release)
        _, usual, approach = self._workspaces[len(position.stones)]
        work = approach if (position.status == REST).any() else usual
        contacts: list[Contact] = []
        time, count, pause = 0.0, 0, SlideEnd.CONTACT
        for _ in range(MAX_COLLISIONS):
            pause, time, count = advance_and_sample(
                self.law, self._contact.reach, position, delivery, bounds, time, work, dt, count,
                samples,
            )  # fmt: skip
            if pause != SlideEnd.CONTACT:
                break
            pushes = self._resolve(position)
            contacts += [Contact(time=time, first=i, second=j, speed=v) for i, j, v in pushes]
            work = usual
        if pause != SlideEnd.REST:
            fastest = float(np.hypot(*usual.states[2, [State.VX, State.VY]]))
            raise InputError(
                f"a stone never stops on this ice: still {fastest:.3g} m/s after {time:.0f} s; "
                "check its friction and slope"
            )
        return contacts, count

    def _resolve(self, position: PlayWorkspace) -> list[Push]:
        """Let pymunk solve the contacts of touching stones until none closes."""
        all_pushes: list[Push] = []
        for _ in range(MAX_ROUNDS):
            pushes = resolve_contacts(
                self._contact, position.stones, position.status, position.contacts
            )
            if not pushes:
                break
            for first, second, _ in pushes:
                position.lengths[[first, second]] = 0
            all_pushes += pushes
        update_after_contacts(
            position.stones, position.status, position.lengths, position.ends, position.finished
        )
        return all_pushes

    def _status(
        self, stones: Sequence[StoneState], phases: Integers, direction: Direction, *, struck: bool
    ) -> tuple[Status, ...]:
        """Return the status of each stone; `struck`: true if the delivered one touched another."""
        status = [Status.REST] * len(stones)
        for k in np.flatnonzero(phases == GONE).tolist():
            by_side = left_over_side_line(stones[k].x, stones[k].y, self._bounds[direction])
            status[k] = Status.OUT_SIDE if by_side else Status.OUT_BACK
        short = is_hogged(stones[-1].y, direction, self.ice.stone.radius)
        if status[-1] is Status.REST and short and not struck:
            status[-1] = Status.HOGGED
        return tuple(status)


def left_over_side_line(x: Any, y: Any, bounds: Any) -> Any:
    """Return true for stones that left play over a side line.

    Parameters
    ----------
    x, y : places where they left; numbers or arrays [m]
    bounds : x_min, x_max, y_min, y_max of centres in play [m]
    """
    side = np.minimum(x - bounds[0], bounds[1] - x)
    back = np.minimum(y - bounds[2], bounds[3] - y)
    return side <= back


def is_hogged(y: Any, direction: Any, radius: float) -> Any:
    """Return true for delivered stones at rest at y that have not wholly cleared the far hog line
    [m].
    """
    return direction * y <= HOG_LINE_Y + radius
