"""`curling tournament`: everybody against everybody."""

from __future__ import annotations

from typing import Annotated

import typer

from agents.commands.play import RulesOption, SkillOption, StillOption, SweepOption
from curling_env.cli import IceOption, SeedOption, print_json, progress


def tournament(
    players: Annotated[
        list[str],
        typer.Argument(
            metavar="AGENT...",
            help="Two or more of draw, rulebased, greedy, search (or search:500, search:0.2s), or "
            "files of models of `curling train`.",
        ),
    ],
    games: Annotated[int, typer.Option(min=1, help="Between every two of them.")] = 20,
    ends: Annotated[
        int | None, typer.Option(min=1, help="Of a game; the rules' own number without it.")
    ] = 8,
    ice: IceOption = "standard",
    rules: RulesOption = "world_curling_2024",
    skill: SkillOption = "elite",
    still: StillOption = False,
    sweep: SweepOption = True,
    as_json: Annotated[bool, typer.Option("--json", help="The table as JSON.")] = False,
    seed: SeedOption = 0,
) -> None:
    """Let players meet in many games: who wins how often, and how sure that is.

    Every two play the same number of games, each as home and with the hammer equally often. The
    table has the share of games won and an Elo rating, both with their 95 % interval: intervals
    that overlap mean that more games are needed.

    \b
    Example:
        curling tournament draw rulebased greedy --games 40 --ends 8
    """
    from dataclasses import asdict

    from agents.playing.tournament import as_text, play_tournament
    from agents.playing.trained import player_from
    from curling_env.game import STILL, USUAL, Rink
    from curling_env.rules import rule_set

    chosen = rule_set(rules) if ends is None else rule_set(rules, ends=ends)
    rink = Rink(ice, rules=chosen, skills=skill, living=STILL if still else USUAL, sweeping=sweep)
    table = play_tournament(
        rink,
        [player_from(name) for name in players],
        games=games,
        seed=seed,
        through=lambda items, label: progress(items, label, unit="game"),
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
