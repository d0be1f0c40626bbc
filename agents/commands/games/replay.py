"""`curling replay`: make a film or a page of a recorded game."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import UnitsOption, Writes, progress_bar
from curling_env.infrastructure.files.kinds import FILM_SUFFIXES
from curling_env.typing import with_progress
from curling_env.units import Units


def replay(
    record: Annotated[
        Path, typer.Argument(metavar="GAME.jsonl", help="Record of a game by `curling play`.")
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FILE", help="File for the film or the page."),
        Writes(kinds=("made film", "page"), suffixes=(*FILM_SUFFIXES, ".html")),
    ],
    ends: Annotated[
        list[int] | None, typer.Option("--end", min=1, help="Show only this end; may be repeated.")
    ] = None,
    speed: Annotated[
        float, typer.Option(min=0.1, max=100, help="Playback speed over real time.")
    ] = 8.0,
    ice: Annotated[
        str | None,
        typer.Option(metavar="ICE", help="Ice to paint under the lines; by default as recorded."),
    ] = None,
    units: UnitsOption = Units.METRES,
) -> None:
    """Make a film (.mp4, .avi) or a page (.html) of a recorded game.

    The film shows every delivery from above as in a broadcast, with paths, call and score. An end
    takes about a minute of film, and about as long to make. The page holds the whole game and plays
    it in any browser.

    \b
    Examples:
        curling replay runs/game/game.jsonl -o game.mp4
        curling replay runs/game/game.jsonl --end 8 --speed 4 -o last.mp4
        curling replay runs/game/game.jsonl -o game.html
    """
    from agents.playing.record import ice_of, read_record
    from agents.playing.replay.film import deliveries_of, write_film
    from agents.playing.replay.page import write_page
    from curling_env.errors import InputError
    from curling_env.ice import load_ice

    lines = read_record(record)
    if output.suffix.lower() == ".html":
        if ends:
            raise InputError("a page shows the whole game; --end is for films")
        write_page(output, lines, units)
        return
    shown = write_film(
        output,
        lines,
        load_ice(ice_of(lines, record) if ice is None else ice),
        ends=ends or None,
        speed=speed,
        units=units,
    )
    total = len(deliveries_of(lines, ends or None))
    with progress_bar("stone") as progress:
        for _ in with_progress(shown, "filming", progress, total):
            pass
