"""`curling athletes`: how each athlete throws."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents.commands.coaching.options import PictureOption, causes_of
from curling_env.commands.cli import (
    JsonOption,
    SeedOption,
    UnitsOption,
    Writes,
    conclude,
    progress_bar,
    say,
)
from curling_env.errors import InputError
from curling_env.units import Units


def athletes(
    tracks: Annotated[
        list[Path],
        typer.Argument(
            metavar="TRACKS.csv...",
            help="One file for each session, with throws.csv (athlete, called) beside it.",
        ),
    ],
    ice: Annotated[
        list[str],
        typer.Option(
            "--ice", metavar="ICE", help="The ice of the session; one for all, or one for each."
        ),
    ],
    believed: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ICE",
            help="The ice that the team planned with; one for all, or one for each. Without it "
            "weights and lines are held against those that the session's ice needed.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Also write athlete_errors.csv, and NAME.skill.json of every athlete.",
        ),
        Writes(folder=True),
    ] = None,
    picture: PictureOption = None,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Tell how each athlete throws: bias and spread of weight, line and rotation.

    Every throw with a called target counts, over all the sessions that are given. Weight is told in
    seconds from hog line to hog line against what was meant, line at the far tee line, rotation in
    turns; by handle and by shot (guard, draw, hit). Groups of few throws lean on the athlete's
    others, and what the measurement adds is taken out of the spread.

    With -o, DIR also receives NAME.skill.json for each athlete: the spread as an execution error,
    which `curling plan --skill NAME.skill.json` plans for, and `curling play` and `tournament` play
    with. The bias is not in it: who knows it aims off.

    \b
    Example:
        curling athletes tracks.csv --ice ice.json --believed morning.json -o athletes
        curling athletes mon/tracks.csv fri/tracks.csv --ice mon/ice.json --ice fri/ice.json
        curling plan --ice ice.json --target 0,17.37 --skill athletes/Ada.skill.json
    """
    from agents.coaching.athletes import athlete_errors
    from agents.coaching.in_words import athletes_in_words, athletes_rows
    from friction_estimation.reports.throws_section import as_text

    ices = _for_each(ice, tracks, "--ice")
    taken = _for_each(believed, tracks, "--believed") if believed else [None] * len(tracks)
    sessions = []
    with progress_bar("throw") as progress:
        for number, path in enumerate(tracks):
            sessions.append(causes_of(path, ices[number], taken[number], seed, progress))
    found = athlete_errors(sessions, seed=seed)
    for remark in dict.fromkeys(remark for one in sessions for remark in one.remarks):
        say(remark)
    if not found:
        raise InputError(
            "no athlete has two throws with a called target that were seen from the hog line to "
            "their rest",
            source=tracks[0],
        )
    if output is not None:
        from agents.coaching.tables import write_athletes

        for name in write_athletes(output, found, [*tracks, *ice, *(believed or [])], seed=seed):
            say(f"{name}")
    if picture is not None:
        from agents.coaching.figures.athletes_figure import draw_athletes

        draw_athletes(found, picture, units)
    conclude(
        [one.as_dict() for one in found],
        as_text(athletes_rows(found, units)),
        *athletes_in_words(found, units),
        as_json=as_json,
    )


def _for_each(given: list[str], tracks: list[Path], option: str) -> list[str]:
    """One ice for each session, where one was given for all."""
    if len(given) not in (1, len(tracks)):
        raise InputError(
            f"expected one for all sessions, or one for each of {len(tracks)}, got {len(given)}",
            source=option,
        )
    return given * len(tracks) if len(given) == 1 else given
