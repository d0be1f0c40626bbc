"""`curling demo`: the whole loop on films that the command renders itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from curling_env.commands.options import OutputDirectory, SeedOption, UnitsOption
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.units import Units


def demo(
    output: OutputDirectory = Path("runs/demo"),
    seed: SeedOption = 0,
    throws: Annotated[int, Option(min=2, max=40, help="Number of practice throws.")] = 8,
    workers: Annotated[int, Option(min=1, max=64, help="Number of processes.")] = 2,
    units: UnitsOption = Units.METRES,
) -> None:
    """Run the whole loop from film to throw, in about two minutes.

    \b
    Examples:
        curling demo
        curling demo -o runs/my-demo --seed 7 --throws 12
        curling demo --units feet

    The command films practice throws on uneven ice, tracks the stone, estimates the friction map,
    plans a draw on it, and throws it on the hidden ice. Then the curl is removed from the model:
    the planned draw misses, discovery names the missing effect, and the draw planned again lands.
    The folder holds the films, tracks.csv, ice.json and a page of pictures (index.html, page.png).
    """
    from agents.closed_loop.demo import run_demo

    with progress_bar() as progress:
        found = run_demo(
            output, seed=seed, throws=throws, workers=workers, units=units, progress=progress
        )
    for sentence in found.sentences():
        print(sentence)
    print_remark(f"{found.seconds:.0f} s; the page: {output / 'index.html'}")
