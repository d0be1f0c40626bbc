"""`curling sweep`: throws on many ices with many errors, on as many workers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import OutputFile, SeedOption, progress, say


def sweep(
    releases: Annotated[
        Path, typer.Option(metavar="R.csv", help="Releases: throw,x,y,vx,vy,theta,omega and more.")
    ],
    output: OutputFile,
    ice: Annotated[
        list[str] | None,
        typer.Option(metavar="ICE", help="An ice file or a preset; give it once for each ice."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Times each throw is made on each ice.")] = 1,
    seed: SeedOption = 0,
    skill: Annotated[
        str, typer.Option(help="Of the hand that throws: none, elite, champion, club.")
    ] = "none",
    workers: Annotated[
        str,
        typer.Option(
            metavar="N|ray|ray://HOST:PORT",
            help="Local processes, or a Ray cluster: the one at hand, or the one at an address.",
        ),
    ] = "1",
) -> None:
    """Make every throw on every ice, again and again, and write where the stones ended.

    Each throw is made alone on an empty sheet, with the errors of a player's hand; every ice sees
    the same errors. The numbers are the same on any number of workers, and no loss of a worker
    changes them. One row for each ice (numbered from 0 as given), seed and throw.

    \b
    Examples:
        curling sweep --ice standard --ice fcv1 --releases r.csv -o ends.csv
        curling sweep --releases r.csv --skill club --seeds 1000 --workers 8 -o ends.csv
        curling sweep --releases r.csv --skill club --seeds 100000 --workers ray -o ends.csv
    """
    import numpy as np

    from curling_env.executor import executor
    from curling_env.ice import load_ice
    from curling_env.physics.one_stone.integrate import SlideEnd
    from curling_env.physics.sweep import Sweep, run
    from curling_env.storage import atomic_path, write_table
    from curling_env.throw import read_releases

    thrown = read_releases(releases)
    asked = Sweep(
        ices=[load_ice(name) for name in ice or ["standard"]],
        releases=thrown,
        seeds=range(seed, seed + seeds),
        skill=skill,
    )
    with atomic_path(output) as draft:
        with executor(workers) as crew:
            ends = run(
                asked,
                crew,
                through=lambda done: progress(done, "sweep", total=asked.piece_count, unit="piece"),
            )
        names = np.array([end.name.lower() for end in SlideEnd])
        which, times, throw = (axis.ravel() for axis in np.indices(asked.shape))
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
