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
    say_what_is_lacking,
)
from curling_env.commands.terminal import shortened
from curling_env.units import Units

TeamOption = Annotated[
    str,
    typer.Option(
        metavar="AGENT",
        help="Who plays for the team: dc3 or dc4, a client of that version, or a player of this "
        "project: draw, rulebased, greedy, search, module:Class or a model's file.",
    ),
]
NoiseOption = Annotated[
    str | None,
    typer.Option(
        metavar="SKILL",
        help="Execution error of the team's players: none, elite, digital-curling, champion, "
        "championship, club, or SPEED:ANGLE, standard deviations in m/s and rad. One for all, or "
        "four with commas, "
        "in the order in which clients are told of them. By default digital-curling, and for a "
        "client of version 4 what it says of its players.",
    ),
]


def host(
    ice: IceOption = "fcv1",
    team0: TeamOption = "dc3",
    team1: TeamOption = "dc3",
    rules: Annotated[
        str | None,
        typer.Option(
            help="digital_curling (version 3), or of version 4 dc4_server, dc4_server_no_tick, "
            "digital_curling_4, digital_curling_4_no_tick or, for mixed doubles, "
            "dc4_server_mixed_doubles; by default those of the clients."
        ),
    ] = None,
    arrangement: Annotated[
        int,
        typer.Option(
            min=0,
            max=5,
            metavar="NUMBER",
            help="Mixed doubles: which of version 4's arrangements of the placed stones is played.",
        ),
    ] = 0,
    ends: Annotated[int, typer.Option(min=1, max=20, help="Number of ends.")] = 8,
    time: Annotated[
        float, typer.Option(min=1, max=1e5, help="Thinking time of each team for the game [s].")
    ] = 600.0,
    extra_time: Annotated[
        float, typer.Option(min=1, max=1e5, help="Thinking time for each extra end [s].")
    ] = 60.0,
    noise0: NoiseOption = None,
    noise1: NoiseOption = None,
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
    http: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            metavar="PORT",
            help="Port of the page to watch on, and of version 4; 0 takes a free one. By default "
            "8000 where a client of version 4 plays, else none.",
        ),
    ] = None,
    passwords: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help='Version 4: passwords by user, {"anna": "…", "ben": "…"}; by default the users '
            "team0 and team1 are given new ones, which are shown.",
        ),
    ] = None,
    certificate: Annotated[
        Path | None,
        typer.Option(
            metavar="CERT.pem",
            help="Serve https: the certificate, and those that lead to a known authority.",
        ),
    ] = None,
    key: Annotated[
        Path | None,
        typer.Option(metavar="KEY.pem", help="Its private key; by default in the same file."),
    ] = None,
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
    """Host a game of Digital Curling on any ice, for its clients and for our players.

    Unmodified clients connect as to their own server: those of version 3 over TCP, one port for
    each team, those of version 4 over HTTP. Team 1 has the hammer in the first end. They play
    against each other or against a player of this project, on a preset or on ice that was estimated
    from film. A client that hangs up or runs out of time loses; one that sends other things than
    moves is heard no more after some. Only programs on this machine get in, unless --bind says
    otherwise. docs/digital-curling.md tells more.

    \b
    Examples:
        curling host --ice ice.json --team1 search -o runs/match
        curling host --ice standard --announce fcv1 --ends 4 --time 300
        curling host --ice ice.json --team0 dc4 --team1 search --http 8000
        curling host --team0 dc4 --team1 dc4 --bind 0.0.0.0 --certificate cert.pem --key key.pem
    """
    import asyncio

    from agents.digital_curling.hosting.seats import PlayerSeat
    from agents.digital_curling.hosting.server import Hosting, host_game
    from agents.digital_curling.hosting.setting import HostSetting, throwers_from
    from agents.playing.record import write_lines
    from agents.playing.replay.page import write_page
    from agents.playing.scoreboard import scoreboard
    from agents.playing.trained_player import player_from
    from curling_env.errors import InputError
    from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION
    from curling_env.game.rules import Team
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.storage import make_directory, together
    from curling_env.infrastructure.threads import one_thread

    one_thread()
    words = (team0, team1)
    web = http is not None or "dc4" in words
    usual = "dc4_server" if "dc4" in words else "digital_curling"
    setting = HostSetting(
        ice=load_ice(ice),
        ice_name=ice,
        rule_name=rules or usual,
        arrangement=arrangement,
        ends=ends,
        five_rock=not four_rock,
        thinking_time=time,
        extra_time=extra_time,
        throwers=(
            throwers_from(noise0 or "digital-curling"),
            throwers_from(noise1 or "digital-curling"),
        ),
        max_speed=max_speed,
        announced=announce or ("fcv1" if ice == "fcv1" else "curling_ice"),
        send_trajectory=trajectory,
        ice_evolution=TYPICAL_EVOLUTION if evolve else NO_EVOLUTION,
        sweeping=sweep,
        seed=seed,
    )
    if setting.is_doubles and "dc3" in words:
        raise InputError("clients of version 3 play fours only: give --team0 and --team1")
    if certificate is None and key is not None:
        raise InputError("--key belongs to a --certificate")
    if certificate is not None and not web:
        raise InputError("--certificate is for --http and clients of version 4")
    say_what_is_lacking(setting.ice)
    players = [None if word in ("dc3", "dc4") else PlayerSeat(player_from(word)) for word in words]
    folder = None if output is None else make_directory(output)

    def tell(text: str) -> None:
        say(shortened(text), now=True)  # somebody waits for it, and a client may have any name

    hosting = Hosting(setting, remark=tell)

    def say_where(ports: tuple[int, int]) -> None:
        for team, word in enumerate(words):
            if word == "dc3":
                tell(f"team{team} comes in at {bind}:{ports[team]}")

    tcp_ports = (port, port + 1 if port else 0)
    if web:
        from agents.digital_curling.dc4.web_host import host_on_the_web, read_passwords
        from curling_env.infrastructure.web_server import Certificate

        proof = None if certificate is None else Certificate(certificate=certificate, key=key)
        scheme = "http" if proof is None else "https"
        if proof is None and bind not in ("127.0.0.1", "localhost", "::1") and "dc4" in words:
            tell("over http:// passwords can be read on their way; --certificate hides them")
        users = read_passwords(passwords)

        def say_all(ports: tuple[int, int], web_port: int) -> None:
            say_where(ports)
            tell(f"watch on {scheme}://{bind}:{web_port}/")
            if "dc4" in words:
                tell(f"version 4 comes in there, for the match {hosting.game_id}")
                if passwords is None:
                    for user, password in users.items():
                        tell(f"user {user}, password {password}")

        running = host_on_the_web(
            hosting,
            (players[0], players[1]),
            {team for team in Team if words[team] == "dc4"},
            users,
            address=bind,
            ports=tcp_ports,
            http_port=8000 if http is None else http,
            own_errors={team for team in Team if (noise0, noise1)[team] is None},
            units=units,
            certificate=proof,
            opened=say_all,
        )
    else:
        running = host_game(
            hosting, (players[0], players[1]), address=bind, ports=tcp_ports, opened=say_where
        )
    try:
        asyncio.run(running)
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
