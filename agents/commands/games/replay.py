"""`curling replay`: make a film or a page of a recorded game."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from curling_env.commands.options import UnitsOption, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import progress_bar
from curling_env.infrastructure.files.kinds import FILM_SUFFIXES
from curling_env.units import Units


def replay(
    record: Annotated[Path, Argument(metavar="GAME.jsonl", help="Record by `curling play`.")],
    output: Annotated[
        Path,
        output_to("FILE", "File for the film or the page."),
        Writes(kinds=("made film", "page"), suffixes=(*FILM_SUFFIXES, ".html")),
    ],
    ends: Annotated[
        list[int] | None, Option("--end", min=1, help="Only this end; may be repeated.")
    ] = None,
    speed: Annotated[float, Option(min=0.1, max=100, help="Playback speed over real time.")] = 8.0,
    ice: Annotated[
        str | None, Option(metavar="ICE", help="Painted ice; by default as recorded.")
    ] = None,
    units: UnitsOption = Units.METRES,
) -> None:
    """Make a film (.mp4, .avi) or a page (.html) of a recorded game.

    \b
    Examples:
        curling replay runs/game/game.jsonl -o game.mp4
        curling replay runs/game/game.jsonl --end 8 --speed 4 -o last.mp4
        curling replay runs/game/game.jsonl -o game.html

    The film shows every delivery from above as in a broadcast, with paths, call and score. An end
    takes about a minute of film, and about as long to make. The page contains the whole game and
    plays it in any browser.
    """
    from agents.playing.record import ice_of, read_record
    from agents.playing.replay.film import write_film
    from agents.playing.replay.page import write_page
    from curling_env.errors import InputError
    from curling_env.ice import load_ice

    lines = read_record(record)
    if output.suffix.lower() == ".html":
        if ends:
            raise InputError("--end applies to films only: a page shows the whole game")
        write_page(output, lines, units)
        return
    known = load_ice(ice_of(lines, record) if ice is None else ice)
    with progress_bar("stone") as progress:
        write_film(output, lines, known, ends=ends, speed=speed, units=units, progress=progress)
