"""`curling join`: play on a Digital Curling server."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agents.commands.play import PlayerOption
from curling_env.commands.cli import (
    JsonOption,
    SeedOption,
    UnitsOption,
    Writes,
    conclude,
    progress_bar,
    say,
)
from curling_env.units import Units


def join(
    server: Annotated[
        str,
        typer.Argument(
            metavar="HOST:PORT", help="Where the server listens for your team, such as 10000."
        ),
    ],
    player: PlayerOption = "search",
    name: Annotated[
        str | None, typer.Option(metavar="NAME", help="Name of your team; by default the player's.")
    ] = None,
    ice: Annotated[
        str | None,
        typer.Option(
            "--ice",
            metavar="ICE",
            help="The ice that the player believes in: a file or a preset; by default Digital "
            "Curling's law (fcv1) on a sheet as wide as the server says.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Directory for the record (game.jsonl), its replay (game.html) and all lines of "
            "the conversation (wire.jsonl).",
        ),
        Writes(folder=True),
    ] = None,
    as_json: JsonOption = False,
    units: UnitsOption = Units.METRES,
    seed: SeedOption = 0,
) -> None:
    """Play a game on a Digital Curling 3 server (protocol 1.x over TCP).

    The server has a port for each team: team 0 throws first, and team 1 has the hammer in the first
    end. The player compiles and plans before it says that it is ready. Then it thinks for a share
    of the time that its clock leaves, `search` with up to 30,000 simulated throws for each stone,
    or as many as you say (search:3000). With -o the game can be watched: open game.html, or make a
    film of it with `curling replay`. docs/digital-curling.md tells more.

    \b
    Examples:
        curling join 127.0.0.1:10000 --player search
        curling join 192.168.0.7:10001 --player search:3000 --name "Ice Age" -o runs/match
    """
    from agents.digital_curling.client import Client
    from agents.digital_curling.game_record import record_of
    from agents.digital_curling.join import WireLog, address_of, play_on_server
    from agents.playing.record import write_lines
    from agents.playing.replay.page import write_page
    from agents.playing.scoreboard import scoreboard
    from agents.playing.trained_player import player_from
    from curling_env.errors import InputError
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import make_directory, together, write_text

    host, port = address_of(server)
    known = None if ice is None else load_ice(ice)
    client = Client(player_from(player), name=name, seed=seed, ice=known, remark=say)
    folder = None if output is None else make_directory(output)
    log = WireLog()
    try:
        with progress_bar("stone") as progress:

            def show() -> None:
                progress("playing", len(client.seen), client.rules.ends * client.rules.deliveries)

            play_on_server(host, port, client, log, on_update=show)
    finally:
        # A game that broke off is kept as far as it went.
        if folder is not None and log.lines:
            lines = []
            try:
                lines = record_of(client, ice=ice or "fcv1") if client.seen else []
            except InputError as error:
                say(f"no replay of this game can be made: {error}")
            with together():
                write_text(folder / "wire.jsonl", log.text())
                if lines:
                    write_lines(folder / "game.jsonl", lines)
                    write_page(folder / "game.html", lines, units)
    if folder is not None and client.seen:
        say(f"recorded in {folder}; open {folder / 'game.html'} to watch the game")
    game, result = client.game, client.result
    assert game is not None
    assert result is not None
    conclude(
        {
            "team": f"team{client.team.value}",
            "team0": client.names[0],
            "team1": client.names[1],
            "game_id": client.game_id,
            "score": list(game.score),
            "line_score": [list(end) for end in game.line_score],
            "winner": result.winner,
            "reason": result.reason,
            "stones": len(client.seen),
        },
        scoreboard(game, client.names),
        outcome_of(client.names, result.winner, result.reason),
        as_json=as_json,
    )


def outcome_of(names: tuple[str, str], winner: str | None, reason: str) -> str:
    """Who won, and why, in a sentence."""
    if winner is None:
        return "A tie."
    name = names[int(winner == "team1")]
    loser = names[int(winner == "team0")]
    how = {"concede": f": {loser} concedes", "time_limit": f": {loser} ran out of time"}
    return f"{name} ({winner}) wins{how.get(reason, '')}."
