"""Files of what the coaching functions found."""

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
    found : what `hand_or_ice` told
    """
    write_table(path, _columns([one.as_dict() for one in found.throws]))


def write_athletes(
    folder: str | Path,
    found: Sequence[AthleteErrors],
    inputs: Sequence[str | Path] = (),
    *,
    seed: int | None = None,
) -> list[Path]:
    """Write the table of errors, and a skill file for each athlete; returns the files.

    Parameters
    ----------
    folder : where to; made if it is not there
    found : what `athlete_errors` told
    inputs : files that it was told from, for the skill files
    seed : of the draws, the same
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
    """Rows as columns; numbers rounded to what they are worth, empty cells where there is none."""
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
    """A name for the file of each athlete, from letters that every disk takes; no two alike."""
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
