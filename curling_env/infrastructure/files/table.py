"""Tables with a header from CSV files: text by column, converted to numbers on request."""

from __future__ import annotations

import csv
import difflib
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.reading import read_text
from curling_env.typing import Flags, Floats, Integers

MAX_INTEGER = 2**53
"""Largest whole number that a float64 holds exactly (IEEE 754)."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """Column of a table and the range of its numbers.

    Parameters
    ----------
    name : name in the header
    unit : unit of its numbers; empty for a count or a name
    low, high : bounds of its numbers, far beyond what is measured
    required : true if a table must have it
    """

    name: str
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    required: bool = True


@dataclass(frozen=True, kw_only=True)
class Table:
    """CSV file as text by column; columns become numbers on request.

    Parameters
    ----------
    source : the file
    columns : one stripped text per row for each column asked for
    rows : row numbers as in an editor (the header is row 1)
    known : known columns by name; cells of one that is not required may be empty
    """

    source: str
    columns: Mapping[str, Sequence[str]]
    rows: Sequence[int]
    known: Mapping[str, Column] = field(default_factory=dict[str, Column])

    def __len__(self) -> int:
        return len(self.rows)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def where(self, index: int, name: str | None = None) -> str:
        """Return the place of a cell or row for an error message, such as ``row 12, column y``."""
        row = f"row {self.rows[index]}"
        return row if name is None else f"{row}, column {name}"

    def text(self, name: str) -> Sequence[str]:
        """Return the column as text, without spaces around its cells."""
        return self.columns[name]

    def numbers(self, name: str, *, blank: bool | None = None) -> Floats:
        """Return the column as numbers.

        Parameters
        ----------
        blank : accept an empty cell (or ``nan``) as NaN; None: in optional columns

        Returns
        -------
        (n,) : finite, or NaN where blank

        Raises
        ------
        InputError : naming row and column, for text that is not a number, or a number out of the
            column's range
        """
        cells = self.columns[name]
        try:
            if not is_plain("".join(cells)):
                raise ValueError
            values = np.array([float(cell) if cell else np.nan for cell in cells], dtype=np.float64)
        except ValueError:  # some cell is no number
            values = np.array([_number_or_inf(cell) for cell in cells], dtype=np.float64)
        column = self.known.get(name, Column(name=name))
        allowed = not column.required if blank is None else blank
        self._refuse(np.isinf(values) if allowed else ~np.isfinite(values), name, "a number")
        unit = f" {column.unit}" if column.unit else ""
        bounds = f"a number from {column.low:g} to {column.high:g}{unit}"
        self._refuse((values < column.low) | (values > column.high), name, bounds)
        return values

    def integers(self, name: str) -> Integers:
        """Return the column as whole numbers; ``3.0`` counts as 3.

        Raises
        ------
        InputError : naming row and column, for an empty cell or anything but a whole number
        """
        values = self.numbers(name, blank=False)
        bad = (values != np.round(values)) | (np.abs(values) > MAX_INTEGER)
        self._refuse(bad, name, "a whole number")
        return values.astype(np.int64)

    def _refuse(self, bad: Flags, name: str, expected: str) -> None:
        """Refuse the first bad cell of a column, if any."""
        if bad.any():
            index = int(np.argmax(bad))
            found = quoted(self.columns[name][index])
            raise InputError(
                f"expected {expected}, found {found}",
                source=self.source,
                where=self.where(index, name),
            )


def read_table(
    path: str | Path,
    *,
    required: Iterable[str] = (),
    optional: Iterable[str] = (),
    columns: Sequence[Column] = (),
    empty_rows: bool = True,
) -> Table:
    """Read a CSV file with a header.

    Columns other than the requested ones are ignored, so that a file may have more. But a column
    that looks like an absent optional one is refused, because a misspelt header would otherwise
    change the result silently.

    Parameters
    ----------
    required, optional : names of columns
    columns : further columns with a known range
    empty_rows : skip empty rows; the last one is always skipped

    Raises
    ------
    InputError : unreadable, a required column missing, one given twice, a row too short or long,
        more rows or longer cells than `limits` allow
    """
    known = {name: Column(name=name, required=False) for name in optional}
    known |= {name: Column(name=name) for name in required}
    known |= {column.name: column for column in columns}

    def refuse(problem: str, row: int | None = None) -> NoReturn:
        raise InputError(problem, source=path, where=None if row is None else f"row {row}")

    text = read_text(path)
    width = text.partition("\n")[0].count(",") + 1
    if width > limits.MAX_COLUMNS:
        refuse(f"has {width} columns; expected at most {limits.MAX_COLUMNS}", 1)
    lines = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows: list[int] = []
    kept: list[list[str]] = []
    blank_row = 0
    longest_before = csv.field_size_limit(limits.MAX_CELL)
    try:
        header = [name.strip() for name in next(lines, list[str]())]
        wanted = [i for i, name in enumerate(header) if name in known]
        for record in lines:
            if not record:
                blank_row = blank_row or lines.line_num
                continue  # an empty line, usually the last
            if blank_row and not empty_rows:
                refuse("is empty", blank_row)
            if len(record) != len(header):
                found = f"found {len(record)}"
                refuse(f"expected {len(header)} cells as in the header, {found}", lines.line_num)
            if len(rows) == limits.MAX_ROWS:
                refuse(f"has too many rows; expected at most {limits.MAX_ROWS}")
            rows.append(lines.line_num)
            kept.append([record[i] for i in wanted])
    except csv.Error as error:
        longer = f"a cell is too long; expected at most {limits.MAX_CELL} characters"
        problem = longer if "field limit" in str(error) else str(error)
        refuse(f"not a CSV table: {problem}", lines.line_num)
    finally:
        csv.field_size_limit(longest_before)
    _check_header(path, header, known)
    return Table(
        source=str(path),
        columns={header[i]: [row[k].strip() for row in kept] for k, i in enumerate(wanted)},
        rows=rows,
        known=known,
    )


def is_plain(text: str) -> bool:
    """Return whether a text has only the characters of a number in a file.

    Python also reads ``1_000`` and digits of other scripts, which are errors in a table.
    """
    return text.isascii() and "_" not in text


def quoted(text: str) -> str:
    """Return a cell for a one-line message, cut if it is long."""
    return "an empty cell" if not text else repr(text if len(text) <= 40 else text[:37] + "...")


def _check_header(path: str | Path, header: Sequence[str], known: Mapping[str, Column]) -> None:
    if not any(header):
        raise InputError("is empty; expected a header row", source=path)
    problem = ""
    absent = [name for name in known if name not in header]
    missing = [name for name in absent if known[name].required]
    twice = [name for name in known if header.count(name) > 1]
    if missing:
        problem = (
            f"missing column{'s' if len(missing) > 1 else ''} {', '.join(missing)}; "
            f"the header has {', '.join(name[:20] for name in header[:12])}"
        )
    elif twice:
        problem = f"column {twice[0]} is given twice"
    for name in [name for name in header if name not in known]:
        near = difflib.get_close_matches(name.lower()[:40], absent, n=1, cutoff=0.8)
        if near and not problem:
            problem = f"unknown column {quoted(name)}; did you mean {near[0]}?"
    if problem:
        raise InputError(problem, source=path, where="row 1")


def _number_or_inf(cell: str) -> float:
    """Return the number in a cell; infinity for other text, so that the bad cell is found."""
    try:
        return (float(cell) if is_plain(cell) else np.inf) if cell else float("nan")
    except ValueError:
        return float("inf")
