"""Writing text, JSON, tables and arrays, each of them completely or not at all.

`writing` decides where and how a file may appear.
"""

from __future__ import annotations

import csv
import importlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from curling_env.infrastructure.files.writing import atomic_path

_ROWS_AT_A_TIME = 100_000
"""Number of table rows converted to text at a time: as text they take much more memory."""


def write_text(path: str | Path, text: str) -> None:
    """Write text as UTF-8, completely or not at all.

    A surrogate, as in some file names, is written as its number.

    Raises
    ------
    OutputError : see `atomic_path`
    """
    with atomic_path(path) as draft:
        draft.write_text(text, encoding="utf-8", newline="\n", errors="backslashreplace")


def write_json(path: str | Path, document: Any) -> None:
    """Write JSON that people can read too: indented, with rows of plain values on one line.

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
    """Return the text that `write_json` writes, without the last newline; for results on stdout."""
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
    checked = [_column(name, values) for name, values in columns.items()]
    if len({len(column) for column in checked}) > 1:
        raise ValueError("columns of different length")
    if Path(path).suffix.lower() == ".parquet":
        arrow: Any = importlib.import_module("pyarrow")
        parquet: Any = importlib.import_module("pyarrow.parquet")
        cells = {n: _cells(column, None) for n, column in zip(columns, checked, strict=True)}
        with atomic_path(path) as draft:
            parquet.write_table(arrow.table(cells), draft)
        return
    with (
        atomic_path(path) as draft,
        draft.open("w", encoding="utf-8", newline="", errors="backslashreplace") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for begin in range(0, len(checked[0]) if checked else 0, _ROWS_AT_A_TIME):
            rows = slice(begin, begin + _ROWS_AT_A_TIME)
            writer.writerows(zip(*(_cells(column[rows], "") for column in checked), strict=True))


def write_arrays(path: str | Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays of numbers and text by name (.npz), completely or not at all.

    Raises
    ------
    OutputError : see `atomic_path`
    """
    with atomic_path(path) as draft, draft.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def _column(name: str, values: ArrayLike) -> NDArray[Any]:
    """Return the array of a column, checked for values that a table cannot hold."""
    column = np.asarray(values)
    if column.dtype == object:  # numbers mixed with None
        column = np.array([np.nan if value is None else value for value in column.tolist()])
    if column.dtype == np.bool_:
        column = column.astype(np.int64)
    if np.issubdtype(column.dtype, np.floating) and np.isinf(column).any():
        raise ValueError(f"column {name!r} contains an infinite number, which a table cannot hold")
    return column


def _cells(column: NDArray[Any], blank: str | None) -> list[Any]:
    """Format the cells of a column, blank for NaN."""
    if not np.issubdtype(column.dtype, np.floating):
        return column.tolist()
    return [blank if value != value else value for value in column.tolist()]


def _plain(value: Any) -> Any:
    """Return the same document made of JSON's own types."""
    if isinstance(value, np.ndarray | np.generic):
        return cast("Any", value.tolist())
    if isinstance(value, Mapping):
        items = cast("Mapping[Any, Any]", value)
        return {str(key): _plain(item) for key, item in items.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in cast("Sequence[Any]", value)]
    return str(value) if isinstance(value, Path) else value


def _layout(value: Any, margin: str) -> str:
    inner = margin + "  "
    if isinstance(value, dict) and value:
        members = cast("dict[str, Any]", value)
        body = (f"{inner}{_layout(key, inner)}: {_layout(v, inner)}" for key, v in members.items())
        return "{\n" + ",\n".join(body) + f"\n{margin}}}"
    if isinstance(value, list) and any(
        isinstance(v, list | dict) for v in cast("list[Any]", value)
    ):
        body = (inner + _layout(v, inner) for v in cast("list[Any]", value))
        return "[\n" + ",\n".join(body) + f"\n{margin}]"
    return json.dumps(value, allow_nan=False, ensure_ascii=False)
