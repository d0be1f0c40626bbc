"""`curling play`: play a game between two players."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import (
    DeliveryOption,
    IceOption,
    SeedOption,
    UnitsOption,
    Writes,
    print_json,
    progress_bar,
    say,
    say_what_is_lacking,
)
from curling_env.typing import with_progress
from curling_env.units import Units

PlayerOption = Annotated[
    str,
    typer.Option(
        metavar="AGENT",
        help="draw, rulebased, greedy, search (or search:500, search:0.2s: throws or seconds of "
        "thought before each delivery; search:500:points plays for points), module:Class for a "
        "player of your own, or the file of a model of `curling train`.",
    ),
]
RulesOption = Annotated[
    str,
    typer.Option(
        help="world_curling_2024, mixed_doubles_2024, digital_curling, or Digital Curling 4 as "
        "digital_curling_4, digital_curling_4_no_tick, dc4_server, dc4_server_no_tick or "
        "dc4_server_mixed_doubles."
    ),
]
SkillOption = Annotated[
    str,
    typer.Option(
        help="Execution error of both players: none, elite, digital-curling, champion, "
        "championship or club, or the file of an athlete from `curling athletes`."
    ),
]
StillOption = Annotated[
    bool,
    typer.Option("--still", help="Ice that does not change, and stones that are all alike."),
]
SweepOption = Annotated[
    bool, typer.Option("--sweep/--no-sweep", help="Whether sweepers help a stone that is light.")
]


def play(
    home: PlayerOption,
    away: PlayerOption,
    ends: Annotated[
        int | None, typer.Option(min=1, help="Number of ends; by default that of the rules.")
    ] = None,
    ice: IceOption = "standard",
    rules: RulesOption = "world_curling_2024",
    skill: SkillOption = "elite",
    known_ice: Annotated[
        str | None,
        typer.Option(metavar="ICE", help="Ice as the players know it; by default the true one."),
    ] = None,
    hammer: Annotated[
        str, typer.Option(help="Team with the last stone in the first end: home, away or lot.")
    ] = "lot",
    still: StillOption = False,
    sweep: SweepOption = True,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Directory for the record (game.jsonl) and its replay (game.html).",
        ),
        Writes(folder=True),
    ] = None,
    delivery: DeliveryOption = "hog-line",
    film: Annotated[
        bool, typer.Option("--film", help="With -o, also make a film (game.mp4); it takes minutes.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    units: UnitsOption = Units.METRES,
    seed: SeedOption = 0,
) -> None:
    """Play a game between two players and print its line score.

    The ice wears along the stones' paths and frosts over, stones differ slightly, sweepers sweep
    stones that are light, and players make execution errors; options switch each of these off. With
    -o the game is recorded with the path of every stone, together with a page that replays it in
    any browser. `curling replay` makes a film of the record.

    \b
    Examples:
        curling play --home rulebased --away draw --ends 8 -o runs/game
        curling play --home greedy --away rulebased --ice ice.json --seed 7 --json
        curling play --home rulebased --away greedy --rules mixed_doubles_2024
    """
    from agents.playing.match import Match, PlayedGame
    from agents.playing.record import result_of, write_record
    from agents.playing.replay.film import write_film
    from agents.playing.replay.page import write_page
    from agents.playing.scoreboard import outcome, scoreboard
    from agents.playing.trained_player import player_from
    from curling_env.errors import InputError
    from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION, GameSimulator
    from curling_env.game.rules import Team, rule_set
    from curling_env.game.skill_file import load_skill
    from curling_env.infrastructure.files.storage import make_directory, together
    from curling_env.infrastructure.threads import one_thread
    from curling_env.throw import delivery_named

    one_thread()
    if film and output is None:
        raise InputError("--film needs a directory for it: -o DIR")
    if hammer not in ("home", "away", "lot"):
        raise InputError(f"--hammer is home, away or lot, got {hammer!r}")
    chosen = rule_set(rules) if ends is None else rule_set(rules, ends=ends)
    players = (player_from(home), player_from(away))
    simulator = GameSimulator(
        ice,
        known_ice=known_ice,
        rules=chosen,
        skills=load_skill(skill),
        ice_evolution=NO_EVOLUTION if still else TYPICAL_EVOLUTION,
        sweeping=sweep,
        delivery=delivery_named(delivery),
    )
    say_what_is_lacking(simulator.ice, simulator.known_ice)
    match = Match(
        simulator,
        players,
        seed=seed,
        last_stone=None if hammer == "lot" else Team[hammer.upper()],
        paths=output is not None,
    )
    stones = chosen.ends * chosen.deliveries
    with progress_bar("stone") as progress:
        deliveries = tuple(with_progress(match, "playing", progress, stones))
    played = PlayedGame(players=players, deliveries=deliveries, game=match.game)
    if output is not None:
        folder = make_directory(output)
        with together():
            lines = write_record(folder / "game.jsonl", played, simulator, ice=ice, seed=seed)
            write_page(folder / "game.html", lines, units)
            if film:
                shown = write_film(folder / "game.mp4", lines, simulator.known_ice, units=units)
                with progress_bar("stone") as progress:
                    for _ in with_progress(shown, "filming", progress, len(deliveries)):
                        pass
        say(f"recorded in {folder / 'game.jsonl'}; open {folder / 'game.html'} to watch it")
    names = (players[0].name, players[1].name)
    if as_json:
        print_json(
            {
                "home": names[0],
                "away": names[1],
                "rules": chosen.name,
                "ends": chosen.ends,
                "ice": ice,
                "seed": seed,
                "deliveries": len(deliveries),
                **result_of(played.game),
            }
        )
        return
    print(scoreboard(played.game, names))
    print(outcome(played.game, names))
