"""Ends of search against itself beside those of championships: scores, grades, chances to win.

python scripts/ends.py play championship --games 110 --seed 700000   games under named conditions
python scripts/ends.py play factors --games 12 --seed 100            each change by itself
python scripts/ends.py tell runs/ends/championship.jsonl             the tables of played games
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
from agents.playing.ends.levels import BY_THE_ODDS, CHAMPIONSHIP, FACTORS, FORMER_FIT
from agents.playing.ends.records import games_in, played_games
from agents.playing.ends.results import (
    RESULTS,
    calibration,
    counted,
    kept_document,
    kept_results,
    summary,
    summary_text,
)
from curling_env.commands.cli import progress_bar, say
from curling_env.errors import CurlingError, InputError
from curling_env.infrastructure.files.storage import write_json

FOLDER = Path("runs/ends")
PICTURE = Path("docs/pictures/validation/ends.png")
NAMED = {"championship": CHAMPIONSHIP, "by-the-odds": BY_THE_ODDS}
CALIBRATED = ("championship", FORMER_FIT)
"""The conditions of which so many games are played that predictions can be held against them."""

app = typer.Typer(no_args_is_help=True, help=__doc__)


@app.command()
def play(
    name: Annotated[str, typer.Argument(help=f"{', '.join(NAMED)}, factors, or one of these.")],
    games: Annotated[int, typer.Option(min=1, help="Games under each conditions.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first game.")] = 100,
    workers: Annotated[str, typer.Option(help="Processes.")] = "1",
    folder: Annotated[Path, typer.Option(help="Where the games are kept.")] = FOLDER,
) -> None:
    """Play games, or those that are still missing, and tell how their ends were scored."""
    known = {**NAMED, **FACTORS}
    if name != "factors" and name not in known:
        raise InputError(f"no conditions are named {name!r}; there are factors, {', '.join(known)}")
    wanted = FACTORS if name == "factors" else {name: known[name]}
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
def keep(folder: Annotated[Path, typer.Option(help="Where the games are kept.")] = FOLDER) -> None:
    """Write what the package keeps of these games, and the picture of the documents.

    Of conditions without games in the folder the kept results stay.
    """
    known = {**NAMED, **FACTORS}
    files = {name: folder / f"{_file_name(name)}.jsonl" for name in known}
    played = {name: path for name, path in files.items() if path.exists()}
    if not played:
        raise InputError(f"{folder} holds no games; play them first")
    kept = kept_results()
    found = {name: one for name, one in kept["found"].items() if name in known}
    for name, path in played.items():
        found[name] = (summary if name == "championship" else counted)(path, known[name])
    long = [played[name] for name in CALIBRATED if name in played]
    told = calibration(long) if len(long) == len(CALIBRATED) else kept["calibration"]
    write_json(RESULTS, kept_document(found, told))
    draw_ends(found, told, PICTURE)
    say(f"{RESULTS} and {PICTURE}: {len(played)} of {len(found)} conditions anew")


def _file_name(title: str) -> str:
    return "".join(letter if letter.isalnum() else "-" for letter in title)


if __name__ == "__main__":
    try:
        app(standalone_mode=False)
    except CurlingError as error:
        print(f"ends: {error}", file=sys.stderr)
        sys.exit(2)
