"""Reading and writing files.

A file is written completely or not at all. An error in a file that is read names its place; rows
are numbered as in an editor or a spreadsheet, where the header is row 1.
"""

from __future__ import annotations

import csv
import difflib
import errno
import hashlib
import importlib
import json
import os
import secrets
import shutil
import tempfile
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from curling_env.errors import InputError, OutputError
from curling_env.typing import Floats, Integers

MAX_INTEGER = 2**53
"""Largest whole number that a float64 holds exactly (IEEE 754)."""

_DISK_TROUBLE = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO})


# --- writing -----------------------------------------------------------------------------------


@contextmanager
def atomic_path(path: str | Path) -> Generator[Path]:
    """A temporary path to write to, which becomes `path` only if the block succeeds.

    It lies in the same directory and keeps the suffix, for writers that choose a format by suffix
    (video, pictures). A device or pipe is written to, never replaced.

    Raises
    ------
    OutputError : the directory is missing or not writable, or the disk is full
    """
    path = Path(path)
    # /dev/stdout may stand for a regular file, but one that the shell holds open.
    stream = path.exists() and (not path.is_file() or str(path.parent) in ("/dev", "/dev/fd"))
    if path.is_dir():
        raise OutputError(f"{path}: is a directory; expected the name of a file to write")
    # A link keeps pointing where it did: what it points at is replaced.
    target = path.resolve() if path.is_symlink() and not stream else path
    directory = Path(tempfile.gettempdir()) if stream else target.parent
    if not directory.is_dir():
        raise OutputError(f"{path}: cannot be written: no directory {directory}")
    draft = directory / f".{target.stem[:80]}-{secrets.token_hex(4)}{target.suffix}"
    try:
        # Created at once: an unwritable directory is found before the long work, not after it.
        draft.touch(exist_ok=False)
        yield draft
        _settle(draft)
        if stream:
            with draft.open("rb") as source, path.open("ab") as sink:
                shutil.copyfileobj(source, sink)
        else:
            draft.replace(target)
    except OutputError:
        raise
    except OSError as error:
        if _is_about(error, draft) or _is_about(error, path):
            raise OutputError(f"{path}: cannot be written: {_reason(error)}") from error
        raise
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def make_directory(path: str | Path) -> Path:
    """A directory for results, made with its parents if it does not exist.

    Raises
    ------
    OutputError : it cannot be made, or a file is in its place
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "a file is in its place" if path.is_file() else _reason(error)
        raise OutputError(f"{path}: cannot make this directory: {reason}") from error
    return path


def write_text(path: str | Path, text: str) -> None:
    """Write text as UTF-8, completely or not at all.

    Raises
    ------
    OutputError : see `atomic_path`
    """
    with atomic_path(path) as draft:
        draft.write_text(text, encoding="utf-8", newline="\n")


def write_json(path: str | Path, document: Any) -> None:
    """Write JSON that people can read too: indented, with a row of plain values on one line.

    Parameters
    ----------
    document : dicts, lists, text, numbers, booleans, None, and NumPy scalars and arrays

    Raises
    ------
    ValueError : NaN or infinity, which JSON cannot hold
    OutputError : see `atomic_path`
    """
    write_text(path, format_json(document) + "\n")


def format_json(document: Any) -> str:
    """The text that `write_json` writes, without its last newline; for results on stdout."""
    return _layout(_plain(document), "")


def write_table(path: str | Path, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns of equal length with a header, completely or not at all.

    A path that ends in .parquet becomes Parquet (the extra `parquet`), any other CSV. NaN and None
    become empty cells.

    Raises
    ------
    ValueError : columns of different length, or an infinite number
    OutputError : see `atomic_path`
    """
    cells = [_cells(name, values) for name, values in columns.items()]
    if Path(path).suffix.lower() == ".parquet":
        _write_parquet(path, dict(zip(columns, cells, strict=True)))
        return
    with atomic_path(path) as draft, draft.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*cells, strict=True))


# --- reading -----------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Table:
    """A CSV file as text by column; columns become numbers on request.

    Parameters
    ----------
    source : the file
    columns : one stripped text per row for each column asked for
    rows : row numbers as in an editor (the header is row 1)
    optional : names of the columns in which a cell may be empty
    """

    source: str
    columns: Mapping[str, Sequence[str]]
    rows: Sequence[int]
    optional: frozenset[str] = frozenset()

    def __len__(self) -> int:
        return len(self.rows)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def where(self, index: int, name: str | None = None) -> str:
        """The place of a cell or row for an error message, such as ``row 12, column y``."""
        row = f"row {self.rows[index]}"
        return row if name is None else f"{row}, column {name}"

    def text(self, name: str) -> Sequence[str]:
        """The column as in the file, without spaces around its cells."""
        return self.columns[name]

    def numbers(self, name: str, *, blank: bool | None = None) -> Floats:
        """The column as numbers.

        Parameters
        ----------
        blank : whether an empty cell (or ``nan``) is accepted, as NaN; None: in optional columns

        Returns
        -------
        (n,) : finite, or NaN where blank

        Raises
        ------
        InputError : naming row and column, for text that is no finite number
        """
        cells = self.columns[name]
        allowed = name in self.optional if blank is None else blank
        try:
            values = np.array([float(cell) if cell else np.nan for cell in cells], dtype=np.float64)
        except ValueError:
            values = np.array([_number_or_inf(cell) for cell in cells], dtype=np.float64)
        bad = np.isinf(values) if allowed else ~np.isfinite(values)
        if bad.any():
            index = int(np.argmax(bad))
            raise InputError(
                f"expected a number, found {_quoted(cells[index])}",
                source=self.source,
                where=self.where(index, name),
            )
        return values

    def integers(self, name: str) -> Integers:
        """The column as whole numbers; ``3.0`` counts as 3.

        Raises
        ------
        InputError : naming row and column, for an empty cell or anything that is not whole
        """
        values = self.numbers(name, blank=False)
        bad = (values != np.round(values)) | (np.abs(values) > MAX_INTEGER)
        if bad.any():
            index = int(np.argmax(bad))
            raise InputError(
                f"expected a whole number, found {_quoted(self.columns[name][index])}",
                source=self.source,
                where=self.where(index, name),
            )
        return values.astype(np.int64)


def read_text(path: str | Path) -> str:
    """The text of a UTF-8 file.

    Raises
    ------
    InputError : missing, a directory, unreadable, or not text
    """
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise InputError("no such file", source=path) from error
    except UnicodeDecodeError as error:
        raise InputError("not a text file (expected UTF-8)", source=path) from error
    except OSError as error:
        raise InputError(f"cannot be read: {_reason(error)}", source=path) from error


def file_digest(path: str | Path) -> str:
    """A short digest of the content of a text file, the same wherever the file lies.

    Raises
    ------
    InputError : see `read_text`
    """
    return hashlib.sha256(read_text(path).encode()).hexdigest()[:16]


def read_json(path: str | Path) -> Any:
    """The document of a JSON file.

    Raises
    ------
    InputError : unreadable, not JSON (with row and column), NaN or infinity, or nested too deep
    """
    text = read_text(path)

    def refuse(constant: str) -> None:
        raise InputError(f"{constant} is not a JSON number", source=path)

    try:
        return json.loads(text, parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise InputError(
            f"not JSON: {error.msg}", source=path, where=f"row {error.lineno}, column {error.colno}"
        ) from error
    except RecursionError as error:
        raise InputError("not a usable JSON file: nested too deep", source=path) from error


def read_table(path: str | Path, *, required: Iterable[str], optional: Iterable[str] = ()) -> Table:
    """A CSV file with a header.

    Other columns than the `required` and `optional` ones are left out, so that a file may hold
    more. But a column that looks like an absent optional one is refused, because a misspelt header
    would otherwise change the result silently.

    Raises
    ------
    InputError : unreadable, a required column missing, one given twice, a row too short or long
    """
    required, optional = tuple(required), tuple(optional)
    lines = csv.reader(read_text(path).splitlines(), strict=True)
    rows: list[int] = []
    records: list[list[str]] = []
    try:
        header = [name.strip() for name in next(lines, cast("list[str]", []))]
        for record in lines:
            if not record:
                continue  # an empty line, usually the last
            if len(record) != len(header):
                raise InputError(
                    f"expected {len(header)} cells as in the header, found {len(record)}",
                    source=path,
                    where=f"row {lines.line_num}",
                )
            rows.append(lines.line_num)
            records.append(record)
    except csv.Error as error:
        raise InputError(
            f"not a CSV table: {error}", source=path, where=f"row {lines.line_num}"
        ) from error
    _check_header(path, header, required, optional)
    columns = {
        name: [record[position].strip() for record in records]
        for position, name in enumerate(header)
        if name in required or name in optional
    }
    return Table(source=str(path), columns=columns, rows=rows, optional=frozenset(optional))


def _check_header(
    path: str | Path, header: Sequence[str], required: Sequence[str], optional: Sequence[str]
) -> None:
    if not any(header):
        raise InputError("is empty; expected a header row", source=path)
    missing = [name for name in required if name not in header]
    if missing:
        raise InputError(
            f"missing column{'s' if len(missing) > 1 else ''} {', '.join(missing)}; "
            f"the header names {', '.join(header)}",
            source=path,
            where="row 1",
        )
    twice = [name for name in (*required, *optional) if header.count(name) > 1]
    if twice:
        raise InputError(f"column {twice[0]} is given twice", source=path, where="row 1")
    absent = [name for name in optional if name not in header]
    for name in header:
        if name in required or name in optional:
            continue
        near = difflib.get_close_matches(name.lower(), absent, n=1, cutoff=0.8)
        if near:
            raise InputError(
                f"unknown column {_quoted(name)}; did you mean {near[0]}?",
                source=path,
                where="row 1",
            )


def _number_or_inf(cell: str) -> float:
    """The number in a cell; infinity for other text, so that the bad cell is found."""
    try:
        return float(cell) if cell else float("nan")
    except ValueError:
        return float("inf")


def _quoted(text: str) -> str:
    """A cell for a one-line message, cut when it is long."""
    return "an empty cell" if not text else repr(text if len(text) <= 40 else text[:37] + "...")


# --- details of writing ------------------------------------------------------------------------


def _settle(draft: Path) -> None:
    """Force the bytes to the disk, where a full disk may only now be noticed."""
    with draft.open("rb+") as file:
        os.fsync(file.fileno())


def _is_about(error: OSError, path: Path) -> bool:
    return (
        error.errno in _DISK_TROUBLE
        or error.filename is None
        or str(cast("object", error.filename)) == str(path)
    )


def _reason(error: OSError) -> str:
    return (error.strerror or str(error) or type(error).__name__).lower()


def _write_parquet(path: str | Path, columns: Mapping[str, list[Any]]) -> None:
    """Write the columns that `_cells` makes as Parquet."""
    arrow: Any = importlib.import_module("pyarrow")
    parquet: Any = importlib.import_module("pyarrow.parquet")
    table = arrow.table(
        {name: [None if v == "" else v for v in cells] for name, cells in columns.items()}
    )
    with atomic_path(path) as draft:
        parquet.write_table(table, draft)


def _cells(name: str, values: ArrayLike) -> list[Any]:
    column = np.asarray(values)
    if column.dtype == object:  # numbers mixed with None
        column = np.array([np.nan if value is None else value for value in column.tolist()])
    if column.dtype == np.bool_:
        column = column.astype(np.int64)
    if not np.issubdtype(column.dtype, np.floating):
        return column.tolist()
    if np.isinf(column).any():
        raise ValueError(f"column {name!r} holds an infinite number, which a table cannot carry")
    return ["" if value != value else value for value in column.tolist()]


def _plain(value: Any) -> Any:
    """The same document made of the types of JSON only."""
    if isinstance(value, np.ndarray | np.generic):
        return cast("Any", value.tolist())
    if isinstance(value, Mapping):
        items = cast("Mapping[Any, Any]", value)
        return {str(key): _plain(item) for key, item in items.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in cast("Sequence[Any]", value)]
    if isinstance(value, Path):
        return str(value)
    return value


def _layout(value: Any, margin: str) -> str:
    inner = margin + "  "
    if isinstance(value, dict) and value:
        members = cast("dict[str, Any]", value)
        body = (f"{inner}{json.dumps(key)}: {_layout(v, inner)}" for key, v in members.items())
        return "{\n" + ",\n".join(body) + f"\n{margin}}}"
    if isinstance(value, list) and any(
        isinstance(v, list | dict) for v in cast("list[Any]", value)
    ):
        body = (inner + _layout(v, inner) for v in cast("list[Any]", value))
        return "[\n" + ",\n".join(body) + f"\n{margin}]"
    return json.dumps(value, allow_nan=False, ensure_ascii=False)
