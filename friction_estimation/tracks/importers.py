"""Tracks exported by other programs, Kinovea and Tracker, placed on the sheet.

Kinovea writes a CSV with one column of times and two for every tracked point (`name/0/X`,
`name/0/Y`, all quoted, decimals in the user's own style), or a text for gnuplot with one section
for each trajectory. Tracker (Open Source Physics) writes a line with the names of the masses and
one that begins with `t`, separated by tabs, commas or semicolons, and `#multi:` before several
masses.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.reading import read_text
from curling_env.infrastructure.files.table import is_plain, quoted
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats

_MAX_FRAME_TIME = 0.3
"""Maximum step of times in seconds; larger steps are milliseconds: no film has only three frames a
second.
"""
_MIN_ROWS = 3
MAX_NUMBER = 1e9
"""Largest time or position in an export, in its own units."""
MAX_DISTANCE = 1e3
"""Maximum distance of a position from the middle of the sheet [m]."""


class Along(StrEnum):
    """Axis of the other program that points from the home end to the away end."""

    x = "x"
    y = "y"
    minus_x = "-x"
    minus_y = "-y"


TO_SHEET: dict[Along, Floats] = {
    Along.y: np.array([[1.0, 0.0], [0.0, 1.0]]),
    Along.minus_y: np.array([[-1.0, 0.0], [0.0, -1.0]]),
    Along.x: np.array([[0.0, -1.0], [1.0, 0.0]]),
    Along.minus_x: np.array([[0.0, 1.0], [-1.0, 0.0]]),
}
"""Rotations from the axes of the program, whose second points to the left of the first."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """Tracked point as written by the other program.

    Parameters
    ----------
    name : name given by the user there
    t : (n,) times [s]
    xy : (n, 2) positions in the program's own axes and unit of length
    """

    name: str
    t: Floats
    xy: Floats


def read_export(path: str | Path) -> list[Series]:
    """Read every tracked point of an export of Kinovea or Tracker, in the order of the file.

    Parameters
    ----------
    path : the exported file

    Raises
    ------
    InputError : a file of neither program, a missing number, times that do not increase, or a point
        with fewer than three positions
    """
    lines = read_text(path).lstrip("\ufeff").splitlines()
    filled = [(i + 1, line) for i, line in enumerate(lines) if line.strip()]
    if not filled:
        raise InputError("contains no rows; expected a table of positions", source=path)
    first = filled[0][1].strip().lower()
    if first.startswith("#kinovea"):
        series = _kinovea_text(filled, path)
    elif re.search(r"/x[\"']?\s*[,;]", first):
        series = _kinovea_table(filled, path)
    else:
        series = _tracker(filled, path)
    if not series:
        raise InputError("contains no tracked point", source=path)
    return series


def on_sheet(
    series: Sequence[Series], *, metres: float, origin: tuple[float, float], along: Along
) -> list[Trajectory]:
    """Return every series as a separate throw, in the sheet frame.

    Parameters
    ----------
    series : tracked points
    metres : length of the program's unit [m]
    origin : the point at which the program's axes cross, sheet frame [m]
    along : the program's axis that points from the home end to the away end

    Raises
    ------
    InputError : a position far from any sheet
    """
    turn = TO_SHEET[along]
    tracks = [
        Trajectory(t=k.t - k.t[0], xy=metres * k.xy @ turn.T + np.array(origin), throw=i)
        for i, k in enumerate(series)
    ]
    for k, track in zip(series, tracks, strict=True):
        farthest = float(np.abs(track.xy).max())
        if farthest > MAX_DISTANCE:
            raise InputError(f"{k.name[:40]!r} is {farthest:.3g} m away from the sheet in one row")
    return tracks


# --- the formats -------------------------------------------------------------------------------

TextLines = Sequence[tuple[int, str]]
"""Lines that are not empty, with row numbers as in an editor."""


def _kinovea_text(lines: TextLines, path: str | Path) -> list[Series]:
    sections: list[tuple[str, list[tuple[int, list[str]]]]] = []
    for row, line in lines[2:]:
        if line.lstrip().startswith("#"):
            sections.append((line.strip().lstrip("# "), []))
        elif sections:
            sections[-1][1].append((row, line.split()))
        else:
            raise InputError(
                "expected `# name` before its positions", source=path, where=f"row {row}"
            )
    return [_series(name, cells, (0, 1, 2), None, path) for name, cells in sections]


def _kinovea_table(lines: TextLines, path: str | Path) -> list[Series]:
    separator = ";" if lines[0][1].count(";") > lines[0][1].count(",") else ","
    (_, header), *rows = _split(lines, separator, path)
    scale = _seconds_in(header[0])
    return [
        _series(name.rsplit("/", 2)[0], rows, (0, i, i + 1), scale, path)
        for i, name in enumerate(header)
        if name.lower().endswith("/x")
    ]


def _tracker(lines: TextLines, path: str | Path) -> list[Series]:
    first = lines[0][0]
    if lines[0][1].strip().lower().startswith("#multi"):
        lines = lines[1:]
    at = next((i for i, (_, line) in enumerate(lines[:2]) if re.match(r"\W*t\b", line)), None)
    separator = None
    if at is not None:
        separator = max("\t;,", key=lines[at][1].count)
    if at is None or separator is None or separator not in lines[at][1]:
        raise InputError(
            "not a table of Kinovea or Tracker: expected Kinovea's `Time, name/0/X, name/0/Y` or "
            "Tracker's `t, x, y` in the first rows",
            source=path,
            where=f"row {first}",
        )
    names = _split(lines[:1], separator, path)[0][1] if at else []
    (_, header), *rows = _split(lines[at:], separator, path)
    words = [re.split(r"[\s(]", cell.strip(), maxsplit=1)[0].lower() for cell in header]
    found: list[Series] = []
    for i, word in enumerate(words):
        if word == "x" and "y" in words[i:]:
            y = words.index("y", i)
            label = next((name for name in reversed(names[: i + 1]) if name), f"mass {len(found)}")
            found.append(_series(label, rows, (0, i, y), _seconds_in(header[0]), path))
    return found


def _split(lines: TextLines, separator: str, path: str | Path) -> list[tuple[int, list[str]]]:
    return [(row, _cells(line, separator, row, path)) for row, line in lines]


def _cells(line: str, separator: str, row: int, path: str | Path) -> list[str]:
    """Return the cells of one line; quotes never extend beyond it in these exports."""
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True))
    except csv.Error as error:
        raise InputError(f"not a table: {error}", source=path, where=f"row {row}") from error
    if len(cells) > limits.MAX_COLUMNS * 8:
        raise InputError(f"has {len(cells)} columns", source=path, where=f"row {row}")
    return [cell.strip() for cell in cells]


def _series(
    name: str,
    rows: Sequence[tuple[int, list[str]]],
    columns: tuple[int, int, int],
    seconds: float | None,
    path: str | Path,
) -> Series:
    """Return the rows in which a point has a position; in others it was not seen."""
    values: list[tuple[float, float, float]] = []
    for row, cells in rows:
        wanted = [cells[i] if i < len(cells) else "" for i in columns]
        if not wanted[1] and not wanted[2]:
            continue
        t, x, y = (_number(cell, row, path) for cell in wanted)
        if values and not t > values[-1][0]:
            raise InputError(
                f"time must increase, but {t:g} follows {values[-1][0]:g}",
                source=path,
                where=f"row {row}",
            )
        values.append((t, x, y))
    if len(values) < _MIN_ROWS:
        raise InputError(
            f"{name[:40]!r} has {len(values)} positions; expected at least {_MIN_ROWS}",
            source=path,
        )
    table = np.array(values)
    if seconds is None:
        seconds = 1e-3 if float(np.median(np.diff(table[:, 0]))) > _MAX_FRAME_TIME else 1.0
    return Series(name=name, t=seconds * table[:, 0], xy=table[:, 1:])


def _seconds_in(header: str) -> float | None:
    """Return the unit of a column of times in seconds; None if the header does not state it."""
    unit = re.search(r"[(\[]\s*(ms|s)\s*[)\]]", header.lower())
    return None if unit is None else {"ms": 1e-3, "s": 1.0}[unit[1]]


def _number(cell: str, row: int, path: str | Path) -> float:
    plain = cell.replace(",", ".") if "." not in cell and cell.count(",") == 1 else cell
    try:
        number = float(plain) if is_plain(plain) else np.nan
    except ValueError:
        number = np.nan
    if not abs(number) <= MAX_NUMBER:
        hint = "; export times in seconds or milliseconds" if ":" in cell else ""
        raise InputError(
            f"expected a number, found {quoted(cell)}{hint}", source=path, where=f"row {row}"
        )
    return number
