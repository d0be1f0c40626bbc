"""`curling hands`: execution errors of championship players from a table of shots."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from curling_env.commands.options import IceOption, Results, SeedOption, grouped, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark, progress_bar


@grouped
def hands(
    table: Annotated[Path, Argument(metavar="Stones.csv", help="Table of championship shots.")],
    output: Annotated[
        Path | None,
        output_to("DIR", "Also write report.json and a skill file for each player."),
        Writes(folder=True),
    ] = None,
    ice: IceOption = "standard",
    positions: Annotated[
        int, Option(min=10, max=5000, help="Number of real positions of each task.")
    ] = 100,
    seed: SeedOption = 0,
    *,
    results: Results,
) -> None:
    """Measure the execution errors of championship players from a table of shots.

    \b
    Examples:
        curling hands Stones.csv -o hands
        curling plan --ice ice.json --target 0,17.37 --skill hands/all.skill.json

    Real positions are thrown from: errors are those with which the stones' real places are most
    likely, if teams call what the search values. Each task has errors with 95 % intervals. Each
    player's errors follow from its grades, by a model whose scatter is estimated. Takes about two
    minutes of one core. See docs/championships.md for what the table cannot separate: ice, sweeping
    and intent.
    """
    from agents.shots.hands import fit_hands, in_words, write_hands
    from agents.shots.table import is_shot_table, read_shots
    from curling_env.errors import InputError, placed
    from curling_env.ice import load_ice

    if not is_shot_table(table):
        raise InputError("expected a table of shots: ShotID, Task, stone_1_x …", source=table)
    with placed(source=table), progress_bar("task") as progress:
        found = fit_hands(
            read_shots(table), load_ice(ice), positions=positions, seed=seed, progress=progress
        )
    if output is not None:
        files = write_hands(output, found, table, seed=seed)
        print_remark(f"{len(files)} files: {output}")
    results.show(found.as_dict(), *in_words(found))
