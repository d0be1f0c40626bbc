"""`curling match-stones`: which stones run and curl alike."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents.commands.coaching.options import PictureOption, TracksArgument
from curling_env.commands.cli import (
    IceOption,
    JsonOption,
    SeedOption,
    UnitsOption,
    Writes,
    conclude,
    progress_bar,
)
from curling_env.units import Units


def match_stones(
    tracks: TracksArgument,
    ice: IceOption,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="ICE.json",
            help="Also write the ice with every stone's friction and curl, to plan with.",
        ),
        Writes(kinds=("ice",)),
    ] = None,
    picture: PictureOption = None,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Match stones: which run keener or heavier than the set, and which curl more or less.

    Which stone each throw was stands in throws.csv beside the tracks (column `stone`), or in the
    tracks themselves. Each stone's friction and curl are told against the mean of the set with 95 %
    intervals, and how much further it comes to rest on a draw. Pairs are suggested so that partners
    run as alike as can be. Stones that cannot be told apart yet are named, with the number of
    throws that would settle it.

    What the ice file says of single stones is left aside. Steady changes of the ice during the
    session, and differences between the two ends, are taken out where the throws allow it: throw
    the stones in turn.

    \b
    Example:
        curling match-stones tracks.csv --ice ice.json --picture stones.png
    """
    from agents.coaching.in_words import stones_in_words, stones_rows
    from agents.coaching.stones import match_stones as match
    from curling_env.ice import load_ice, save_ice
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.reports.throws_section import as_text
    from friction_estimation.tracks.throw_list import load_tracks, throws_beside

    known = load_ice(ice)
    with progress_bar("throw") as progress:
        found = match(
            load_tracks(tracks), known, throws_beside(tracks), seed=seed, progress=progress
        )
    if output is not None:
        save_ice(found.on(known), output, provenance=provenance([tracks, ice], seed=seed))
    if picture is not None:
        from agents.coaching.figures.stones_figure import draw_stones

        draw_stones(found, picture, units)
    conclude(
        found.as_dict(),
        as_text(stones_rows(found, units)),
        *stones_in_words(found, units),
        as_json=as_json,
    )
