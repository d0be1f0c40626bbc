"""`curling record-games`: ends by a player as a dataset for offline learning."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import (
    IceOption,
    OutputDirectory,
    SeedOption,
    conclude,
    progress_bar,
)


def record_games(
    output: OutputDirectory,
    player: Annotated[
        str,
        typer.Option(help="Who plays as the agent: draw, rulebased, greedy, search, search:500, …"),
    ] = "search",
    opponent: Annotated[
        list[str] | None,
        typer.Option(
            help="Who plays against it, rulebased by default; may be given several times: every "
            "end then draws one."
        ),
    ] = None,
    ends: Annotated[int, typer.Option(min=1, max=10_000_000, help="Number of ends.")] = 100,
    ice: IceOption = "standard",
    as_json: Annotated[bool, typer.Option("--json", help="Print only the JSON.")] = False,
    seed: SeedOption = 0,
) -> None:
    """Play ends and write them as a Minari dataset, to learn from without an environment.

    Each end of CurlingEnd-v0 is an episode, each delivery of the player a step: the observation,
    the action that means its throw without execution error, the reward. The dataset holds the
    specification of the environment. Needs Minari: pip install 'curling-sheet[offline]'.

    \b
    Examples:
        curling record-games --player search:400 --ends 200 -o runs/data
        curling record-games --opponent rulebased --opponent draw --ends 1000 -o runs/data
        MINARI_DATASETS_PATH=runs/data python -c \\
            "import minari; print(minari.load_dataset('curling/ends-v0').total_steps)"
    """
    from agents.playing.offline_data import DATASET, record_ends
    from agents.playing.trained_player import player_from

    with progress_bar(unit="end") as progress:
        folder: Path = record_ends(
            output,
            player_from(player),
            ends=ends,
            options={"opponent": opponent or ["rulebased"], "ice": ice},
            seed=seed,
            progress=progress,
        )
    document = {"dataset": DATASET, "folder": str(folder), "ends": ends, "player": player}
    conclude(document, f"{ends} ends by {player} in {folder}", as_json=as_json)
