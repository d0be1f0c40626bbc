"""Reading the stones that lie on the sheet from a file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.infrastructure.storage import read_json
from curling_env.typing import Flags, Floats


def read_stones(path: str | Path) -> tuple[Floats, Flags]:
    """Read resting stones from `[{"x": …, "y": …, "team": "own" | "other"}, …]`.

    Returns
    -------
    places : (k, 2) centres, sheet frame [m]
    own : (k,) whether each belongs to the thrower's team; without a team it is the opponents'

    Raises
    ------
    InputError : the file cannot be read, or holds no list of places
    """
    document = read_json(path)
    if not isinstance(document, list):
        raise InputError('expected a list of stones, [{"x": …, "y": …}, …]', source=path)
    places = [_place(stone, path, f"stone {k + 1}") for k, stone in enumerate(document)]
    own = [_is_own(stone, path, f"stone {k + 1}") for k, stone in enumerate(document)]
    return np.array(places, dtype=np.float64).reshape(-1, 2), np.array(own, dtype=np.bool_)


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


def _is_own(stone: dict[str, Any], path: str | Path, where: str) -> bool:
    team = stone.get("team", "other")
    if team not in ("own", "other"):
        raise InputError(f'team must be "own" or "other", got {team!r}', source=path, where=where)
    return team == "own"
