"""A throw as a player calls it, and the release it makes on the sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError, OutOfRangeError
from curling_env.sheet import HOG_LINE_Y, Direction
from curling_env.storage import read_table, write_table

MAX_SPEED = 6.0
"""Fastest release accepted [m/s]; the hardest throws seen leave the hand at 4-5 m/s."""
MAX_SPIN = 20.0
"""Largest |spin| accepted [rad/s]; a hard-spun stone turns at about 6 rad/s."""

RELEASE_COLUMNS = ("throw", "x", "y", "vx", "vy", "theta", "omega")
OPTIONAL_RELEASE_COLUMNS = ("stone", "clock", "sweep_start", "sweep_end")


@dataclass(frozen=True, kw_only=True)
class Release:
    """The state of a stone as it leaves the hand, sheet frame.

    Parameters
    ----------
    x, y : centre of the stone [m]
    vx, vy : its velocity [m/s]
    theta : heading of the handle [rad]
    omega : spin, counter-clockwise positive [rad/s]
    stone : identifier of the stone
    clock : seconds into the session at which the throw begins [s]
    order : throws already played in the session
    sweep_start, sweep_end : interval in which it is swept, after release [s]; equal when unswept
    throw : its number in a file

    Raises
    ------
    InputError : a number that is not finite, or a sweep that ends before it begins
    OutOfRangeError : a speed or spin that no throw has
    """

    x: float
    y: float
    vx: float
    vy: float
    theta: float = 0.0
    omega: float = 0.0
    stone: int = 0
    clock: float = 0.0
    order: int = 0
    sweep_start: float = 0.0
    sweep_end: float = 0.0
    throw: int = 0

    def __post_init__(self) -> None:
        for name in ("x", "y", "vx", "vy", "theta", "omega", "clock", "sweep_start", "sweep_end"):
            value = getattr(self, name)
            if not np.isfinite(value):
                raise InputError(f"release {name} must be a finite number, got {value}")
        if self.speed > MAX_SPEED:
            raise OutOfRangeError(
                f"release speed must be at most {MAX_SPEED} m/s, got {self.speed:.3g} m/s"
            )
        if abs(self.omega) > MAX_SPIN:
            raise OutOfRangeError(
                f"release spin must be within ±{MAX_SPIN} rad/s, got {self.omega:.3g} rad/s"
            )
        if self.sweep_end < self.sweep_start:
            raise InputError(
                f"sweep_end {self.sweep_end} s comes before sweep_start {self.sweep_start} s"
            )

    @property
    def speed(self) -> float:
        """Speed over the ice [m/s]."""
        return float(np.hypot(self.vx, self.vy))

    @property
    def direction(self) -> Direction:
        """The end this release travels to."""
        return Direction.AWAY if self.vy >= 0 else Direction.HOME


@dataclass(frozen=True, kw_only=True)
class Throw:
    """A throw: the stone's centre crosses the delivery hog line with this speed, line and spin.

    Parameters
    ----------
    speed : over the ice [m/s]
    angle : counter-clockwise from the direction of play [rad]
    spin : counter-clockwise positive [rad/s]
    x : lateral offset at the hog line, delivery frame [m]

    Raises
    ------
    OutOfRangeError : speed not in (0, 6] m/s, |angle| not below a right angle, |spin| above 20
    """

    speed: float
    angle: float = 0.0
    spin: float = 0.0
    x: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.speed <= MAX_SPEED:
            raise OutOfRangeError(
                f"speed must lie above 0 and at most {MAX_SPEED} m/s, got {self.speed}"
            )
        if not abs(self.angle) < np.pi / 2:
            raise OutOfRangeError(f"angle must lie within ±π/2 rad, got {self.angle}")
        if not abs(self.spin) <= MAX_SPIN:
            raise OutOfRangeError(f"spin must lie within ±{MAX_SPIN} rad/s, got {self.spin}")
        if not np.isfinite(self.x):
            raise OutOfRangeError(f"x must be a finite offset in metres, got {self.x}")

    def release(
        self,
        direction: Direction = Direction.AWAY,
        *,
        stone: int = 0,
        clock: float = 0.0,
        order: int = 0,
        sweep: tuple[float, float] = (0.0, 0.0),
    ) -> Release:
        """The release of this throw towards an end, sheet frame."""
        vx, vy = velocity_of(self.speed, self.angle, direction)
        return Release(
            x=direction * self.x,
            y=-direction * HOG_LINE_Y,
            vx=float(vx),
            vy=float(vy),
            omega=self.spin,
            stone=stone,
            clock=clock,
            order=order,
            sweep_start=sweep[0],
            sweep_end=sweep[1],
        )


def velocity_of(speed: Any, angle: Any, direction: Any = Direction.AWAY) -> tuple[Any, Any]:
    """Velocity of a throw towards an end, sheet frame: vx, vy [m/s].

    Parameters
    ----------
    speed, angle : as of `Throw`, numbers or arrays of one shape
    direction : a `Direction`, or an array of 1 (away) and -1 (home)
    """
    return -direction * speed * np.sin(angle), direction * speed * np.cos(angle)


def read_releases(path: str | Path) -> list[Release]:
    """Releases from the contract's CSV, in file order, which is the order of play.

    Raises
    ------
    InputError : unreadable file, missing column, a row that is no release, or a number used twice
    """
    table = read_table(path, required=RELEASE_COLUMNS, optional=OPTIONAL_RELEASE_COLUMNS)
    columns = {
        name: table.numbers(name)
        for name in (*RELEASE_COLUMNS[1:], *OPTIONAL_RELEASE_COLUMNS)
        if name in table
    }
    if len(table) == 0:
        raise InputError("holds no release", source=path)
    throws = table.integers("throw").tolist()
    releases: list[Release] = []
    for row in range(len(table)):
        if throws[row] in throws[:row]:
            raise InputError(
                f"throw {throws[row]} appears twice; a release is one row",
                source=path,
                where=table.where(row, "throw"),
            )
        values = {
            name: float(column[row]) for name, column in columns.items() if np.isfinite(column[row])
        }
        stone = int(values.pop("stone", 0))
        try:
            release = Release(**values, stone=stone, order=row, throw=throws[row])  # pyright: ignore[reportArgumentType]
            if release.speed == 0:
                raise InputError("a release needs a speed above 0, got vx = vy = 0")
            releases.append(release)
        except InputError as error:
            raise InputError(error.problem, source=path, where=table.where(row)) from error
    return releases


def write_releases(path: str | Path, releases: Sequence[Release]) -> None:
    """Releases as the contract's CSV, written atomically."""
    write_table(
        path,
        {
            "throw": _numbers(releases),
            **{
                name: [getattr(release, name) for release in releases]
                for name in (*RELEASE_COLUMNS[1:], *OPTIONAL_RELEASE_COLUMNS)
            },
        },
    )


def _numbers(releases: Sequence[Release]) -> list[int]:
    """Their own numbers where these tell them apart, else the order they are given in."""
    own = [release.throw for release in releases]
    return own if len(set(own)) == len(own) else list(range(len(own)))
