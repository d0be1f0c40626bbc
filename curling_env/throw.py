"""Throws as called by a player, the resulting releases, and players' accuracy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError, OutOfRangeError, placed
from curling_env.infrastructure.files.storage import write_table
from curling_env.infrastructure.files.table import Column, read_table
from curling_env.sheet import HACK_Y, HOG_LINE_Y, TEE_Y, Direction
from curling_env.typing import Floats

MAX_SPEED = 6.0
"""Fastest release accepted [m/s]; the hardest throws leave the hand at 4 to 5 m/s."""
MIN_SPEED = 1e-3
"""Minimum speed of a throw, with any execution error [m/s]."""
MAX_SPIN = 20.0
"""Largest |spin| accepted [rad/s]; a hard-spun stone turns at about 6 rad/s."""

MAX_OFFSET = 100.0
"""Largest |x| of a throw accepted [m]; a sheet is not 5 m wide."""
MIN_TAILS = 2.0
"""Degrees of freedom at or below which Student's t has no standard deviation."""

RELEASE_TABLE = (
    Column(name="throw"),
    Column(name="x", unit="m", low=-1e3, high=1e3),
    Column(name="y", unit="m", low=-1e3, high=1e3),
    Column(name="vx", unit="m/s", low=-1e3, high=1e3),
    Column(name="vy", unit="m/s", low=-1e3, high=1e3),
    Column(name="theta", unit="rad", low=-1e6, high=1e6),
    Column(name="omega", unit="rad/s", low=-1e3, high=1e3),
    Column(name="stone", low=-1e9, high=1e9, required=False),
    Column(name="clock", unit="s", low=-1e8, high=1e8, required=False),
    Column(name="sweep_start", unit="s", low=-1e6, high=1e6, required=False),
    Column(name="sweep_end", unit="s", low=-1e6, high=1e6, required=False),
)
"""Columns of a releases file."""
_FIELDS = tuple(column.name for column in RELEASE_TABLE[1:])
"""Fields of a release, in the order of the columns."""


@dataclass(frozen=True, kw_only=True)
class Delivery:
    """Start of throws, with players' usual spin and maximum speed.

    Parameters
    ----------
    line_y : distance from mid-sheet of the line on which a stone's centre is released [m]
    spin : usual spin, to either side [rad/s]
    max_speed : maximum intended speed [m/s]; an execution error may exceed it

    Raises
    ------
    InputError : a line that is not on the sheet
    OutOfRangeError : a spin or speed out of range
    """

    line_y: float = HOG_LINE_Y
    spin: float = 1.5
    max_speed: float = MAX_SPEED

    def __post_init__(self) -> None:
        if not 0 <= self.line_y <= HACK_Y + 1.0:
            raise InputError(f"line_y must be between 0 and {HACK_Y + 1:.2f} m, got {self.line_y}")
        if not 0 < self.spin <= MAX_SPIN:
            raise OutOfRangeError(f"spin must be above 0 and at most {MAX_SPIN}, got {self.spin}")
        if not 0 < self.max_speed <= MAX_SPEED:
            raise OutOfRangeError(
                f"max_speed must be above 0 and at most {MAX_SPEED} m/s, got {self.max_speed}"
            )

    @property
    def start_y(self) -> float:
        """Release line in the delivery frame [m]."""
        return -self.line_y - TEE_Y


FROM_HOG_LINE = Delivery()
"""Convention everywhere but in Digital Curling: about three turns during a draw."""
FROM_HACK = Delivery(line_y=HACK_Y, spin=math.pi / 2, max_speed=4.0)
"""Convention of Digital Curling's servers: π/2 rad/s to either side, and 4 m/s for every player."""
FROM_TEE_LINE = Delivery(line_y=TEE_Y)
"""Convention of films: the stone slides freely from the near tee line, where many players release
it.
"""
DELIVERIES = {"hog-line": FROM_HOG_LINE, "hack": FROM_HACK, "tee-line": FROM_TEE_LINE}
"""Deliveries by name."""


def delivery_named(name: str | Delivery) -> Delivery:
    """Return a delivery by its name; a `Delivery` is returned unchanged.

    Raises
    ------
    InputError : an unknown name
    """
    if isinstance(name, Delivery):
        return name
    if not isinstance(name, str) or name not in DELIVERIES:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError(f"unknown delivery {name!r}; expected one of {', '.join(DELIVERIES)}")
    return DELIVERIES[name]


@dataclass(frozen=True, kw_only=True)
class Release:
    """State of a stone as it leaves the hand, sheet frame.

    Parameters
    ----------
    x, y : centre of the stone [m]
    vx, vy : velocity [m/s]
    theta : heading of the handle [rad]
    omega : spin, counter-clockwise positive [rad/s]
    stone : identifier of the stone
    clock : time since the session began [s]
    order : number of throws already played in the session
    sweep_start, sweep_end : interval after release in which the stone is swept [s]; equal if it is
        not swept
    throw : number of the throw in a file

    Raises
    ------
    InputError : a number that is not finite, or a sweep that ends before it begins
    OutOfRangeError : a speed or spin out of range
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
        numbers = (self.x, self.y, self.vx, self.vy, self.theta, self.omega, self.clock)
        if not math.isfinite(sum(numbers) + self.sweep_start + self.sweep_end):
            for name in _FIELDS:
                value = getattr(self, name)
                if not math.isfinite(value):
                    raise InputError(f"release {name} must be a finite number, got {value}")
        # The components of the fastest throw may round to slightly more than its speed.
        if math.hypot(self.vx, self.vy) > MAX_SPEED * (1 + 1e-12):
            raise OutOfRangeError(
                f"release speed must be at most {MAX_SPEED} m/s, got {self.speed:.3g} m/s"
            )
        if abs(self.omega) > MAX_SPIN:
            raise OutOfRangeError(
                f"release spin must be within ±{MAX_SPIN} rad/s, got {self.omega:.3g} rad/s"
            )
        if self.sweep_end < self.sweep_start:
            raise InputError(
                f"sweep_end {self.sweep_end} s is before sweep_start {self.sweep_start} s"
            )

    @property
    def speed(self) -> float:
        """Speed over the ice [m/s]."""
        return float(np.hypot(self.vx, self.vy))

    @property
    def direction(self) -> Direction:
        """End that this release travels to."""
        return Direction.AWAY if self.vy >= 0 else Direction.HOME


@dataclass(frozen=True, kw_only=True)
class Throw:
    """Speed, line and spin of a stone whose centre crosses the line of release.

    That line is the delivery hog line, unless a `Delivery` sets another.

    Parameters
    ----------
    speed : over the ice [m/s]
    angle : counter-clockwise from the direction of play [rad]
    spin : counter-clockwise positive [rad/s]
    x : lateral offset on the line of release, delivery frame [m]

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
                f"speed must be above 0 and at most {MAX_SPEED} m/s, got {self.speed}"
            )
        if not abs(self.angle) < np.pi / 2:
            raise OutOfRangeError(f"angle must be within ±π/2 rad, got {self.angle}")
        if not abs(self.spin) <= MAX_SPIN:
            raise OutOfRangeError(f"spin must be within ±{MAX_SPIN} rad/s, got {self.spin}")
        if not abs(self.x) <= MAX_OFFSET:
            raise OutOfRangeError(f"x must be within ±{MAX_OFFSET:g} m, got {self.x}")

    def release(
        self,
        direction: Direction = Direction.AWAY,
        *,
        stone: int = 0,
        clock: float = 0.0,
        order: int = 0,
        sweep: tuple[float, float] = (0.0, 0.0),
        delivery: Delivery = FROM_HOG_LINE,
    ) -> Release:
        """Return the release of this throw towards an end, sheet frame."""
        vx, vy = velocity_of(self.speed, self.angle, direction)
        return Release(
            x=direction * self.x,
            y=-direction * delivery.line_y,
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
    """Return the velocity of a throw towards an end, sheet frame: vx, vy [m/s].

    Parameters
    ----------
    speed, angle : as in `Throw`; numbers or arrays of one shape
    direction : a `Direction`, or an array of 1 (away) and -1 (home)
    """
    return -direction * speed * np.sin(angle), direction * speed * np.cos(angle)


def read_releases(path: str | Path) -> list[Release]:
    """Read a file of releases (CSV), in the order of the file, which is the order of play.

    Raises
    ------
    InputError : unreadable file, missing column, a row that is not a release, or a number used
        twice
    """
    table = read_table(path, columns=RELEASE_TABLE)
    names = [name for name in _FIELDS if name in table]
    columns = {name: np.nan_to_num(table.numbers(name)).tolist() for name in names}
    if len(table) == 0:
        raise InputError("contains no release", source=path)
    throws = table.integers("throw").tolist()
    if "stone" in columns:
        columns["stone"] = [int(stone) for stone in columns["stone"]]
    releases: list[Release] = []
    seen: set[int] = set()
    for row, (throw, *values) in enumerate(zip(throws, *columns.values(), strict=True)):
        if throw in seen:
            raise InputError(
                f"throw {throw} appears twice; expected one row per release",
                source=path,
                where=table.where(row, "throw"),
            )
        seen.add(throw)
        with placed(source=path, where=table.where(row)):
            release = Release(**dict(zip(names, values, strict=True)), order=row, throw=throw)  # pyright: ignore[reportArgumentType]
            if release.vx == release.vy == 0:
                raise InputError("a release needs a speed above 0, got vx = vy = 0")
            releases.append(release)
    return releases


def write_releases(path: str | Path, releases: Sequence[Release]) -> None:
    """Write a file of releases (CSV), completely or not at all.

    Throws keep their numbers if all differ; otherwise they are counted.
    """
    numbers = [release.throw for release in releases]
    if len(set(numbers)) < len(numbers):
        numbers = list(range(len(numbers)))
    fields = {name: [getattr(release, name) for release in releases] for name in _FIELDS}
    write_table(path, {"throw": numbers, **fields})


@dataclass(frozen=True, kw_only=True)
class Skill:
    """Scatter of a player's throws about the intended ones.

    Errors follow Student's t-distribution in three dimensions: speed, angle and spin of one throw
    share one random factor, so that a bad throw is bad in all three. Without tails
    and correlation they are normal and independent.

    Parameters
    ----------
    name : name on the command line
    sigma_speed : standard deviation of the release speed [m/s]
    sigma_angle : standard deviation of the line of delivery [rad]
    sigma_spin : standard deviation of the spin [rad/s]
    tails : degrees of freedom of Student's t; fewer make large errors more frequent with the same
        standard deviations. Infinite, the default, means normal errors
    correlation : correlation of the errors of speed and angle; positive if throws that are too fast
        go too far to the left
    source : origin of the numbers

    Raises
    ------
    InputError : a standard deviation that is negative or not finite, tails of `MIN_TAILS` or less,
        or a correlation that is not between -1 and 1
    """

    name: str
    sigma_speed: float = 0.0
    sigma_angle: float = 0.0
    sigma_spin: float = 0.0
    tails: float = math.inf
    correlation: float = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("sigma_speed", "sigma_angle", "sigma_spin"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"skill {self.name}: {name} must be at least 0, got {value}")
        if not self.tails > MIN_TAILS:
            raise InputError(
                f"skill {self.name}: tails must be above {MIN_TAILS:g} degrees of freedom, "
                f"got {self.tails}"
            )
        if not abs(self.correlation) < 1:
            raise InputError(
                f"skill {self.name}: correlation must be between -1 and 1, got {self.correlation}"
            )

    @property
    def is_exact(self) -> bool:
        """Return whether every throw is exact."""
        return self.sigma_speed == self.sigma_angle == self.sigma_spin == 0.0

    def error(self, rng: np.random.Generator) -> tuple[float, float, float]:
        """Draw the error of one throw: speed [m/s], angle [rad], spin [rad/s]."""
        speed, angle, spin = rng.standard_normal(3).tolist()
        if self.correlation:
            angle = self.correlation * speed + math.sqrt(1 - self.correlation**2) * angle
        if self.tails < math.inf:
            size = math.sqrt((self.tails - 2) / rng.chisquare(self.tails))
            speed, angle, spin = size * speed, size * angle, size * spin
        return self.sigma_speed * speed, self.sigma_angle * angle, self.sigma_spin * spin

    def errors(self, n: int, rng: np.random.Generator) -> Floats:
        """Draw the errors of n throws, (n, 3): speed [m/s], angle [rad], spin [rad/s].

        They come in opposite pairs, so that their mean is zero for an even n, and an expectation
        over them needs fewer throws.
        """
        half = self.standard_errors(-(-n // 2), rng)
        sigma = self.sigma_speed, self.sigma_angle, self.sigma_spin
        return np.concatenate([half, -half])[:n] * sigma

    def standard_errors(self, n: int, rng: np.random.Generator) -> Floats:
        """Draw the errors of n throws in standard deviations, (n, 3)."""
        drawn = rng.standard_normal((n, 3))
        if self.correlation:
            drawn[:, 1] *= math.sqrt(1 - self.correlation**2)
            drawn[:, 1] += self.correlation * drawn[:, 0]
        if self.tails < math.inf:
            drawn *= np.sqrt((self.tails - 2) / rng.chisquare(self.tails, n))[:, None]
        return drawn


_SPIN = "spread of the spin: a choice, about a tenth of a usual spin; no measurement is published"

SKILLS = {
    skill.name: skill
    for skill in (
        Skill(name="none", source="every throw is exactly as intended"),
        Skill(
            name="elite",
            sigma_speed=0.0076,
            sigma_angle=0.0018,
            sigma_spin=0.1,
            source="settings of simulators for elite players; " + _SPIN,
        ),
        Skill(
            name="digital-curling",
            sigma_speed=0.0076,
            sigma_angle=0.0018,
            source="the usual setting of Digital Curling's servers, which have no error of spin",
        ),
        Skill(
            name="champion",
            sigma_speed=0.015,
            sigma_angle=0.0026,
            sigma_spin=0.1,
            source="estimates for elite players, 0.01-0.02 m/s and 0.1-0.2° (0.15°); " + _SPIN,
        ),
        Skill(
            name="championship",
            sigma_speed=0.03,
            sigma_angle=0.0026,
            sigma_spin=0.1,
            tails=5.0,
            source="fitted so that ends are scored as in championships; " + _SPIN,
        ),
        Skill(
            name="club",
            sigma_speed=0.03,
            sigma_angle=0.0052,
            sigma_spin=0.2,
            source="a choice: twice `champion`; no measurement of club players is published",
        ),
    )
}
"""Skills by name, from exact to club player."""


def skill_named(name: str | Skill) -> Skill:
    """Return the skill of that name; a `Skill` is returned unchanged.

    Raises
    ------
    InputError : a name that is not in `SKILLS`
    """
    if isinstance(name, Skill):
        return name
    if not isinstance(name, str) or name not in SKILLS:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError(f"unknown skill {str(name)[:40]!r}; expected one of {', '.join(SKILLS)}")
    return SKILLS[name]


def handles(spin: float) -> tuple[str, str]:
    """Return the handle for a right-hander and for a left-hander.

    A right-hander's in-turn is clockwise, a left-hander's counter-clockwise.
    """
    if spin == 0:
        return "no turn", "no turn"
    return ("out-turn", "in-turn") if spin > 0 else ("in-turn", "out-turn")
