"""Options that the coaching commands share, and the sessions that they name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from curling_env.commands.options import output_to
from curling_env.commands.outputs import Writes
from curling_env.errors import InputError

if TYPE_CHECKING:
    from agents.coaching.misses.causes import SessionCauses
    from curling_env.typing import Progress

TracksArgument = Annotated[
    Path,
    Argument(metavar="TRACKS.csv", help="Tracks, with a table throws.csv beside them."),
]
BELIEVED = Option(metavar="ICE", help="Ice that the team planned with, such as the morning's.")
TableOption = Annotated[
    Path | None, output_to("FILE.csv", "Also write the table, in metres."), Writes()
]


def refuse_throw_list(output: Path | None, tracks: Path) -> None:
    """Refuse to write a table over the list of throws beside the tracks.

    Raises
    ------
    InputError : the output is that list
    """
    from friction_estimation.tracks.throw_list import THROW_LIST

    if output is not None and output.resolve() == (tracks.parent / THROW_LIST).resolve():
        raise InputError("is where the calls stand; name the table otherwise", source=output)


def causes_of(
    tracks: Path, ice: str, believed: str | None, seed: int, progress: Progress
) -> SessionCauses:
    """Find the causes of the misses of one session.

    Parameters
    ----------
    tracks : its tracks, with throws.csv and athletes.csv beside them
    ice : its ice, a file or a preset
    believed : the ice that the team planned with
    seed : seed of the random errors
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
        problem = (
            f"no table {THROW_LIST} beside these tracks says what was called; its columns are "
            'throw, athlete and called, such as "draw 0.3,-1.2 in"'
        )
        raise InputError(problem, source=tracks)
    return hand_or_ice(
        load_tracks(tracks),
        load_ice(ice),
        notes,
        believed=None if believed is None else load_ice(believed),
        hands=hands_beside(tracks),
        seed=seed,
        progress=progress,
    )
