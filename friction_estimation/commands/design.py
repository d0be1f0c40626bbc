"""`curling design`: which throws to make, before any is measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import (
    JsonOption,
    UnitsOption,
    Writes,
    conclude,
    progress_bar,
)
from curling_env.errors import InputError
from curling_env.units import Units

MOST_SPEEDS = 24
"""Speeds that are tried together with every line and spin."""


def design(
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="RELEASES.csv", help="Also write the throws as releases."
        ),
        Writes(kinds=("releases",)),
    ] = None,
    resolution: Annotated[
        float, typer.Option(help="Wanted detail of the map: smallest structure resolved [m].")
    ] = 2.0,
    precision: Annotated[
        float, typer.Option(min=0.01, max=100, help="Wanted error of mu [%].")
    ] = 2.0,
    noise: Annotated[
        float,
        typer.Option(
            min=1e-6, max=10, help="Error of one measured position, independent of others [m]."
        ),
    ] = 0.005,
    fps: Annotated[
        float, typer.Option(min=0.1, max=10_000, help="Frames a second of the camera.")
    ] = 30.0,
    mu: Annotated[float, typer.Option(min=1e-4, max=1, help="Friction that is expected.")] = 0.009,
    spread: Annotated[
        float,
        typer.Option(min=0.01, max=100, help="How much mu is expected to vary over the sheet [%]."),
    ] = 5.0,
    speeds: Annotated[
        str | None,
        typer.Option(
            metavar="V,V...",
            help="Speeds at the hog line that can be thrown [m/s]; "
            "around a draw to the tee by default.",
        ),
    ] = None,
    ice: Annotated[
        str | None,
        typer.Option(metavar="ICE", help="An ice with the sheet; the paper's sheet by default."),
    ] = None,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Say how many throws of which kind are needed to measure a friction map.

    State the map that you want: its detail (--resolution) and its error (--precision). The command
    chooses the fewest throws that reach it, from the limit that no method of estimation can beat:
    their speeds, their lines beside the centre line, and from which end they are thrown. Real
    throws differ a little from one to the next, so make some more.

    The error is that of a cell between the tees and within 1.5 m of the centre line. The JSON on
    stdout also gives the error after every throw. With -o the throws are written as releases, for
    `curling simulate` or `curling film`.

    \b
    Example:
        curling design --resolution 2 --precision 1
        curling design --precision 1.5 --noise 0.002 --fps 60
        curling design --speeds 1.8,2.0,2.4 -o releases.csv
    """
    from curling_env.ice import load_ice
    from curling_env.sheet import PAPER_SHEET
    from curling_env.throw import write_releases
    from friction_estimation.design.design import design_throws

    with progress_bar() as bar:
        found = design_throws(
            resolution=resolution,
            precision=precision / 100,
            noise=noise,
            fps=fps,
            mu=mu,
            spread=spread / 100,
            speeds=None if speeds is None else _numbers(speeds),
            sheet=PAPER_SHEET if ice is None else load_ice(ice).sheet,
            progress=bar,
        )
    if output is not None:
        write_releases(output, [kind.release for kind in found.kinds])
    conclude(found.summary(), found.in_words(units), as_json=as_json)


def _numbers(text: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
        if len(values) > MOST_SPEEDS:
            raise InputError(f"--speeds takes up to {MOST_SPEEDS} numbers, got {len(values)}")
        return values
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"--speeds takes numbers with commas between, like 1.6,2.2, got {text!r}"
        ) from None
