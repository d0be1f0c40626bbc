"""A coach's notes on each throw, in a table `throws.csv` in the folder of the tracks.

Its columns are `athlete, stone, called, note`, all of which may be missing or empty, and `throw`,
the number of the throw in the tracks; without that column its rows are the throws in order of play.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from types import MappingProxyType

from curling_env.errors import InputError
from curling_env.infrastructure.files.table import read_table
from curling_env.trajectory import Trajectory, read_tracks

THROW_LIST = "throws.csv"
"""Name of the table, in the folder of the tracks."""
NOTED = ("athlete", "stone", "called", "note")
"""Its columns in addition to the number of the throw."""
MAX_THROWS = 10_000
"""Maximum number of throws in one file: more than a club makes in a season."""
NO_NOTES: Mapping[int, ThrowNote] = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class ThrowNote:
    """Notes on a throw; empty for missing ones.

    Parameters
    ----------
    athlete : the thrower
    stone : the stone, by any name
    called : the called shot
    note : anything else
    """

    athlete: str = ""
    stone: str = ""
    called: str = ""
    note: str = ""

    @property
    def row(self) -> dict[str, str]:
        """Return the notes except the stone, by column, to join a table of throws."""
        columns = {name: getattr(self, name) for name in NOTED if name != "stone"}
        return {name: value for name, value in columns.items() if value}


def throws_beside(tracks: str | Path) -> Mapping[int, ThrowNote]:
    """Return the notes on the throws of a tracks file, by their numbers; empty without a table.

    Raises
    ------
    InputError : a table that cannot be read, that has none of its columns, or a throw given twice
    """
    path = Path(tracks).parent / THROW_LIST
    if not os.path.lexists(path):
        return NO_NOTES
    table = read_table(path, required=(), optional=("throw", *NOTED))
    given = [name for name in NOTED if name in table]
    if not given:
        raise InputError(f"has none of the columns {', '.join(NOTED)}", source=path, where="row 1")
    numbers = table.integers("throw").tolist() if "throw" in table else list(range(len(table)))
    notes: dict[int, ThrowNote] = {}
    for k, number in enumerate(numbers):
        if number in notes:
            raise InputError(
                f"throw {number} appears twice", source=path, where=table.where(k, "throw")
            )
        notes[number] = ThrowNote(**{name: table.text(name)[k] for name in given})
    return notes


def load_tracks(path: str | Path) -> list[Trajectory]:
    """Load the tracks of a file, with the stones from its table of notes.

    Raises
    ------
    InputError : see `read_tracks` and `throws_beside`, or too many throws
    """
    tracks = read_tracks(path)
    count = len({track.throw for track in tracks})
    if count > MAX_THROWS:
        raise InputError(f"has {count} throws; expected at most {MAX_THROWS}", source=path)
    return with_noted_stones(tracks, throws_beside(path))


def with_noted_stones(
    tracks: Sequence[Trajectory], notes: Mapping[int, ThrowNote]
) -> list[Trajectory]:
    """Return tracks whose thrown stones have the noted numbers.

    Names that are not all whole numbers are numbered in order of play.

    Parameters
    ----------
    tracks : tracks of a session; the thrown stone comes first in each throw
    notes : see `throws_beside`
    """
    names = [note.stone for _, note in sorted(notes.items()) if note.stone]
    if not names:
        return list(tracks)
    whole = all(name.isdecimal() for name in names)
    number = {name: int(name) if whole else k for k, name in enumerate(dict.fromkeys(names))}
    found: list[Trajectory] = []
    for throw, group in groupby(tracks, key=lambda track: track.throw):
        thrown, *others = group
        noted = notes.get(throw, ThrowNote()).stone
        stone = number[noted] if noted else thrown.stone
        found.append(replace(thrown, stone=stone))
        # Two stones of a throw never share a number.
        found += [replace(k, stone=thrown.stone) if k.stone == stone else k for k in others]
    return found
