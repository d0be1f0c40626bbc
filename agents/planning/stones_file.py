"""Reader of files with the stones on the sheet."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np

from curling_env.errors import InputError, placed
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.schema import checked, within
from curling_env.typing import Flags, Floats

MOST_STONES = 64
"""Maximum number of stones on a sheet; a game has sixteen."""


class StoneDocument(msgspec.Struct, kw_only=True):
    """Resting stone; `curling stones` writes more fields, which are ignored here."""

    x: Annotated[float, within(-1e3, 1e3, "m")]
    y: Annotated[float, within(-1e3, 1e3, "m")]
    team: Literal["own", "other"] | None = None
    doubtful: bool = False


def read_stones(path: str | Path, *, teams_needed: bool = False) -> tuple[Floats, Flags | None]:
    """Read resting stones from `[{"x": …, "y": …, "team": "own" | "other"}, …]`.

    Stones with `"doubtful": true` are not read, see `count_doubtful`.

    Parameters
    ----------
    path : the file
    teams_needed : require a team for each stone

    Returns
    -------
    places : (k, 2) centres, sheet frame [m]
    own : (k,) true for stones of the thrower's team, false for others and for stones without a
        team; None if no stone has a team

    Raises
    ------
    InputError : the file cannot be read, is not a list of places, or lacks a required team
    """
    listed = _documents(path)
    stones = [stone for stone in listed if not stone.doubtful]
    teams = [stone.team for stone in stones]
    if teams_needed and None in teams:
        raise InputError(
            'no team: points need "team": "own" or "other" for each stone; '
            "`curling stones --own red` assigns them by the colour of their handles",
            source=path,
            where=f"stone {listed.index(stones[teams.index(None)]) + 1}",
        )
    own = np.array([team == "own" for team in teams], dtype=np.bool_) if any(teams) else None
    places = np.array([(stone.x, stone.y) for stone in stones], dtype=np.float64)
    return places.reshape(-1, 2), own


def count_doubtful(path: str | Path) -> int:
    """Return the number of stones in a file that may be something else.

    Raises
    ------
    InputError : the file cannot be read, or is not a list of places
    """
    return sum(stone.doubtful for stone in _documents(path))


def _documents(path: str | Path) -> list[StoneDocument]:
    document = read_json(path)
    if not isinstance(document, list):
        raise InputError('expected a list of stones, [{"x": …, "y": …}, …]', source=path)
    if len(document) > MOST_STONES:
        raise InputError(
            f"lists {len(document)} stones; expected at most {MOST_STONES}", source=path
        )
    with placed(source=path):
        return [
            checked(stone, StoneDocument, inside=f"stone {k + 1}")
            for k, stone in enumerate(document)
        ]
