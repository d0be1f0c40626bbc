"""Reading the stones that lie on the sheet from a file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.infrastructure.storage import read_json
from curling_env.typing import Flags, Floats


def read_stones(path: str | Path, *, teams_needed: bool = False) -> tuple[Floats, Flags | None]:
    """Read resting stones from `[{"x": …, "y": …, "team": "own" | "other"}, …]`.

    Parameters
    ----------
    path : the file
    teams_needed : whether each stone must say whose it is

    Returns
    -------
    places : (k, 2) centres, sheet frame [m]
    own : (k,) whether each belongs to the thrower's team, those that do not say it being the
        opponents'; None where no stone says whose it is

    Raises
    ------
    InputError : the file cannot be read, holds no list of places, or lacks a team that is needed
    """
    document = read_json(path)
    if not isinstance(document, list):
        raise InputError('expected a list of stones, [{"x": …, "y": …}, …]', source=path)
    places = [_place(stone, path, f"stone {k + 1}") for k, stone in enumerate(document)]
    teams = [_team(stone, path, f"stone {k + 1}") for k, stone in enumerate(document)]
    if teams_needed and None in teams:
        raise InputError(
            'no team: points need "team": "own" or "other" for each stone; '
            "`curling stones --own red` tells them apart by the colour of their handles",
            source=path,
            where=f"stone {teams.index(None) + 1}",
        )
    own = np.array([team == "own" for team in teams], dtype=np.bool_) if any(teams) else None
    return np.array(places, dtype=np.float64).reshape(-1, 2), own


def _place(stone: Any, path: str | Path, where: str) -> tuple[float, float]:
    if not isinstance(stone, dict) or not {"x", "y"} <= stone.keys():
        raise InputError("expected an object with x and y", source=path, where=where)
    x, y = stone["x"], stone["y"]
    for name, value in (("x", x), ("y", y)):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            problem = f"{name} must be a finite number of metres, got {value!r}"
            raise InputError(problem, source=path, where=where)
    return float(x), float(y)


def _team(stone: dict[str, Any], path: str | Path, where: str) -> str | None:
    team = stone.get("team")
    if team not in ("own", "other", None):
        raise InputError(f'team must be "own" or "other", got {team!r}', source=path, where=where)
    return team
