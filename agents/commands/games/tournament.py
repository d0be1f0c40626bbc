"""`curling tournament`: games of every pair of players."""

from __future__ import annotations

from typing import Annotated

from typer import Argument, Option

from agents.commands.games.play import GameOptions
from curling_env.commands.options import Results, SeedOption, WorkersOption, grouped
from curling_env.commands.terminal import print_json, progress_bar


@grouped
def tournament(
    players: Annotated[
        list[str], Argument(metavar="AGENT...", help="Players, see `curling play`.")
    ],
    games: Annotated[int, Option(min=1, max=100_000, help="Games of each pair of players.")] = 20,
    ends: Annotated[int | None, Option(min=1, help="Number of ends of a game.")] = 8,
    workers: WorkersOption = "1",
    seed: SeedOption = 0,
    *,
    game: GameOptions,
    results: Results,
) -> None:
    """Play many games between players: win rates and Elo ratings with 95 % intervals.

    \b
    Examples:
        curling tournament draw rulebased greedy --games 40 --ends 8
        curling tournament search:1000 rulebased --games 60 --workers 8

    Every pair plays the same number of games, each player as home and with the hammer equally
    often. Where intervals overlap, more games are needed. The table is the same on any number of
    workers, unless a player has a time limit (search:0.2s). See docs/agents.md.
    """
    from agents.playing.tournament import as_text, play_tournament
    from agents.playing.trained_player import player_from

    simulator = game.simulator(ends)
    opponents = [player_from(name) for name in players]
    with progress_bar("game") as progress:
        table = play_tournament(
            simulator, opponents, games=games, seed=seed, progress=progress, workers=workers
        )
    if not results.as_json:
        print(as_text(table))
        return
    rules = simulator.rules
    about = {"games_of_every_two": games, "rules": rules.name, "ends": rules.ends}
    print_json({**table.as_dict(), **about, "ice": game.ice, "seed": seed})
