"""`curling host`: let Digital Curling's clients play on our ice."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents.commands.join import outcome_of
from curling_env.commands.cli import (
    IceOption,
    JsonOption,
    SeedOption,
    UnitsOption,
    Writes,
    conclude,
    say,
    say_what_is_unknown,
)
from curling_env.commands.terminal import shortened
from curling_env.units import Units

TeamOption = Annotated[
    str | None,
    typer.Option(
        metavar="AGENT",
        help="A player of this project for the team: draw, rulebased, greedy, search, module:Class "
        "or a model's file; by default a client takes the seat.",
    ),
]
NoiseOption = Annotated[
    str,
    typer.Option(
        metavar="SKILL",
        help="Execution error of the team's players: none, elite, digital-curling, champion, club, "
        "or SPEED:ANGLE, standard deviations in m/s and rad. One for all, or four with commas, "
        "in the order in which clients are told of them.",
    ),
]


def host(
    ice: IceOption = "fcv1",
    team0: TeamOption = None,
    team1: TeamOption = None,
    ends: Annotated[int, typer.Option(min=1, max=20, help="Number of ends.")] = 8,
    time: Annotated[
        float, typer.Option(min=1, max=1e5, help="Thinking time of each team for the game [s].")
    ] = 600.0,
    extra_time: Annotated[
        float, typer.Option(min=1, max=1e5, help="Thinking time for each extra end [s].")
    ] = 60.0,
    noise0: NoiseOption = "digital-curling",
    noise1: NoiseOption = "digital-curling",
    max_speed: Annotated[
        float, typer.Option(min=1, max=6, help="The fastest throw that may be meant [m/s].")
    ] = 4.0,
    four_rock: Annotated[
        bool, typer.Option("--four-rock", help="Guards are protected for four stones, not five.")
    ] = False,
    evolve: Annotated[
        bool,
        typer.Option("--evolve", help="Ice that wears and frosts over, and stones that differ."),
    ] = False,
    sweep: Annotated[
        bool, typer.Option("--sweep", help="Sweepers of the host help a stone that is light.")
    ] = False,
    announce: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Name of the physics that clients are told; by default fcv1 for that preset, and "
            "else curling_ice, which some clients refuse: they want fcv1.",
        ),
    ] = None,
    trajectory: Annotated[
        bool, typer.Option("--trajectory", help="Tell clients the paths of each shot.")
    ] = False,
    bind: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS", help="Where to listen; 0.0.0.0 for all networks of this machine."
        ),
    ] = "127.0.0.1",
    port: Annotated[
        int,
        typer.Option(
            min=0, max=65534, help="Port of team 0; team 1 has the next one. 0 takes free ones."
        ),
    ] = 10000,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Directory for the logs: game.dcl2 and shot_e000s00.json as Digital Curling's "
            "viewers read them, and game.jsonl and game.html for `curling replay` and a browser.",
        ),
        Writes(folder=True),
    ] = None,
    as_json: JsonOption = False,
    units: UnitsOption = Units.METRES,
    seed: SeedOption = 0,
) -> None:
    """Host a game of Digital Curling 3 on any ice, for its clients and for our players.

    Unmodified clients connect as to their own server (protocol 1.x over TCP), one port for each
    team; team 1 has the hammer in the first end. They play against each other or against a player
    of this project, on a preset or on ice that was estimated from film. A client that hangs up or
    runs out of time loses; one that sends other things than moves is heard no more after some. Only
    programs on this machine get in, unless --bind says otherwise. docs/digital-curling.md tells
    more.

    \b
    Examples:
        curling host --ice ice.json --team1 search -o runs/match
        curling host --ice standard --announce fcv1 --ends 4 --time 300
    """
    import asyncio

    from agents.digital_curling.hosting.seats import PlayerSeat
    from agents.digital_curling.hosting.server import Hosting, host_game
    from agents.digital_curling.hosting.setting import HostSetting, throwers_from
    from agents.playing.record import write_lines
    from agents.playing.replay.page import write_page
    from agents.playing.scoreboard import scoreboard
    from agents.playing.trained_player import player_from
    from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import make_directory, together

    setting = HostSetting(
        ice=load_ice(ice),
        ice_name=ice,
        ends=ends,
        five_rock=not four_rock,
        thinking_time=time,
        extra_time=extra_time,
        throwers=(throwers_from(noise0), throwers_from(noise1)),
        max_speed=max_speed,
        announced=announce or ("fcv1" if ice == "fcv1" else "curling_ice"),
        send_trajectory=trajectory,
        ice_evolution=TYPICAL_EVOLUTION if evolve else NO_EVOLUTION,
        sweeping=sweep,
        seed=seed,
    )
    say_what_is_unknown(setting.ice)
    players = [None if name is None else PlayerSeat(player_from(name)) for name in (team0, team1)]
    folder = None if output is None else make_directory(output)

    def tell(text: str) -> None:
        say(shortened(text), now=True)  # somebody waits for it, and a client may have any name

    hosting = Hosting(setting, remark=tell)

    def say_where(ports: tuple[int, int]) -> None:
        for team, seat in enumerate(players):
            if seat is None:
                tell(f"team{team} comes in at {bind}:{ports[team]}")

    try:
        asyncio.run(
            host_game(
                hosting,
                (players[0], players[1]),
                address=bind,
                ports=(port, port + 1 if port else 0),
                opened=say_where,
            )
        )
    finally:
        # A game that broke off is kept as far as it went.
        if folder is not None and hosting.game is not None:
            lines = hosting.game.record()
            with together():
                hosting.log.write(folder, hosting.game, hosting.game_id, hosting.date_time)
                write_lines(folder / "game.jsonl", lines)
                write_page(folder / "game.html", lines, units)
    game = hosting.game
    assert game is not None
    assert game.result is not None
    if folder is not None:
        say(f"recorded in {folder}; open {folder / 'game.html'} to watch the game")
    conclude(
        {
            "team0": game.names[0],
            "team1": game.names[1],
            "game_id": hosting.game_id,
            "ice": ice,
            "seed": seed,
            "score": list(game.game.score),
            "line_score": [list(end) for end in game.game.line_score],
            "winner": game.result["winner"],
            "reason": game.result["reason"],
            "stones": sum(shot["trajectory"] is not None for shot in game.shots),
        },
        scoreboard(game.game, game.names),
        outcome_of(game.names, game.result["winner"], game.result["reason"]),
        as_json=as_json,
    )
