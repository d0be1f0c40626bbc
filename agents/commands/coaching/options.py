"""Options that the coaching commands share."""

from __future__ import annotations

from os.path import realpath
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from curling_env.commands.options import output_to
from curling_env.commands.outputs import Writes
from curling_env.errors import InputError

TracksArgument = Annotated[
    Path,
    Argument(metavar="TRACKS.csv", help="Tracks; a table throws.csv may be in the same folder."),
]
BELIEVED = Option(metavar="ICE", help="Ice that the team planned with, such as this morning's.")
TableOption = Annotated[
    Path | None, output_to("FILE.csv", "Also write the table, in metres."), Writes()
]


def refuse_throw_list(output: Path | None, tracks: Path) -> None:
    """Refuse to overwrite the list of throws next to the tracks.

    Raises
    ------
    InputError : the output is that list
    """
    from friction_estimation.tracks.throw_list import THROW_LIST

    if output is not None and realpath(output) == realpath(tracks.parent / THROW_LIST):
        raise InputError(
            "contains the notes of the throws; expected another name for the table", source=output
        )
