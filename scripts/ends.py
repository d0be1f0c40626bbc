"""Ends of search against itself beside those of championships: scores, grades, chances to win.

python scripts/ends.py play championship --games 110 --seed 700000   games under named conditions
python scripts/ends.py play factors --games 12 --seed 100            each change by itself
python scripts/ends.py tell runs/ends/championship.jsonl             the tables of played games
python scripts/ends.py hits                                          grades of doubles and others
python scripts/ends.py keep                                          results.json and the picture

Games are kept one by one in runs/ends; what was interrupted goes on where it stopped. Seeds decide
everything: any number of workers gives the same games. docs/validation-hands.md tells the results.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from agents.playing.ends.figure import draw_ends
from agents.playing.ends.grades import BEST
from agents.playing.ends.levels import BY_THE_ODDS, CHAMPIONSHIP, FACTORS
from agents.playing.ends.play import grades_of_hits
from agents.playing.ends.records import games_in, played_games
from agents.playing.ends.results import RESULTS, counted, kept_document, summary, summary_text
from curling_env.commands.cli import progress_bar, say
from curling_env.errors import CurlingError, InputError
from curling_env.infrastructure.files.storage import write_json

FOLDER = Path("runs/ends")
PICTURE = Path("docs/pictures/validation/ends.png")
NAMED = {"championship": CHAMPIONSHIP, "by-the-odds": BY_THE_ODDS}

app = typer.Typer(no_args_is_help=True, help=__doc__)


@app.command()
def play(
    name: Annotated[str, typer.Argument(help=f"{', '.join(NAMED)}, or factors.")],
    games: Annotated[int, typer.Option(min=1, help="Games under each conditions.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first game.")] = 100,
    workers: Annotated[str, typer.Option(help="Processes.")] = "1",
    folder: Annotated[Path, typer.Option(help="Where the games are kept.")] = FOLDER,
) -> None:
    """Play games, or those that are still missing, and tell how their ends were scored."""
    if name != "factors" and name not in NAMED:
        raise InputError(f"no conditions are named {name!r}; there are {', '.join(NAMED)}, factors")
    wanted = FACTORS if name == "factors" else {name: NAMED[name]}
    for title, conditions in wanted.items():
        path = folder / f"{_file_name(title)}.jsonl"
        with progress_bar("game") as progress:
            played_games(
                path, conditions, range(seed, seed + games), workers=workers, progress=progress
            )
        print(f"{title}\n{summary_text(games_in(path))}\n", flush=True)


@app.command()
def tell(file: Annotated[Path, typer.Argument(help="Games that were played.")]) -> None:
    """The tables of played games."""
    print(summary_text(games_in(file)))


@app.command()
def hits(
    games: Annotated[int, typer.Option(min=1, help="Games that are played for it.")] = 6,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first game.")] = 900_000,
) -> None:
    """Grades of hits by what they were meant to take out, as championships are played."""
    found = grades_of_hits(CHAMPIONSHIP, range(seed, seed + games))
    every = sum(map(len, found.values()))
    for meaning, points in found.items():
        if points:
            mean = 100 * sum(points) / BEST / len(points)
            print(f"{meaning:<22}{len(points):5d} ({len(points) / every:.0%})  grade {mean:.0f} %")


@app.command()
def keep(folder: Annotated[Path, typer.Option(help="Where the games are kept.")] = FOLDER) -> None:
    """Write what the package keeps of all these games, and the picture of the documents."""
    found = {
        name: (summary if name in NAMED else counted)(path, conditions)
        for name, conditions in {**NAMED, **FACTORS}.items()
        for path in [folder / f"{_file_name(name)}.jsonl"]
        if path.exists()
    }
    if "championship" not in found:
        raise InputError(f"{folder} holds no games named championship; play them first")
    write_json(RESULTS, kept_document(found))
    draw_ends(found, PICTURE)
    say(f"{RESULTS} and {PICTURE}: {len(found)} conditions")


def _file_name(title: str) -> str:
    return "".join(letter if letter.isalnum() else "-" for letter in title)


if __name__ == "__main__":
    try:
        app(standalone_mode=False)
    except CurlingError as error:
        print(f"ends: {error}", file=sys.stderr)
        sys.exit(2)
