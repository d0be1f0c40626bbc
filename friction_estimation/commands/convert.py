"""`curling convert`: tables of other programs in, tables for other programs out."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import JsonOption, OutputFile, conclude, say
from curling_env.errors import InputError
from friction_estimation.tracks.importers import Along


class Unit(StrEnum):
    """Units of length in other programs."""

    m = "m"
    cm = "cm"
    mm = "mm"
    ft = "ft"
    inch = "in"


METRES = {Unit.m: 1.0, Unit.cm: 0.01, Unit.mm: 0.001, Unit.ft: 0.3048, Unit.inch: 0.0254}


def convert(
    table: Annotated[
        Path,
        typer.Argument(
            metavar="TABLE",
            help="An export of Kinovea or Tracker, tracks, an ice file, or a donated session.",
        ),
    ],
    output: OutputFile = Path("tracks.csv"),
    unit: Annotated[Unit, typer.Option(help="Unit of length in the other program.")] = Unit.m,
    origin: Annotated[
        str,
        typer.Option(
            metavar="PLACE|X,Y",
            help="Where the other program's axes cross: middle, a place such as home_tee or "
            "away_hog_centre (see `curling corners`), or x,y in metres from mid-sheet.",
        ),
    ] = "middle",
    along: Annotated[
        Along,
        typer.Option(
            help="The other program's axis that points from the home end to the away end."
        ),
    ] = Along.x,
    as_json: JsonOption = False,
) -> None:
    """Read what other programs tracked, or write tables that other programs read.

    Files of Kinovea ("Trajectories to CSV", or its text for gnuplot) and of Tracker ("Export data
    file") are recognised by their first rows. Every tracked point becomes a throw of its own, in
    the order of the file. In the other program, place the axes on the ice and scale them with
    something of known length; say here where they lie (--origin) and how they point (--along). The
    second axis must point to the left of the first, as it does in both programs.

    An output that ends in .parquet is written as Parquet, any other as CSV. An ice file becomes the
    table of its cells: row, column, x, y, mu, sigma, observed. A donated session (`curling donate`)
    becomes its tracks.

    \b
    Example:
        curling convert kinovea.csv --origin home_tee --along x -o tracks.csv
        curling convert tracker.txt --unit cm --origin 0,-17.3735 -o tracks.csv
        curling convert tracks.csv -o tracks.parquet
        curling convert ice.json -o cells.parquet
        curling convert session.json -o tracks.csv
    """
    from curling_env.ice import load_ice, write_cells
    from curling_env.infrastructure.files.kinds import kind_of
    from curling_env.sheet import PAPER_SHEET
    from curling_env.trajectory import is_tracks, read_tracks, write_tracks
    from friction_estimation.camera.markings import keypoints_of
    from friction_estimation.donation import read_session
    from friction_estimation.tracks.importers import on_sheet, read_export

    if kind_of(table) == "session":
        given = read_session(table).tracks
        write_tracks(output, given)
        rows, throws = sum(map(len, given)), len({track.throw for track in given})
        conclude(
            {"written": str(output), "throws": throws, "rows": rows},
            f"{throws} throws, {rows} rows: {output}",
            as_json=as_json,
        )
        return
    if table.suffix.lower() == ".json":
        ice = load_ice(table)
        write_cells(output, ice)
        words = f"{ice.friction.mu.size} cells: {output}"
        conclude({"written": str(output), "rows": ice.friction.mu.size}, words, as_json=as_json)
        return
    if is_tracks(table):
        tracks = read_tracks(table)
    else:
        places = {"middle": (0.0, 0.0), **keypoints_of(PAPER_SHEET)}
        series = read_export(table)
        tracks = on_sheet(
            series,
            metres=METRES[unit],
            origin=places[origin] if origin in places else _place(origin),
            along=along,
        )
        outside = [
            k.name
            for k, track in zip(series, tracks, strict=True)
            if not PAPER_SHEET.contains(track.xy).any()
        ]
        if outside:
            raise InputError(
                f"{outside[0]!r} lies nowhere on the sheet with this --unit, --origin and --along",
                source=table,
            )
        for i, k in enumerate(series):
            say(f"throw {i}: {k.name}, {len(k.t)} rows")
    write_tracks(output, tracks)
    rows = sum(map(len, tracks))
    conclude(
        {"written": str(output), "throws": len(tracks), "rows": rows},
        f"{len(tracks)} throws, {rows} rows: {output}",
        as_json=as_json,
    )


def _place(text: str) -> tuple[float, float]:
    x, _, y = text.partition(",")
    try:
        return float(x), float(y)
    except ValueError:
        raise InputError(
            f"expected middle, a place on the ice, or x,y in metres, got {text!r}",
            source="--origin",
        ) from None
