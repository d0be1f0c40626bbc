"""`curling tournament`: many games between players, everybody against everybody."""

from __future__ import annotations

from typing import Annotated

import typer

from agents.commands.games.play import RulesOption, SkillOption, StillOption, SweepOption
from curling_env.commands.cli import (
    DeliveryOption,
    IceOption,
    SeedOption,
    print_json,
    progress_bar,
    say_what_is_lacking,
)


def tournament(
    players: Annotated[
        list[str],
        typer.Argument(
            metavar="AGENT...",
            help="Two or more of draw, rulebased, greedy, search (or search:500, search:0.2s), or "
            "files of models of `curling train`.",
        ),
    ],
    games: Annotated[
        int, typer.Option(min=1, max=100_000, help="Games between every two players.")
    ] = 20,
    ends: Annotated[
        int | None, typer.Option(min=1, help="Ends of a game; by default the number of the rules.")
    ] = 8,
    ice: IceOption = "standard",
    rules: RulesOption = "world_curling_2024",
    skill: SkillOption = "elite",
    still: StillOption = False,
    sweep: SweepOption = True,
    delivery: DeliveryOption = "hog-line",
    workers: Annotated[
        str,
        typer.Option(
            metavar="N|ray|ray://HOST:PORT",
            help="Local processes, the current Ray cluster, or the one at an address.",
        ),
    ] = "1",
    as_json: Annotated[bool, typer.Option("--json", help="Print the table as JSON.")] = False,
    seed: SeedOption = 0,
) -> None:
    """Play many games between players: who wins how often, and how sure that is.

    Every two players play the same number of games, each as home and with the hammer equally often.
    The table shows the share of games won and an Elo rating, both with their 95 % interval; where
    intervals overlap, more games are needed. Games are played side by side on all workers, and the
    table is the same on any number of them, unless a player thinks by the clock (search:0.2s).

    \b
    Examples:
        curling tournament draw rulebased greedy --games 40 --ends 8
        curling tournament search:1000 rulebased --games 60 --workers 8
    """
    from dataclasses import asdict

    from agents.playing.tournament import as_text, play_tournament
    from agents.playing.trained_player import player_from
    from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION, GameSimulator
    from curling_env.game.rules import rule_set
    from curling_env.game.skill_file import load_skill
    from curling_env.infrastructure.threads import one_thread
    from curling_env.throw import delivery_named

    one_thread()
    chosen = rule_set(rules) if ends is None else rule_set(rules, ends=ends)
    simulator = GameSimulator(
        ice,
        rules=chosen,
        skills=load_skill(skill),
        ice_evolution=NO_EVOLUTION if still else TYPICAL_EVOLUTION,
        sweeping=sweep,
        delivery=delivery_named(delivery),
    )
    say_what_is_lacking(simulator.ice)
    opponents = [player_from(name) for name in players]
    with progress_bar(unit="game") as progress:
        table = play_tournament(
            simulator, opponents, games=games, seed=seed, progress=progress, workers=workers
        )
    if as_json:
        print_json(
            {
                "standings": [asdict(standing) for standing in table.standings],
                "players": list(table.names),
                "wins": table.wins.tolist(),
                "games_of_every_two": games,
                "rules": chosen.name,
                "ends": chosen.ends,
                "ice": ice,
                "seed": seed,
            }
        )
        return
    print(as_text(table))
