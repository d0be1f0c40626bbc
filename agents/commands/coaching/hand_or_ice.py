"""`curling hand-or-ice`: why throws missed."""

from __future__ import annotations

from os.path import realpath
from pathlib import Path
from typing import Annotated

import typer

from agents.commands.coaching.options import (
    BelievedOption,
    PictureOption,
    TracksArgument,
    causes_of,
)
from curling_env.commands.cli import (
    IceOption,
    JsonOption,
    SeedOption,
    UnitsOption,
    Writes,
    conclude,
    progress_bar,
)
from curling_env.errors import InputError
from curling_env.units import Units


def hand_or_ice(
    tracks: TracksArgument,
    ice: IceOption,
    believed: BelievedOption = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE.csv", help="Also write the table, in metres."),
        Writes(),
    ] = None,
    picture: PictureOption = None,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Tell why throws missed: the hand's weight, line and rotation, or the ice.

    For every throw with a called target (`called` in throws.csv beside the tracks, such as "draw
    0.3,-1.2 in") it tells how far off it came to rest, and how far each cause carried it:

    \b
        weight, line, rotation   the release, against the one that was meant
        ice read wrong           the ice of this session (--ice), against the one that the team
                                 planned with (--believed), or a broom or time called too much
        unexplained              what this release on this ice does not explain: a hair, frost,
                                 sweeping that nobody noted, a stone unlike the others

    The throw that was meant is the one that does what was called on the believed ice. It begins
    where the stone crossed the hog line, with the athlete's usual rotation unless turns were
    called. --ice is the ice that these tracks show (`curling estimate tracks.csv -o ice.json`).
    Parts add up to the miss. A hit is judged by where it crosses the line of its target. JSON and
    CSV have every part with its standard error, in metres: right, and past the target.

    \b
    Example:
        curling estimate tracks.csv -o ice.json
        curling hand-or-ice tracks.csv --ice ice.json --believed morning.json --picture why.png
    """
    from agents.coaching.in_words import causes_rows, session_in_words
    from friction_estimation.reports.throws_section import as_text
    from friction_estimation.tracks.throw_list import THROW_LIST

    if output is not None and realpath(output) == realpath(tracks.parent / THROW_LIST):
        raise InputError("is where the calls stand; name the table otherwise", source=output)
    with progress_bar("throw") as progress:
        found = causes_of(tracks, ice, believed, seed, progress)
    if output is not None:
        from agents.coaching.tables import write_causes

        write_causes(output, found)
    if picture is not None:
        from agents.coaching.figures.hand_or_ice_figure import draw_causes

        draw_causes(found, picture, units)
    table = [as_text(causes_rows(found, units))] if found.throws else []
    conclude(found.as_dict(), *table, *session_in_words(found, units), as_json=as_json)
