"""`curling simulate`: the true paths of given releases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import IceOption, TracksFile, progress_bar, say


def simulate(
    ice: IceOption,
    releases: Annotated[
        Path,
        typer.Option(
            metavar="R.csv", help="Releases, a table with columns throw,x,y,vx,vy,theta,omega."
        ),
    ],
    output: TracksFile,
    fps: Annotated[
        float, typer.Option(min=0.1, max=10_000, help="Rows per second of the tracks.")
    ] = 30.0,
) -> None:
    """Throw stones one after the other on an empty sheet and write their paths.

    A path begins at the release and ends where the stone rests or touches the edge of the ice. The
    throws are made in the order of the file. The ice changes from throw to throw if its effects say
    so, for instance where earlier stones have worn it (pebble_wear). Positions are true ones:
    effects of the measurement in the ice file, such as a lens, do not change them.

    Releases are in the frame of the sheet: origin mid-sheet, y towards the away end, lengths in
    metres, angles in radians. Optional columns are stone, clock (seconds since the session began),
    sweep_start and sweep_end (seconds after release).

    \b
    Example of R.csv, a draw from the home hog line:
        throw,x,y,vx,vy,theta,omega
        0,0,-10.9725,0,2.1,0,1.5
    \b
    Example:
        curling simulate --ice standard --releases releases.csv -o tracks.csv
    """
    from curling_env.errors import InputError
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import atomic_path
    from curling_env.physics import session
    from curling_env.throw import read_releases
    from curling_env.trajectory import write_tracks

    surface = load_ice(ice)
    thrown = read_releases(releases)
    with atomic_path(output) as draft:
        try:
            with progress_bar("throw") as progress:
                tracks = session.simulate(surface, thrown, fps=fps, progress=progress)
        except InputError as error:
            raise InputError(error.problem, source=releases, where=error.where) from error
        write_tracks(draft, tracks)
    say(f"{len(tracks)} throws: {output}")
