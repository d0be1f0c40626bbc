"""The table of published measurements: real ice, real stones and real play beside ours.

python scripts/validation.py                  the table as text
python scripts/validation.py --json           JSON list of rows, each with `ice` (or null)

docs/validation.md tells of every row.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Annotated, Any

import typer

from curling_env.commands.cli import print_json
from curling_env.errors import CurlingError
from curling_env.ice import load_ice
from curling_env.validation import OTHER_ROWS, Comparison, Row, compare
from curling_env.validation.table import as_text, in_words, preset_of

ROWS_OF_NO_ICE: tuple[Row, ...] = OTHER_ROWS
"""Rows that are the same on every ice. Those of long experiments read a result that is kept."""


def tables(ices: Iterable[str]) -> dict[str | None, list[Comparison]]:
    """The rows of each ice by its name, and under None those that no ice changes."""
    found: dict[str | None, list[Comparison]] = {
        name: compare(load_ice(name), preset_of(name)) for name in ices
    }
    found[None] = compare(load_ice("standard"), "standard", ROWS_OF_NO_ICE)
    return found


def as_documents(found: dict[str | None, list[Comparison]]) -> list[dict[str, Any]]:
    """The rows as one list, each with the ice that it is of."""
    return [{"ice": ice, **row.as_dict()} for ice, rows in found.items() for row in rows]


def main(
    ice: Annotated[
        list[str] | None, typer.Option(help="An ice file or a preset; repeat it for several.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="JSON instead of text.")] = False,
) -> None:
    """Print the table of published measurements."""
    found = tables(ice or ["standard", "fcv1"])
    if as_json:
        print_json(as_documents(found))
        return
    for name, rows in found.items():
        if rows:
            title = "the same on every ice" if name is None else f"ice: {name}"
            print(f"{title}\n{'=' * len(title)}\n{as_text(rows)}\n\n{in_words(rows)}\n")


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        sys.exit(f"validation: {error}")
