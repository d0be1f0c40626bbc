"""`curling sweep`: many throws on many ices with many errors, on any number of workers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import OutputFile, SeedOption, progress_bar, say
from curling_env.errors import InputError

MAX_ENDS = 10**8
"""Throws of one sweep: their ends are held in memory until they are written."""


def sweep(
    releases: Annotated[
        Path,
        typer.Option(
            metavar="R.csv", help="Releases, a table with columns throw,x,y,vx,vy,theta,omega."
        ),
    ],
    output: OutputFile,
    ice: Annotated[
        list[str] | None,
        typer.Option(metavar="ICE", help="An ice file or a preset; repeat it for several ices."),
    ] = None,
    seeds: Annotated[
        int, typer.Option(min=1, help="How often each throw is made on each ice.")
    ] = 1,
    seed: SeedOption = 0,
    skill: Annotated[
        str, typer.Option(help="Accuracy of the player: none, elite, champion, championship, club.")
    ] = "none",
    workers: Annotated[
        str,
        typer.Option(
            metavar="N|ray|ray://HOST:PORT",
            help="Number of local processes, or a Ray cluster: a running one, or by its address.",
        ),
    ] = "1",
) -> None:
    """Make every throw many times on every ice, and write where the stones end.

    Each throw is made alone on an empty sheet with an error drawn for a player of the given skill.
    Every ice sees the same errors. The result is the same on any number of workers, even if some
    are lost. It has one row for each ice (numbered from 0 in the order given), seed and throw.

    \b
    Examples:
        curling sweep --ice standard --ice fcv1 --releases r.csv -o ends.csv
        curling sweep --releases r.csv --skill club --seeds 1000 --workers 8 -o ends.csv
        curling sweep --releases r.csv --skill club --seeds 100000 --workers ray -o ends.csv
    """
    import numpy as np

    from curling_env.ice import load_ice
    from curling_env.infrastructure.executor import executor
    from curling_env.infrastructure.files.storage import atomic_path, write_table
    from curling_env.physics.slides import SlideEnd
    from curling_env.physics.sweep import Sweep, run
    from curling_env.throw import read_releases

    thrown = read_releases(releases)
    ends_asked = seeds * len(thrown) * len(ice or ["standard"])
    if ends_asked > MAX_ENDS:
        raise InputError(
            f"that is {ends_asked:g} throws; a sweep has at most {MAX_ENDS:g}", source="--seeds"
        )
    plan = Sweep(
        ices=[load_ice(name) for name in ice or ["standard"]],
        releases=thrown,
        seeds=range(seed, seed + seeds),
        skill=skill,
    )
    with atomic_path(output) as draft:
        with executor(workers) as work, progress_bar("piece") as progress:
            ends = run(plan, work, progress=progress)
        names = np.array([end.name.lower() for end in SlideEnd])
        which, times, throw = (axis.ravel() for axis in np.indices(plan.shape))
        write_table(
            draft,
            {
                "ice": which,
                "seed": times + seed,
                "throw": np.array([release.throw for release in thrown])[throw],
                "x": ends.x.ravel(),
                "y": ends.y.ravel(),
                "theta": ends.theta.ravel(),
                "time": ends.time.ravel(),
                "end": names[ends.end.ravel()],
            },
        )
    say(f"{ends.x.size} throws: {output}")
