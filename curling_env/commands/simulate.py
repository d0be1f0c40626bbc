"""`curling simulate`: the true paths of given releases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from curling_env.commands.options import IceOption, TracksFile
from curling_env.commands.terminal import print_remark, progress_bar

ReleasesOption = Annotated[
    Path,
    Option(metavar="R.csv", help="Table of throws: throw,x,y,vx,vy,theta,omega."),
]


def simulate(
    ice: IceOption,
    releases: ReleasesOption,
    output: TracksFile,
    fps: Annotated[float, Option(min=0.1, max=10_000, help="Rows per second.")] = 30.0,
) -> None:
    """Throw stones one after the other on an empty sheet and write their true paths.

    \b
    Example, and R.csv with a draw from the home hog line:
        curling simulate --ice standard --releases R.csv -o tracks.csv
        throw,x,y,vx,vy,theta,omega
        0,0,-10.9725,0,2.1,0,1.5

    A path begins at the release and ends where the stone comes to rest or touches the edge of the
    ice. Earlier throws wear the ice if its effects say so; effects of the measurement, such as a
    lens, do not change the paths. docs/files.md describes both tables.
    """
    from curling_env.errors import placed
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.writing import atomic_path
    from curling_env.physics import session
    from curling_env.throw import read_releases
    from curling_env.trajectory import write_tracks

    surface = load_ice(ice)
    thrown = read_releases(releases)
    with atomic_path(output) as draft:
        with placed(source=releases), progress_bar("throw") as progress:
            tracks = session.simulate(surface, thrown, fps=fps, progress=progress)
        write_tracks(draft, tracks)
    print_remark(f"{len(tracks)} throws: {output}")
