"""`curling throws`: a coach's table of throws, from tracks."""

from __future__ import annotations

from agents.commands.coaching.options import TableOption, TracksArgument, refuse_throw_list
from curling_env.commands.options import Measured, grouped
from curling_env.errors import InputError


@grouped
def throws(tracks: TracksArgument, output: TableOption = None, *, results: Measured) -> None:
    """List the times, line, handle, turns, curl and rest of each throw.

    \b
    Examples:
        curling throws tracks.csv
        curling throws tracks.csv --units feet
        curling throws tracks.csv -o table.csv

    Times are those of the stone's centre; left and right are the thrower's. Values that the camera
    did not see, or after a contact, are blank. JSON and CSV are in SI units, each number with its
    standard error. Called shots in throws.csv, in the folder of the tracks, are compared with the
    throws. docs/tracking.md explains the columns, docs/coaching.md the called shots.
    """
    from agents.coaching.throw_sheet import hands_beside, sheet_rows, throw_table, write_sheets
    from friction_estimation.reports.throws_section import as_text, curl_in_words
    from friction_estimation.tracks.throw_list import load_tracks, throws_beside

    refuse_throw_list(output, tracks)
    sheets = throw_table(load_tracks(tracks), throws_beside(tracks), hands_beside(tracks))
    if not sheets:
        raise InputError("no throw slides freely in these tracks", source=tracks)
    if output is not None:
        write_sheets(output, sheets)
    results.show(
        [sheet.as_dict() for sheet in sheets],
        as_text(sheet_rows(sheets)),
        *curl_in_words([sheet.measures for sheet in sheets]),
    )
