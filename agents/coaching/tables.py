"""Files of the coaching results."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from agents.coaching.athletes import AthleteErrors
from agents.coaching.misses.causes import SessionCauses
from curling_env.game.skill_file import save_skill
from curling_env.infrastructure.files.storage import write_table
from curling_env.infrastructure.files.writing import make_directory, together
from curling_env.infrastructure.provenance import provenance

ERRORS_TABLE = "athlete_errors.csv"
"""Name of the table of all athletes' errors."""


def write_causes(path: str | Path, found: SessionCauses) -> None:
    """Write a row for each throw as CSV: the miss, and every part with its standard error [m].

    Parameters
    ----------
    path : file to write
    found : result of `hand_or_ice`
    """
    write_table(path, _columns([one.as_dict() for one in found.throws]))


def write_athletes(
    folder: str | Path,
    found: Sequence[AthleteErrors],
    inputs: Sequence[str | Path] = (),
    *,
    seed: int | None = None,
) -> list[Path]:
    """Write the table of errors, and a skill file for each athlete; return the files.

    Parameters
    ----------
    folder : output folder; made if missing
    found : result of `athlete_errors`
    inputs : input files of the result, for the provenance in the skill files
    seed : seed of the draws, for the provenance too
    """
    folder = make_directory(folder)
    table = folder / ERRORS_TABLE
    rows: list[dict[str, Any]] = []
    for one in found:
        for group in (one.overall, *one.groups):
            rows.append({"athlete": one.name, **group.as_dict()})
    files = [table]
    origin = provenance(inputs, seed=seed)
    with together():
        write_table(table, _columns(rows))
        for name, one in zip(_file_names(found), found, strict=True):
            files.append(folder / f"{name}.skill.json")
            save_skill(one.skill, files[-1], provenance=origin)
    return files


def _columns(rows: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    """Return rows as columns, with numbers rounded to their precision and empty cells for missing
    ones.
    """
    names = dict.fromkeys(name for row in rows for name in row)
    columns: dict[str, list[Any]] = {}
    for name in names:
        cells = [row.get(name) for row in rows]
        blank: Any = "" if any(isinstance(cell, str) for cell in cells) else np.nan
        columns[name] = [
            blank if cell is None else round(cell, 5) if isinstance(cell, float) else cell
            for cell in cells
        ]
    return columns


def _file_names(found: Sequence[AthleteErrors]) -> list[str]:
    """Return a unique file name for each athlete, from letters that every disk accepts."""
    names: list[str] = []
    for one in found:
        plain = re.sub(r"[^\w-]+", "_", one.name, flags=re.UNICODE).strip("_")[:60] or "athlete"
        taken = {name.casefold() for name in names}
        count = 2
        name = plain
        while name.casefold() in taken:
            name, count = f"{plain}-{count}", count + 1
        names.append(name)
    return names
