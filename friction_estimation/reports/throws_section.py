"""Table of throws for a coach, on pages and in the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from curling_env.infrastructure.files.storage import write_table
from curling_env.sheet import HOUSE_RADIUS, RULE_BOOK_STONE, Direction
from curling_env.throw import handles
from curling_env.units import Units, length, short_length, side, speed
from friction_estimation.reports.html import table
from friction_estimation.tracks.measured import Measured
from friction_estimation.tracks.seen_throw import FAR_HOG
from friction_estimation.tracks.throw_list import NO_NOTES, NOTED, ThrowNote
from friction_estimation.tracks.throw_table import ThrowMeasures
from friction_estimation.tracks.tuning import MIN_TURN

NOT_SEEN = "–"
NO_COLUMNS: Mapping[str, Sequence[object]] = MappingProxyType({})

Notes = Mapping[int, ThrowNote]
"""A coach's notes of throws, by their numbers."""


@dataclass(frozen=True, kw_only=True)
class ThrowRows:
    """A table of throws in words.

    Parameters
    ----------
    head : names of the columns
    rows : plain text of the cells
    numeric : numbers of the columns that hold numbers
    """

    head: list[str]
    rows: list[list[str]]
    numeric: set[int]


def throw_rows(
    throws: Sequence[ThrowMeasures],
    units: Units | None = None,
    notes: Notes = NO_NOTES,
    *,
    errors: bool = True,
) -> ThrowRows:
    """Return the table of throws in words.

    A column without values is dropped.

    Parameters
    ----------
    throws : the measured throws
    units : units of displayed lengths
    notes : what a coach noted of the throws
    errors : whether line and curl are shown with their standard errors
    """

    def noted(name: str) -> list[str]:
        return [getattr(notes.get(one.throw, ThrowNote()), name) for one in throws]

    columns: list[tuple[str, list[str], bool]] = [
        ("throw", [str(one.throw) for one in throws], True),
        *((name, noted(name), False) for name in NOTED if name != "note"),
        ("back to hog", [_seconds(one.back_to_hog) for one in throws], True),
        ("hog to hog", [_seconds(one.hog_to_hog) for one in throws], True),
        ("hog to tee", [_seconds(one.hog_to_tee) for one in throws], True),
        (
            "speed",
            [NOT_SEEN if one.speed is None else speed(one.speed.value, units) for one in throws],
            True,
        ),
        ("handle", [handle_of(one) for one in throws], False),
        (
            "turns",
            [NOT_SEEN if one.turns is None else f"{one.turns.value:.1f}" for one in throws],
            True,
        ),
        ("line", [_side(one.line, units, errors) for one in throws], False),
        ("curl", [_side(one.curl, units, errors, positive="left") for one in throws], False),
        ("rest", [rest_of(one, units, short=True) for one in throws], False),
        ("note", noted("note"), False),
    ]
    columns = [
        column for column in columns if any(cell not in ("", NOT_SEEN) for cell in column[1])
    ]
    return ThrowRows(
        head=[name for name, _, _ in columns],
        rows=[list(cells) for cells in zip(*(cells for _, cells, _ in columns), strict=True)],
        numeric={k for k, (_, _, numeric) in enumerate(columns) if numeric},
    )


def throws_section(
    throws: Sequence[ThrowMeasures],
    units: Units | None = None,
    notes: Notes = NO_NOTES,
) -> str:
    """Return the table of throws and the meaning of its columns, as HTML.

    Parameters
    ----------
    throws : the measured throws
    units : units of displayed lengths
    notes : what a coach noted of the throws
    """
    rows = throw_rows(throws, units, notes)
    cells = [[_cell(cell) for cell in row] for row in rows.rows]
    means = "".join(f"<p>{escape(sentence)}</p>" for sentence in curl_in_words(throws, units))
    kept = {
        rows.head.index(name) for name in ("handle", "line", "curl", "rest") if name in rows.head
    }
    shape = table(
        [escape(name) for name in rows.head], cells, rows.numeric, kept=kept, kind="throws"
    )
    return (
        f"<h2>The throws</h2>{means}{shape}<p class=faint>{escape(EXPLANATION)} "
        f"{escape(_errors(throws))}</p>"
    )


def _cell(text: str) -> str:
    """Return a cell as HTML, with its standard error in small print."""
    value, plus_minus, error = text.partition(" ± ")
    shown = escape(value)
    return f"{shown} <small>± {escape(error)}</small>" if plus_minus else shown


EXPLANATION = (
    "Times are those of the stone's centre over the lines: back to hog is the split at the "
    "thrower's end, hog to tee is from the first hog line to the far tee line. The speed is that "
    "over the first hog line. Handles are a right-hander's. The line is where the stone was sent: "
    "its first metres beyond the hog line, drawn on to the far tee line. The curl is how far from "
    "that line it came to rest, to its left or right. The rest is past or short of the tee line, "
    "and beside the centre line. Left and right are the thrower's."
)


def write_measures(
    path: str | Path,
    throws: Sequence[ThrowMeasures],
    notes: Notes = NO_NOTES,
    others: Mapping[str, Sequence[object]] = NO_COLUMNS,
) -> None:
    """Write the table as CSV: SI units, the sheet frame's names, and every standard error.

    Parameters
    ----------
    path : file to write
    throws : the measured throws
    notes : what a coach noted of the throws, as separate columns
    others : more columns by name, a cell for each throw; None is an empty cell
    """
    rows = [one.as_dict() for one in throws]
    names = list(ThrowMeasures(throw=0, stone=0, clock=0.0, direction=Direction.AWAY).as_dict())
    columns: dict[str, list[Any]] = {name: [row[name] for row in rows] for name in names}
    for name in NOTED:
        cells = [getattr(notes.get(one.throw, ThrowNote()), name) for one in throws]
        if any(cells):
            columns["stone_name" if name == "stone" else name] = list(cells)
    columns |= {name: list(cells) for name, cells in others.items()}
    write_table(path, {name: _column(cells) for name, cells in columns.items()})


def _column(cells: list[Any]) -> list[Any]:
    """Cells with rounded numbers, and with an empty text where a column of text has none."""
    blank = "" if any(isinstance(cell, str) for cell in cells) else None
    rounded = [round(cell, 5) if isinstance(cell, float) else cell for cell in cells]
    return [blank if cell is None else cell for cell in rounded]


def as_text(rows: ThrowRows) -> str:
    """Return the table for a terminal."""
    widths = [
        max(len(name), *(len(row[k]) for row in rows.rows)) for k, name in enumerate(rows.head)
    ]

    def line(cells: Sequence[str]) -> str:
        parts = (
            cell.rjust(width) if k in rows.numeric else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(cells, widths, strict=True))
        )
        return "  ".join(parts).rstrip()

    return "\n".join(line(row) for row in [rows.head, *rows.rows])


def handle_of(one: ThrowMeasures) -> str:
    """Return the handle of a right-hander, and the way the stone turned."""
    spin = one.spin
    if spin is None or abs(spin.value) * 3 < MIN_TURN or abs(spin.value) < 3 * (spin.sigma or 0.0):
        return NOT_SEEN if spin is None else "hardly turns"
    return f"{handles(spin.value)[0]} {'↺' if spin.value > 0 else '↻'}"


def rest_of(one: ThrowMeasures, units: Units | None = None, *, short: bool = False) -> str:
    """Describe the place of rest: past or short of the tee line, and beside the centre line.

    Parameters
    ----------
    one : the throw
    units : units of displayed lengths
    short : whether to omit the name of the tee line, where it is shown elsewhere
    """
    if one.past is None or one.right is None or one.from_tee is None:
        return NOT_SEEN
    if one.from_tee.value < 0.05:
        return "on the pin"
    along = side(one.past.value, units, right="past")
    if "tee" not in along and not short:
        along += " the tee" if one.past.value > 0 else " of the tee"
    across = side(one.right.value, units).replace("on the line", "on the centre line")
    place = f"{along}, {across}"
    if one.past.value < FAR_HOG + RULE_BOOK_STONE.radius:
        return f"hogged: {place}"
    through = one.past.value > HOUSE_RADIUS + RULE_BOOK_STONE.radius
    return f"through the house: {place}" if through else place


def throw_in_words(one: ThrowMeasures, units: Units | None = None) -> str:
    """Describe a throw in a sentence; empty where nothing of it was seen."""
    parts: list[str] = []
    if one.back_to_hog is not None:
        parts.append(f"split {_seconds(one.back_to_hog)}")
    if one.hog_to_hog is not None:
        parts.append(f"{_seconds(one.hog_to_hog)} hog to hog")
    elif one.speed is not None:
        parts.append(f"{speed(one.speed.value, units)} at the hog line")
    if one.spin is not None:
        parts.append(handle_of(one))
    if one.curl is not None:
        parts.append(f"curl {_side(one.curl, units, False, positive='left')}")
    if one.rests:
        parts.append(f"rests {rest_of(one, units)}")
    return ", ".join(parts)


def curl_in_words(throws: Sequence[ThrowMeasures], units: Units | None = None) -> list[str]:
    """Describe the curl of draws, by handle; empty where no draw came to rest near the house."""
    parts: list[str] = []
    for sign, name in ((-1, "in-turn"), (1, "out-turn")):
        curls = [
            sign * one.curl.value
            for one in throws
            if one.curl is not None
            and one.spin is not None
            and one.from_tee is not None
            and one.from_tee.value < 2 * HOUSE_RADIUS
            and sign * one.spin.value > MIN_TURN / 3
        ]
        if curls:
            spread = f" (from {length(min(curls), units)} to {length(max(curls), units)})"
            count = "one draw" if len(curls) == 1 else f"{len(curls)} draws"
            mean = float(np.mean(curls))
            way = "" if mean >= 0 else " against its turn"
            parts.append(f"{name} {length(mean, units)}{way} in {count}{spread * (len(curls) > 1)}")
    return [f"Curl of draws into or near the house: {'; '.join(parts)}."] if parts else []


def _errors(throws: Sequence[ThrowMeasures]) -> str:
    """Describe the precision of the numbers in one sentence; empty where it is unknown."""
    parts: list[str] = []
    for name, field in (("hog to hog", "hog_to_hog"), ("back line to hog", "back_to_hog")):
        sigmas = [
            value.sigma
            for one in throws
            if (value := getattr(one, field)) is not None and value.sigma is not None
        ]
        if sigmas:
            usual = max(float(np.median(sigmas)), 0.001)
            parts.append(f"{name} to about {usual:.3f} s")
    return f"Known are {' and '.join(parts)} (one standard error)." if parts else ""


def _seconds(value: Measured | None) -> str:
    if value is None:
        return NOT_SEEN
    # Times are shown to hundredths only if they are known to hundredths.
    digits = 2 if value.sigma is None or value.sigma < 0.02 else 1
    return f"{value.value:.{digits}f} s"


def _side(
    value: Measured | None, units: Units | None, errors: bool, *, positive: str = "right"
) -> str:
    if value is None:
        return NOT_SEEN
    beside = side(value.value, units, right=positive)
    if not errors or value.sigma is None or beside == "on the line":
        return beside
    return f"{beside} ± {short_length(value.sigma, units)}"
