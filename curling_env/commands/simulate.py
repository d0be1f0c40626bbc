"""`curling simulate`: the true paths of given releases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import IceOption, OutputFile, progress_bar


def simulate(
    ice: IceOption,
    releases: Annotated[
        Path, typer.Option(metavar="R.csv", help="Releases: throw,x,y,vx,vy,theta,omega and more.")
    ],
    output: OutputFile,
    fps: Annotated[float, typer.Option(min=0.1, max=10_000, help="Rows a second.")] = 30.0,
) -> None:
    """Throw every release alone on an empty sheet and write where the stones went.

    Positions are true: an effect of the measurement in the ice file changes what a camera would
    report, not where the stone is. A track ends where the stone rests or touches the edge of the
    ice. Throws are played in the order of the file, on ice that wears and drifts accordingly; where
    it wears along paths (pebble_wear), it remembers where the stones before went.

    \b
    Example:
        curling simulate --ice standard --releases releases.csv -o tracks.csv
    """
    from curling_env.errors import InputError
    from curling_env.ice import load_ice
    from curling_env.physics import session
    from curling_env.storage import atomic_path
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
