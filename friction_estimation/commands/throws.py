"""`curling throws`: the table of throws that a coach reads, from tracks."""

from __future__ import annotations

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
        handle, turns      a right-hander's handle (↻ clockwise, ↺ counter-clockwise), full turns
        line               where the stone was sent: its first metres beyond the hog line, drawn on
                           to the far tee line, from the centre line
        curl               from that line to where it came to rest
        rest               past or short of the tee, right or left of the centre line

    Times are those of the stone's centre; left and right are the thrower's. What a camera did not
    see is left blank. What a table throws.csv beside the tracks notes (athlete, stone, called,
    note) is shown too. A throw that touched another stone tells what it was until then. JSON and
    CSV are in metres, seconds and radians, each number with its standard error (NAME_sigma).

    \b
    Example:
        curling throws tracks.csv
        curling throws tracks.csv --units feet
        curling throws tracks.csv -o table.csv
    """
    from friction_estimation.reports.throws_section import (
        as_text,
        curl_in_words,
        throw_rows,
        write_measures,
    )
    from friction_estimation.tracks.throw_list import (
        THROW_LIST,
        ThrowNote,
        load_tracks,
        throws_beside,
    )
    from friction_estimation.tracks.throw_table import throw_table

    if output is not None and output.resolve() == (tracks.parent / THROW_LIST).resolve():
        raise InputError(
            "is where notes of the throws stand; name the table otherwise", source=output
        )
    measured = throw_table(load_tracks(tracks))
    notes = throws_beside(tracks)
    if not measured:
        raise InputError("no throw slides freely in these tracks", source=tracks)
    if output is not None:
        write_measures(output, measured, notes)
    words = [
        as_text(throw_rows(measured, units, notes, errors=False)),
        *curl_in_words(measured, units),
    ]
    each = [{**one.as_dict(), **notes.get(one.throw, ThrowNote()).row} for one in measured]
    conclude(each, *words, as_json=as_json)
