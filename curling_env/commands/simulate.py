"""`curling simulate`: the true paths of given releases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.cli import IceOption, OutputFile, progress


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
    ice. Throws are played in the order of the file, on ice that wears and drifts accordingly.

    \b
    Example:
        curling simulate --ice standard --releases releases.csv -o tracks.csv
    """
    from curling_env.errors import InputError
    from curling_env.ice import load_ice
    from curling_env.physics.slide import slide
    from curling_env.storage import atomic_path
    from curling_env.throw import read_releases
    from curling_env.trajectory import Trajectory, write_tracks

    known = load_ice(ice)
    thrown = read_releases(releases)
    with atomic_path(output) as draft:
        tracks: list[Trajectory] = []
        for release in progress(thrown, "throws", unit="throw"):
            try:
                run = slide(known, release, fps=fps, throw=release.throw)
            except InputError as error:
                place = f"throw {release.throw}"
                raise InputError(error.problem, source=releases, where=place) from error
            if run.trajectory is not None:
                tracks.append(run.trajectory)
        write_tracks(draft, tracks)
