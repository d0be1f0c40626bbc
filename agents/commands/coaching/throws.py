"""`curling throws`: the table of throws that a coach reads, from tracks."""

from __future__ import annotations

from os.path import realpath
from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import JsonOption, UnitsOption, Writes, conclude
from curling_env.errors import InputError
from curling_env.units import Units


def throws(
    tracks: Annotated[Path, typer.Argument(metavar="TRACKS.csv", help="From `curling track`.")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE.csv", help="Also write the table, in metres."),
        Writes(),
    ] = None,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Show what each throw was: its times, line, handle, turns, curl, and where it came to rest.

    \b
        back to hog        the split: from the back line to the hog line at the thrower's end
        hog to hog         from hog line to hog line
        hog to tee         from the first hog line to the tee line played to
        speed              over the first hog line
        handle, turns      the athlete's handle (↻ clockwise, ↺ counter-clockwise), full turns
        line               where the stone was sent: its first metres beyond the hog line, drawn on
                           to the far tee line, from the centre line
        curl               from that line to where it came to rest
        rest               past or short of the tee, right or left of the centre line

    Times are those of the stone's centre; left and right are the thrower's. What a camera did not
    see is left blank. A throw that touched another stone tells what it was until then. JSON and
    CSV are in metres, seconds and radians, each number with its standard error (NAME_sigma).

    A table throws.csv beside the tracks may note of each throw its athlete, stone, called and note.
    What was called is a line such as "draw button in", "draw 0.3,-1.2 out broom 1.1 right" (metres
    right of and past the tee), "guard", or "hit 0,1.2 normal out"; the table then tells how far the
    line was off the broom, and how far the rest from the target. Other text stays as it is. A table
    athletes.csv (athlete, hand) says who throws with the left, so that handles are theirs.

    \b
    Example:
        curling throws tracks.csv
        curling throws tracks.csv --units feet
        curling throws tracks.csv -o table.csv
    """
    from agents.coaching.throw_sheet import (
        hands_beside,
        sheet_rows,
        throw_table,
        write_sheets,
    )
    from friction_estimation.reports.throws_section import as_text, curl_in_words
    from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside

    if output is not None and realpath(output) == realpath(tracks.parent / THROW_LIST):
        raise InputError(
            "is where notes of the throws stand; name the table otherwise", source=output
        )
    sheets = throw_table(load_tracks(tracks), throws_beside(tracks), hands_beside(tracks))
    if not sheets:
        raise InputError("no throw slides freely in these tracks", source=tracks)
    if output is not None:
        write_sheets(output, sheets)
    words = [
        as_text(sheet_rows(sheets, units)),
        *curl_in_words([sheet.measures for sheet in sheets], units),
    ]
    conclude([sheet.as_dict() for sheet in sheets], *words, as_json=as_json)
