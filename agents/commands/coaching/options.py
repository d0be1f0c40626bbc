"""Options that the coaching commands share, and the sessions that they name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import Writes
from curling_env.errors import InputError

if TYPE_CHECKING:
    from agents.coaching.misses.causes import SessionCauses
    from curling_env.typing import Progress

TracksArgument = Annotated[
    Path,
    typer.Argument(
        metavar="TRACKS.csv",
        help="From `curling track`; a table throws.csv beside it says who threw what.",
    ),
]
PictureOption = Annotated[
    Path | None,
    typer.Option("--picture", metavar="P.png", help="Also draw it."),
    Writes(kinds=("picture",)),
]
BelievedOption = Annotated[
    str | None,
    typer.Option(
        metavar="ICE",
        help="The ice that the team planned with: what it took the ice for, such as the morning's "
        "ice file. Without it nothing is laid to the reading of the ice, unless a broom or a time "
        "was called.",
    ),
]


def causes_of(
    tracks: Path, ice: str, believed: str | None, seed: int, progress: Progress
) -> SessionCauses:
    """Why the throws of one session missed.

    Parameters
    ----------
    tracks : its tracks, with throws.csv and athletes.csv beside them
    ice : its ice, a file or a preset
    believed : the ice that the team took for true
    seed : seed of the errors drawn
    progress : called with the number of throws done

    Raises
    ------
    InputError : a file that cannot be read, or a session without calls
    """
    from agents.coaching.misses.hand_or_ice import hand_or_ice
    from agents.coaching.throw_sheet import hands_beside
    from curling_env.ice import load_ice
    from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside

    notes = throws_beside(tracks)
    if not any(note.called for note in notes.values()):
        raise InputError(
            f"no table {THROW_LIST} beside these tracks says what was called; its columns are "
            'throw, athlete and called, such as "draw 0.3,-1.2 in"',
            source=tracks,
        )
    return hand_or_ice(
        load_tracks(tracks),
        load_ice(ice),
        notes,
        believed=None if believed is None else load_ice(believed),
        hands=hands_beside(tracks),
        seed=seed,
        progress=progress,
    )
