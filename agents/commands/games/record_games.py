"""`curling record-games`: ends by a player as a dataset for offline learning."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from agents.commands.games.play import PlayerOption
from curling_env.commands.options import IceOption, OutputDirectory, Results, SeedOption, grouped
from curling_env.commands.terminal import progress_bar

WITHIN = 0.1
"""Misfit up to which a throw explains a shot well [m]."""


@grouped
def record_games(
    output: OutputDirectory,
    player: PlayerOption = "search",
    opponent: Annotated[
        list[str] | None, Option(metavar="AGENT", help="Opponent; may be repeated.")
    ] = None,
    ends: Annotated[int, Option(min=1, max=10_000_000, help="Number of ends.")] = 100,
    task: Annotated[
        str | None, Option(help="A task of the benchmark, in a tier, instead of a player's ends.")
    ] = None,
    tier: Annotated[
        str, Option(help="With --task: random, medium or expert deliveries.")
    ] = "expert",
    deliveries: Annotated[
        int, Option(min=1, max=10**8, help="With --task: minimum number of deliveries.")
    ] = 100_000,
    shots: Annotated[
        bool, Option("--shots", help="With --task: actions are indices of shots (ends).")
    ] = False,
    ice: IceOption = "standard",
    seed: SeedOption = 0,
    table: Annotated[
        Path | None,
        Option(metavar="Stones.csv", help="Take real ends of a table of championship shots."),
    ] = None,
    *,
    results: Results,
) -> None:
    """Write ends as a Minari dataset, for learning without an environment.

    \b
    Examples:
        curling record-games --player search:400 --ends 200 -o runs/data
        curling record-games --opponent rulebased --opponent draw --ends 1000 -o runs/data
        curling record-games --task draw --tier medium -o runs/data
        curling record-games --task end-rulebased --tier expert --shots -o runs/data
        curling record-games --table Stones.csv -o runs/data
        MINARI_DATASETS_PATH=runs/data python -c \\
            "import minari; print(minari.load_dataset('curling/ends-v0').total_steps)"

    Each end of CurlingEnd-v0 is an episode, each delivery of the player a step: the observation,
    the action of its throw without execution error, the reward. The dataset contains the
    specification of the environment. With --task the dataset is one of a task of the benchmark
    (curling/TASK-TIER-v0), with reference scores. With --table each end of the table gives an
    episode of each team, with the throws that explain the shots (curling/doubles-v0), and a
    behaviour clone is scored on held-out games. Needs Minari: pip install 'curling-sheet[offline]'.
    """
    if table is not None:
        _record_shots(table, output, results)
        return
    from agents.benchmark.datasets import record_tier
    from agents.playing.offline_data import DATASET, record_ends
    from agents.playing.trained_player import player_from

    if task is not None:
        with progress_bar("delivery") as progress:
            folder = record_tier(
                output, task, tier, deliveries=deliveries, shots=shots, progress=progress
            )
        name = f"{folder.parent.name}/{folder.name}"
        results.show(
            {"dataset": name, "folder": str(folder), "task": task, "tier": tier},
            f"{tier} deliveries at {task} in {folder}",
        )
        return
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


def _record_shots(path: Path, output: Path, results: Results) -> None:
    """Write the ends of a table of shots, and score a copy of their throws."""
    from dataclasses import asdict

    from agents.playing.offline_data import check_minari
    from agents.shots.dataset import DATASET, copy_score, episodes_of, write_doubles
    from agents.shots.table import read_shots
    from curling_env.errors import placed

    check_minari()
    table = read_shots(path)
    with progress_bar("game") as progress, placed(source=path):
        episodes = list(episodes_of(table, progress=progress))
        score = copy_score(episodes)
    folder = write_doubles(output, episodes)
    misfits = [misfit for one in episodes for misfit in one.misfits.tolist()]
    within = sum(misfit <= WITHIN for misfit in misfits) / len(misfits)
    document = {
        "dataset": DATASET,
        "folder": str(folder),
        "episodes": len(episodes),
        "deliveries": len(misfits),
        "explained_within_10_cm": within,
        "copy": None if score is None else asdict(score),
    }
    words = f"{len(episodes)} episodes, {len(misfits)} deliveries in {folder}"
    results.show(document, f"{words}; {100 * within:.0f} % are explained within 10 cm")
