"""Paths of stones, the same for simulated and filmed throws, and their files."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.infrastructure.files.storage import write_table
from curling_env.infrastructure.files.table import Column, Table, read_table
from curling_env.typing import Flags, Floats, Indices

TRACK_TABLE = (
    Column(name="throw"),
    Column(name="t", unit="s", low=-1e8, high=1e8),
    Column(name="x", unit="m", low=-1e6, high=1e6),
    Column(name="y", unit="m", low=-1e6, high=1e6),
    Column(name="theta", unit="rad", low=-1e6, high=1e6),
    Column(name="stone", low=-1e9, high=1e9, required=False),
    Column(name="clock", unit="s", low=-1e9, high=1e9, required=False),
    Column(name="swept", low=0.0, high=1.0, required=False),
    Column(name="sigma_xy", unit="m", low=0.0, high=1e3, required=False),
    Column(name="sigma_theta", unit="rad", low=0.0, high=1e4, required=False),
    Column(name="sigma_t", unit="s", low=0.0, high=1e4, required=False),
)
"""Columns of a tracks file. Rows may be outliers, but not by a thousand kilometres."""
MAX_TRACK_SPEED = 20.0
"""Maximum mean speed of a track [m/s]; a wrong unit is far above it."""
MAX_TURN_RATE = 40.0
"""Maximum rotation of a stone [rad/s]; a throw's spin is at most 20."""
HEADING_SLACK = 8 * np.pi
"""Allowance for outliers and lost whole turns between two rows [rad]."""


def _nothing() -> Floats:
    return np.empty(0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """Path of one throw in the sheet frame.

    Parameters
    ----------
    t : (n,) time since the track began, strictly increasing [s]
    xy : (n, 2) centre of the stone [m]
    theta : (n,) unwrapped heading [rad]; NaN where unknown
    swept : (n,) 1 while the stone is swept, else 0
    sigma_xy : (n,) standard error of each coordinate [m]; empty if unknown
    sigma_theta : (n,) standard error of the heading [rad]; empty if unknown
    sigma_t : (n,) standard error of the times of light gates at known y [s], with the unknown x set
        to 0; empty for a track from a camera
    throw : number that groups the rows in a file
    stone : identifier of the stone
    clock : time since the session began at which the throw began [s]

    Raises
    ------
    InputError : lengths that differ, positions that are not finite, time that does not increase
    """

    t: Floats
    xy: Floats
    theta: Floats = field(default_factory=_nothing)
    swept: Floats = field(default_factory=_nothing)
    sigma_xy: Floats = field(default_factory=_nothing)
    sigma_theta: Floats = field(default_factory=_nothing)
    sigma_t: Floats = field(default_factory=_nothing)
    throw: int = 0
    stone: int = 0
    clock: float = 0.0

    def __post_init__(self) -> None:
        n = len(self.t)
        if self.xy.shape != (n, 2):
            raise InputError(f"a path needs xy of shape ({n}, 2), got {self.xy.shape}")
        for name, default in (("theta", np.nan), ("swept", 0.0)):
            if getattr(self, name).size == 0:
                object.__setattr__(self, name, np.full(n, default))
        for name in ("theta", "swept", "sigma_xy", "sigma_theta", "sigma_t"):
            column = getattr(self, name)
            if column.shape != (n,) and not (name.startswith("sigma") and column.size == 0):
                raise InputError(f"a path of {n} samples needs {n} of {name}, got {column.shape}")
        if not (np.isfinite(self.t).all() and np.isfinite(self.xy).all()):
            raise InputError("times and positions of a path must be finite numbers")
        if n > 1 and not (np.diff(self.t) > 0).all():
            sample = int(np.argmin(np.diff(self.t) > 0)) + 1
            raise InputError(
                f"time must increase along a path: sample {sample} is at {self.t[sample]:g} s, "
                f"after {self.t[sample - 1]:g} s"
            )

    def __len__(self) -> int:
        return len(self.t)

    def __eq__(self, other: object) -> bool:
        """Return whether every sample and every label is the same; unknown headings equal each
        other.
        """
        return isinstance(other, Trajectory) and all(
            np.array_equal(getattr(self, name.name), getattr(other, name.name), equal_nan=True)
            for name in fields(self)
        )

    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def only(self, rows: Flags | Indices | slice) -> Trajectory:
        """Return the track of some rows."""
        return replace(self, **{name: getattr(self, name)[rows] for name in self._measured})

    def joined(self, other: Trajectory) -> Trajectory:
        """Return the rows of both tracks in order of time, with this one's labels.

        Parameters
        ----------
        other : track with the same columns
        """
        order = np.argsort(np.concatenate([self.t, other.t]), kind="stable")
        columns = {
            name: np.concatenate([getattr(self, name), getattr(other, name)])[order]
            for name in self._measured
        }
        return replace(self, **columns)

    @property
    def _measured(self) -> list[str]:
        """Names of the columns that are not empty."""
        names = ("t", "xy", "theta", "swept", "sigma_xy", "sigma_theta", "sigma_t")
        return [name for name in names if getattr(self, name).size]

    def at(self, t: Floats) -> Floats:
        """Return positions at times, (n, 2) [m]; linear between rows, constant beyond the ends."""
        xy: list[Floats] = [np.interp(t, self.t, axis) for axis in self.xy.T]
        return np.column_stack(xy)

    @property
    def by_gates(self) -> bool:
        """True if the throw was timed by light gates, not seen by a camera."""
        return self.sigma_t.size > 0

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0]) if len(self) else 0.0

    @property
    def velocity(self) -> Floats:
        """Return central differences of the positions, (n, 2) [m/s]; noisy for a measured path."""
        return np.gradient(self.xy, self.t, axis=0)

    @property
    def path_length(self) -> Floats:
        """Return the distance travelled since the first sample, (n,) [m]."""
        steps = np.hypot(*np.diff(self.xy, axis=0).T)
        return np.concatenate([[0.0], np.cumsum(steps)])


def read_tracks(path: str | Path) -> list[Trajectory]:
    """Read a file of tracks (CSV), in the order of play.

    The rows of a throw, and of each stone in it if several move, must be adjacent, and their times
    must increase. Throws are sorted by number.

    Raises
    ------
    InputError : unreadable file, missing column, an invalid number, decreasing time
    """
    return tracks_of(read_table(path, columns=TRACK_TABLE))


def tracks_of(table: Table) -> list[Trajectory]:
    """Return the tracks in a table with the columns of TRACK_TABLE, in the order of play.

    Raises
    ------
    InputError : see `read_tracks`
    """
    path = table.source
    if len(table) == 0:
        raise InputError("contains no rows; expected one row per frame", source=path)
    throws = table.integers("throw")
    columns = {
        column.name: table.numbers(column.name, blank=column.name not in ("t", "y"))
        for column in TRACK_TABLE[1:]
        if column.name in table
    }
    _fill_in_x(table, columns)
    stones = np.nan_to_num(columns.pop("stone", np.zeros(len(table)))).astype(np.intp)
    changes = (np.diff(throws) != 0) | (np.diff(stones) != 0)
    starts = [0, *(np.flatnonzero(changes) + 1).tolist()]
    seen: set[tuple[int, int]] = set()
    for start in starts:
        key = (int(throws[start]), int(stones[start]))
        if key in seen:
            raise InputError(
                f"throw {key[0]}, stone {key[1]} appears twice; expected adjacent rows",
                source=path,
                where=table.where(start),
            )
        seen.add(key)
    tracks: list[Trajectory] = []
    for start, end in itertools.pairwise([*starts, len(table)]):
        backwards = np.flatnonzero(np.diff(columns["t"][start:end]) <= 0)
        if backwards.size:
            row = start + int(backwards[0]) + 1
            raise InputError(
                f"time must increase within a throw, but {columns['t'][row]:g} s follows "
                f"{columns['t'][row - 1]:g} s",
                source=path,
                where=table.where(row, "t"),
            )
        part = {name: column[start:end] for name, column in columns.items()}
        _check_speed(table, start, part)
        _check_headings(table, start, part["t"], part["theta"])
        clock = part.pop("clock", None)
        part = {name: column for name, column in part.items() if not np.isnan(column).all()}
        if "sigma_t" in part and np.isnan(part["sigma_t"]).any():
            raise InputError(
                "sigma_t is missing in some rows of a throw; expected it in all of them, or none",
                source=path,
                where=table.where(start + int(np.argmax(np.isnan(part["sigma_t"]))), "sigma_t"),
            )
        if "swept" in part:
            part["swept"] = np.nan_to_num(part["swept"])
        x, y = part.pop("x"), part.pop("y")
        tracks.append(
            Trajectory(
                **part,  # pyright: ignore[reportArgumentType]
                xy=np.column_stack([x, y]),
                throw=int(throws[start]),
                stone=int(stones[start]),
                clock=0.0 if clock is None or np.isnan(clock[0]) else float(clock[0]),
            )
        )
    return sorted(tracks, key=lambda track: track.throw)


def _fill_in_x(table: Table, columns: dict[str, Floats]) -> None:
    """Set the missing x of light gates to 0; refuse any other row without x."""
    timed = np.isfinite(columns.get("sigma_t", np.full(len(table), np.nan)))
    lacking = np.flatnonzero(np.isnan(columns["x"]) & ~timed)
    if lacking.size:
        raise InputError(
            "expected a number, found ''; only gate times, with sigma_t, have no x",
            source=table.source,
            where=table.where(int(lacking[0]), "x"),
        )
    columns["x"] = np.where(timed, 0.0, columns["x"])


def _check_speed(table: Table, start: int, columns: dict[str, Floats]) -> None:
    """Refuse a track whose ends are farther apart than a stone could travel in its time."""
    t, x, y = (columns[name] for name in ("t", "x", "y"))
    duration, distance = float(t[-1] - t[0]), float(np.hypot(x[-1] - x[0], y[-1] - y[0]))
    if distance > MAX_TRACK_SPEED * duration and len(t) > 2:
        raise InputError(
            f"{distance:.3g} m within {duration:.3g} s is too fast for a stone; expected t in "
            "seconds, x and y in metres",
            source=table.source,
            where=table.where(start + len(t) - 1, "t"),
        )


def _check_headings(table: Table, start: int, t: Floats, theta: Floats) -> None:
    """Refuse a heading that is impossible after that of the row before.

    Parameters
    ----------
    table : the file
    start : first row of the throw
    t, theta : (n,) times and headings of the throw; headings may be NaN
    """
    known = np.flatnonzero(np.isfinite(theta))
    turned = np.abs(np.diff(theta[known]))
    jumps = np.flatnonzero(turned > MAX_TURN_RATE * np.diff(t[known]) + HEADING_SLACK)
    if jumps.size:
        before, after = int(known[jumps[0]]), int(known[jumps[0] + 1])
        raise InputError(
            f"the heading jumps by {abs(theta[after] - theta[before]):.3g} rad within "
            f"{t[after] - t[before]:.3g} s; expected a continuous heading, or an empty cell if "
            "unknown",
            source=table.source,
            where=table.where(start + after, "theta"),
        )


def write_tracks(path: str | Path, tracks: Sequence[Trajectory]) -> None:
    """Write a file of tracks (CSV, or Parquet by its suffix); positions are rounded to 0.01 mm."""
    write_table(path, track_columns(tracks))


def tracks_of_columns(columns: Mapping[str, Sequence[Any]], source: str) -> list[Trajectory]:
    """Return the tracks in columns of numbers by name; None or NaN for an empty cell.

    Raises
    ------
    InputError : columns of different lengths, and see `read_tracks`
    """
    known = {column.name: column for column in TRACK_TABLE}
    length = len(columns["throw"])
    for name, cells in columns.items():
        if len(cells) != length:
            raise InputError(
                f"has {len(cells)} entries, throw has {length}",
                source=source,
                where=f"tracks.{name}",
            )
    cells = {
        name: ["" if cell is None or cell != cell else repr(cell) for cell in columns[name]]
        for name in known
        if name in columns
    }
    return tracks_of(Table(source=source, columns=cells, rows=range(1, length + 1), known=known))


def track_columns(tracks: Sequence[Trajectory], *, exact: bool = False) -> dict[str, NDArray[Any]]:
    """Return tracks as columns by name, one row per frame.

    Parameters
    ----------
    exact : keep all digits; otherwise positions are rounded to 0.01 mm
    """

    def rounded(values: Floats, digits: int) -> Floats:
        return values if exact else np.round(values, digits)

    measured = [
        name
        for name in ("sigma_xy", "sigma_theta", "sigma_t")
        if any(getattr(k, name).size for k in tracks)
    ]

    def column(name: str) -> Floats:
        return np.concatenate(
            [
                getattr(track, name) if getattr(track, name).size else np.full(len(track), np.nan)
                for track in tracks
            ]
        )

    counts = [len(track) for track in tracks]
    xy = np.concatenate([track.xy for track in tracks])
    return {
        "throw": np.repeat([track.throw for track in tracks], counts),
        "t": rounded(column("t"), 6),
        "x": np.where(np.isnan(column("sigma_t")), rounded(xy[:, 0], 5), np.nan),
        "y": rounded(xy[:, 1], 5),
        "theta": rounded(column("theta"), 5),
        "stone": np.repeat([track.stone for track in tracks], counts),
        "clock": np.repeat([track.clock for track in tracks], counts),
        "swept": column("swept").astype(int),
        **{name: rounded(column(name), 6) for name in measured},
    }
