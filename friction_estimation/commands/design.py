"""`curling design`: which throws to make, before any is measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from curling_env.commands.options import Measured, grouped, numbers, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import progress_bar

MAX_SPEEDS = 24
"""Maximum number of speeds, each of which is tried with every line and spin."""


@grouped
def design(
    resolution: Annotated[
        float, Option(help="Wanted detail of the map: smallest structure resolved [m].")
    ] = 2.0,
    precision: Annotated[float, Option(min=0.01, max=100, help="Wanted error of mu [%].")] = 2.0,
    noise: Annotated[
        float, Option(min=1e-6, max=10, help="Independent error of one measured position [m].")
    ] = 0.005,
    fps: Annotated[
        float, Option(min=0.1, max=10_000, help="Frames per second of the camera.")
    ] = 30.0,
    mu: Annotated[float, Option(min=1e-4, max=1, help="Expected friction.")] = 0.009,
    spread: Annotated[
        float, Option(min=0.01, max=100, help="Expected variation of mu over the sheet [%].")
    ] = 5.0,
    speeds: Annotated[
        str | None,
        Option(
            metavar="V,V...",
            help="Possible speeds at the hog line [m/s]; around a draw to the tee by default.",
        ),
    ] = None,
    ice: Annotated[
        str | None, Option(metavar="ICE", help="Ice with the sheet; the paper's by default.")
    ] = None,
    output: Annotated[
        Path | None,
        output_to("RELEASES.csv", "Also write the throws as releases."),
        Writes(kinds=("releases",)),
    ] = None,
    *,
    results: Measured,
) -> None:
    """Choose the throws that measure a friction map with a wanted detail and error.

    \b
    Examples:
        curling design --resolution 2 --precision 1
        curling design --precision 1.5 --noise 0.002 --fps 60
        curling design --speeds 1.8,2.0,2.4 -o releases.csv

    The command chooses the fewest throws that reach the error, from the limit that no method of
    estimation can beat: their speeds, lines and ends. Real throws differ a little from one to the
    next, so make some more. The error is that of a cell between the tees and within 1.5 m of the
    centre line; the JSON also has the error after every throw. With -o the throws are written as
    releases, for `curling simulate` or `curling film`.
    """
    from curling_env.ice import load_ice
    from curling_env.sheet import PAPER_SHEET
    from curling_env.throw import write_releases
    from friction_estimation.design.design import design_throws

    form = f"up to {MAX_SPEEDS} numbers with commas between, such as 1.6,2.2"
    counts = range(1, MAX_SPEEDS + 1)
    with progress_bar() as bar:
        found = design_throws(
            resolution=resolution,
            precision=precision / 100,
            noise=noise,
            fps=fps,
            mu=mu,
            spread=spread / 100,
            speeds=None if speeds is None else numbers(speeds, "--speeds", form, counts=counts),
            sheet=PAPER_SHEET if ice is None else load_ice(ice).sheet,
            progress=bar,
        )
    if output is not None:
        write_releases(output, [kind.release for kind in found.kinds])
    results.show(found.summary(), found.in_words(results.units))
