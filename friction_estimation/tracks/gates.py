"""Logs of light gates across a sheet, converted to throws of a few times each.

Laser gates are at the tee line and the hog line of both ends, numbered by end: `T-Line 1` and
`Hog-Line 1` at the home end, 2 at the away end. A log has a row for each time that a beam was
broken: `Sensor`, `Start` and `End` [s], and maybe `Break`, their difference. Most rows are of
people, brooms and stones that are pushed back. A throw is recognised by properties of a sliding
stone only: its time from hog line to hog line agrees with the speeds at both, and it is slower at
the second.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from curling_env.errors import InputError
from curling_env.infrastructure.files.table import is_plain, quoted, read_table
from curling_env.sheet import HOG_LINE_Y, HOG_TO_TEE, TEE_Y
from curling_env.trajectory import Trajectory
from friction_estimation.tracks.tuning import (
    GATE_PLACE_SIGMA,
    GATE_WIDTH,
    HOG_TO_HOG_SECONDS,
    LENGTH_TOLERANCE,
    MAX_GATE_SPEED,
    NEAR_LINE,
    SPEED_TOLERANCE,
    SPLIT_SECONDS,
)

SENSOR = re.compile(r"(t|tee|hog)[ _-]?(?:line)?[ _-]*([12])", re.IGNORECASE)
"""Names of gates: the line and the end."""
BREAK_ROUNDING = 2e-3
"""Rounding by which Break may differ from End minus Start [s]."""
_HOG_TO_HOG = 2 * HOG_LINE_Y


class Passage(NamedTuple):
    """Interruption of a beam.

    Parameters
    ----------
    row : row of the log
    hog : true for the beam at a hog line, false at a tee line
    end : -1 at the home end, 1 at the away end
    start, stop : times at which it was broken and free again [s]
    """

    row: int
    hog: bool
    end: int
    start: float
    stop: float

    @property
    def middle(self) -> float:
        """Time at which the centre of a stone passes [s]."""
        return 0.5 * (self.start + self.stop)

    @property
    def speed(self) -> float:
        """Speed of a stone that breaks the beam for that duration [m/s]."""
        return GATE_WIDTH / (self.stop - self.start)

    @property
    def line(self) -> float:
        """Position of the gate along the sheet [m]."""
        return self.end * (HOG_LINE_Y if self.hog else TEE_Y)


@dataclass(frozen=True, kw_only=True)
class GateLog:
    """Throws in a log of gates.

    Parameters
    ----------
    tracks : one for each throw, in order of time: a row for each edge of the stone at each gate
    faults : number and problem of each faulty row
    unused : numbers of the rows that are not from a throw
    """

    tracks: list[Trajectory]
    faults: list[str]
    unused: list[int]


def is_gate_log(path: str | Path) -> bool:
    """Return whether the first row of a file has the columns of a log of gates."""
    if not Path(path).is_file():
        return False
    with Path(path).open("rb") as file:
        first = file.readline(4096).decode("utf-8", "replace").lower()
    names = {name.strip(' "\ufeff\r\n') for name in first.split(",")}
    return {"sensor", "start", "end"} <= names


def read_gates(path: str | Path, sigma: float) -> GateLog:
    """Read the throws of a log of gates.

    Parameters
    ----------
    path : the log
    sigma : standard error of a time [s]

    Raises
    ------
    InputError : a file that is not such a log, or without a throw
    """
    passages, faults = _read(path)
    throws = sorted(_Passages(passages).throws(), key=lambda throw: throw[0].start)
    used = {passage.row for throw in throws for passage in throw}
    unused = [passage.row for passage in passages if passage.row not in used]
    if not throws:
        why = f"; {len(faults)} faulty rows, such as {faults[0]}" if faults else ""
        problem = f"no stone passes both hog lines in its {len(passages)} valid rows{why}"
        raise InputError(problem, source=path)
    begin = throws[0][0].start
    tracks = [_track(throw, k, begin, sigma) for k, throw in enumerate(throws)]
    return GateLog(tracks=tracks, faults=faults, unused=sorted(unused))


def gate_time(track: Trajectory, line: float) -> tuple[float, float] | None:
    """Return the time at which the centre of a timed stone passes a line, and its standard error
    [s].

    None if there is no gate.

    Parameters
    ----------
    track : throw timed by gates
    line : place along the direction of play, from mid-sheet [m]
    """
    forward = 1.0 if track.xy[-1, 1] >= track.xy[0, 1] else -1.0
    rows = np.abs(forward * track.xy[:, 1] - line) < NEAR_LINE
    if not rows.any():
        return None
    sigma = float(np.sqrt(np.sum(track.sigma_t[rows] ** 2))) / int(rows.sum())
    return float(track.t[rows].mean()), sigma


def _read(path: str | Path) -> tuple[list[Passage], list[str]]:
    """Return the passages of a log in order of time, and its faulty rows."""
    table = read_table(path, required=("Sensor", "Start", "End"), optional=("Break",))
    starts, stops = (_numbers(table.text(name)) for name in ("Start", "End"))
    breaks = table.text("Break") if "Break" in table else [""] * len(table)
    faults: list[tuple[int, str]] = []
    found: list[Passage] = []
    for k, name in enumerate(table.text("Sensor")):
        sensor = SENSOR.fullmatch(name.strip())
        start, stop = float(starts[k]), float(stops[k])
        problem = None
        if sensor is None:
            problem = f"unknown sensor {quoted(name)}; expected T-Line or Hog-Line, 1 or 2"
        elif not np.isfinite([start, stop]).all():
            problem = "Start and End must be numbers of seconds"
        elif stop <= start:
            problem = "End is not after Start"
        elif breaks[k] and not abs(stop - start - _number(breaks[k])) <= BREAK_ROUNDING:
            problem = f"Break is {quoted(breaks[k])}, but End minus Start is {stop - start:.4g} s"
        if problem is not None or sensor is None:
            faults.append((table.rows[k], problem or ""))
            continue
        end = -1 if sensor[2] == "1" else 1
        hog = sensor[1].lower() == "hog"
        found.append(Passage(table.rows[k], hog, end, start, stop))
    found.sort(key=lambda passage: (passage.start, passage.row))
    passages = _without_overlaps(found, faults)
    return passages, [f"row {row}: {problem}" for row, problem in sorted(faults)]


def _without_overlaps(found: Sequence[Passage], faults: list[tuple[int, str]]) -> list[Passage]:
    """Return the passages without those that last beyond the next one of the same beam, in order of
    time.

    Of two that overlap the longer one is faulty: the beam was free in between.

    Parameters
    ----------
    found : passages in order of time
    faults : faulty rows with their problems, to which overlaps are added
    """
    kept: dict[tuple[bool, int], list[Passage]] = {}
    for passage in found:
        own = kept.setdefault((passage.hog, passage.end), [])
        if own and passage.start < own[-1].stop:
            longer, shorter = sorted(
                (own.pop(), passage), key=lambda one: one.stop - one.start, reverse=True
            )
            own.append(shorter)
            seconds = longer.stop - longer.start
            problem = f"lasts {seconds:.4g} s, in which row {shorter.row} breaks the same beam"
            if longer[1:] == shorter[1:]:
                problem = f"repeats row {shorter.row}"
            faults.append((longer.row, problem))
        else:
            own.append(passage)
    return sorted((one for own in kept.values() for one in own), key=lambda one: one.start)


def _numbers(cells: Sequence[str]) -> np.ndarray:
    return np.array([_number(cell) for cell in cells], dtype=np.float64)


def _number(cell: str) -> float:
    try:
        return float(cell) if is_plain(cell) else np.nan
    except ValueError:
        return np.nan


class _Passages:
    """Passages of a log, searchable by time.

    Parameters
    ----------
    passages : passages in order of time
    """

    def __init__(self, passages: Sequence[Passage]) -> None:
        self._all = passages
        self._starts = [passage.start for passage in passages]

    def between(self, begin: float, end: float, *, hog: bool, at: int) -> Sequence[Passage]:
        """Return the passages of a gate that begin within a span of time [s]."""
        first, last = bisect_left(self._starts, begin), bisect_right(self._starts, end)
        return [one for one in self._all[first:last] if one.hog == hog and one.end == at]

    def throws(self) -> Iterator[list[Passage]]:
        """Return the passages of each throw, in order of time, each passage in at most one
        throw.
        """
        ratios = [
            (ratio, first, second)
            for first in self._all
            if first.hog
            for second in self.between(
                first.start, first.stop + HOG_TO_HOG_SECONDS[1], hog=True, at=-first.end
            )
            if abs((ratio := _speed_ratio(first, second)) - 1.0) < LENGTH_TOLERANCE
        ]
        # Length of a stone where the beams cross it, over the usual one: the same for all throws.
        usual = float(np.median([ratio for ratio, *_ in ratios])) if ratios else 1.0
        pairs = [(abs(ratio / usual - 1.0), first, second) for ratio, first, second in ratios]
        used: set[int] = set()
        for misfit, first, second in sorted(pairs, key=lambda pair: pair[0]):
            if misfit > SPEED_TOLERANCE or used & {first.row, second.row}:
                continue
            deceleration = (first.speed - second.speed) / (second.middle - first.middle)
            tees = [*self._near_tee(first), first, second, *self._far_tee(second, deceleration)]
            throw = [passage for passage in tees if passage.row not in used]
            used |= {passage.row for passage in throw}
            yield throw

    def _near_tee(self, first: Passage) -> list[Passage]:
        """Return the last passage of the near tee line before a throw passes the near hog line."""
        low, high = SPLIT_SECONDS
        found = self.between(first.start - high, first.start - low, hog=False, at=first.end)
        return [passage for passage in found if passage.speed < MAX_GATE_SPEED][-1:]

    def _far_tee(self, second: Passage, deceleration: float) -> list[Passage]:
        """Return the passage of the far tee line with the expected time and speed.

        Parameters
        ----------
        deceleration : deceleration between the hog lines [m/s²]
        """
        squared = second.speed**2 - 2 * deceleration * HOG_TO_TEE
        if squared <= 0:
            return []
        speed = float(np.sqrt(squared))
        expected = 2 * HOG_TO_TEE / (second.speed + speed)
        found = [
            (abs((passage.middle - second.middle) / expected - 1.0), passage)
            for passage in self.between(
                second.start, second.stop + 2 * expected, hog=False, at=second.end
            )
            if abs(passage.speed / speed - 1.0) < 2 * SPEED_TOLERANCE
        ]
        misfit, best = min(found, key=lambda one: one[0], default=(np.inf, second))
        return [best] if misfit < SPEED_TOLERANCE else []


def _speed_ratio(first: Passage, second: Passage) -> float:
    """Return the mean of the speeds at both hog lines over the mean speed between them.

    Infinite for anything but a freely sliding stone.
    """
    seconds = second.middle - first.middle
    low, high = HOG_TO_HOG_SECONDS
    if not low < seconds < high or not second.speed < first.speed < MAX_GATE_SPEED:
        return np.inf
    return 0.5 * (first.speed + second.speed) * seconds / _HOG_TO_HOG


def _track(throw: Sequence[Passage], number: int, begin: float, sigma: float) -> Trajectory:
    """Return a throw as rows: the place of its centre when its front and its rear are at each
    gate.
    """
    way = throw[-1].end
    times = np.array([time for passage in throw for time in (passage.start, passage.stop)])
    places = [
        passage.line + way * side * GATE_WIDTH / 2 for passage in throw for side in (-1.0, 1.0)
    ]
    return Trajectory(
        t=np.round(times - times[0], 6),
        xy=np.column_stack([np.zeros(len(times)), np.array(places)]),
        sigma_xy=np.full(len(times), GATE_PLACE_SIGMA),
        sigma_t=np.full(len(times), sigma),
        throw=number,
        clock=round(float(times[0]) - begin, 6),
    )
