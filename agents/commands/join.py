"""`curling join`: play on a Digital Curling server."""

from __future__ import annotations

import os
import sys
from getpass import getpass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agents.commands.games.play import PlayerOption
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

if TYPE_CHECKING:
    from agents.digital_curling.dc4.join import Place4

PASSWORD = "CURLING_PASSWORD"
"""Environment variable with the password for a server of version 4."""


def join(
    server: Annotated[
        str,
        typer.Argument(
            metavar="HOST:PORT|URL",
            help="Version 3: where the server listens for your team. Version 4: https://HOST.",
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
    match: Annotated[
        str | None, typer.Option(metavar="ID", help="Version 4: the match, as its maker was told.")
    ] = None,
    team: Annotated[
        str, typer.Option(help="Version 4: the team wanted, team0 (throws first) or team1.")
    ] = "team0",
    user: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Version 4: user; the password is asked for, or read from CURLING_PASSWORD.",
        ),
    ] = None,
    certificate: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.pem",
            help="Version 4: a certificate that is trusted beside those of known authorities, such "
            "as that of a host on your own network.",
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
    """Play a game on a Digital Curling server: version 3 (over TCP) or version 4 (a URL).

    A server of version 3 has a port for each team: team 0 throws first, and team 1 has the hammer
    in the first end. The player compiles and plans before it says that it is ready. Then it thinks
    for a share of the time that its clock leaves, `search` with up to 30,000 simulated throws for
    each stone, or as many as you say (search:1000). With -o the game can be watched: open
    game.html, or make a film of it with `curling replay`. docs/digital-curling.md tells more.

    \b
    Examples:
        curling join 127.0.0.1:10000 --player search
        curling join 192.168.0.7:10001 --player search:1000 --name "Ice Age" -o runs/match
        curling join https://dc.example.org --match 0192… --team team1 --user anna
    """
    from functools import partial

    from agents.digital_curling.client import Client
    from agents.digital_curling.dc4.join import play_on_web_server
    from agents.digital_curling.game_record import record_of
    from agents.digital_curling.join import WireLog, address_of, play_on_server
    from agents.playing.record import write_lines
    from agents.playing.replay.page import write_page
    from agents.playing.scoreboard import scoreboard
    from agents.playing.trained_player import player_from
    from curling_env.errors import InputError
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import make_directory, together, write_text
    from curling_env.infrastructure.threads import one_thread

    one_thread()
    known = None if ice is None else load_ice(ice)
    if "://" in server:
        place = _place(server, match, team, user, certificate)
        play: Any = partial(play_on_web_server, place)
    else:
        play = partial(play_on_server, *address_of(server))
    rules = "dc4_server" if "://" in server else "digital_curling"
    client = Client(
        player_from(player), name=name, seed=seed, ice=known, remark=say, rule_name=rules
    )
    folder = None if output is None else make_directory(output)
    log = WireLog()
    try:
        with progress_bar("stone") as progress:

            def show() -> None:
                progress("playing", len(client.seen), client.rules.ends * client.rules.deliveries)

            play(client, log, on_update=show)
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


def _place(
    url: str, match: str | None, team: str, user: str | None, certificate: Path | None
) -> Place4:
    """Where to play by version 4; the password comes from the environment, or is asked for."""
    from agents.digital_curling.dc4.join import Place4
    from curling_env.errors import InputError

    if match is None or user is None:
        raise InputError("version 4 needs --match ID and --user NAME")
    if team not in ("team0", "team1"):
        raise InputError(f"--team is team0 or team1, got {team[:40]!r}")
    password = os.environ.get(PASSWORD)
    if password is None:
        if not sys.stdin.isatty():
            raise InputError(f"there is no password: set {PASSWORD}")
        password = getpass(f"password of {user}: ")
    place = Place4(
        url=url,
        match_id=match,
        team="team1" if team == "team1" else "team0",
        user=user,
        password=password,
        certificate=certificate,
    )
    if place.is_open:
        say("over http:// the password can be read on its way; https:// hides it")
    return place


def outcome_of(names: tuple[str, str], winner: str | None, reason: str) -> str:
    """Who won, and why, in a sentence."""
    if winner is None:
        return "A tie."
    name = names[int(winner == "team1")]
    loser = names[int(winner == "team0")]
    how = {"concede": f": {loser} concedes", "time_limit": f": {loser} ran out of time"}
    return f"{name} ({winner}) wins{how.get(reason, '')}."
