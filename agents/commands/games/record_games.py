"""`curling record-games`: ends by a player as a dataset for offline learning."""

from __future__ import annotations

from typing import Annotated

from typer import Option

from agents.commands.games.play import PlayerOption
from curling_env.commands.options import IceOption, OutputDirectory, Results, SeedOption, grouped
from curling_env.commands.terminal import progress_bar


@grouped
def record_games(
    output: OutputDirectory,
    player: PlayerOption = "search",
    opponent: Annotated[
        list[str] | None, Option(metavar="AGENT", help="Opponent; may be repeated.")
    ] = None,
    ends: Annotated[int, Option(min=1, max=10_000_000, help="Number of ends.")] = 100,
    ice: IceOption = "standard",
    seed: SeedOption = 0,
    *,
    results: Results,
) -> None:
    """Play ends and write them as a Minari dataset, for learning without an environment.

    \b
    Examples:
        curling record-games --player search:400 --ends 200 -o runs/data
        curling record-games --opponent rulebased --opponent draw --ends 1000 -o runs/data
        MINARI_DATASETS_PATH=runs/data python -c \\
            "import minari; print(minari.load_dataset('curling/ends-v0').total_steps)"

    Each end of CurlingEnd-v0 is an episode, each delivery of the player a step: the observation,
    the action of its throw without execution error, the reward. The dataset contains the
    specification of the environment. Needs Minari: pip install 'curling-sheet[offline]'.
    """
    from agents.playing.offline_data import DATASET, record_ends
    from agents.playing.trained_player import player_from

    with progress_bar("end") as progress:
        folder = record_ends(
            output,
            player_from(player),
            ends=ends,
            options={"opponent": opponent or ["rulebased"], "ice": ice},
            seed=seed,
            progress=progress,
        )
    document = {"dataset": DATASET, "folder": str(folder), "ends": ends, "player": player}
    results.show(document, f"{ends} ends by {player} in {folder}")
