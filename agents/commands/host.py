"""`curling host`: let Digital Curling's clients play on our ice."""

from __future__ import annotations

from collections.abc import Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from agents.commands.join import outcome_of
from curling_env.commands.options import (
    IceOption,
    Measured,
    SeedOption,
    grouped,
    output_to,
)
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import say, shortened, warn_about
from curling_env.errors import InputError

if TYPE_CHECKING:
    from agents.digital_curling.hosting.seats import PlayerSeat
    from agents.digital_curling.hosting.server import Hosting
    from agents.digital_curling.hosting.setting import HostSetting
    from curling_env.units import Units

CLIENTS = ("dc3", "dc4")
LOCAL = ("127.0.0.1", "localhost", "::1")
AGENT = Option(metavar="AGENT", help="dc3 or dc4 (a client), or a player, see `curling play`.")
NOISE = Option(
    metavar="SKILL",
    help="Its execution error: a skill or SPEED:ANGLE [m/s, rad], one or four with commas.",
)


@dataclass(frozen=True, kw_only=True)
class Teams:
    """Teams"""

    team0: Annotated[str, AGENT] = "dc3"
    team1: Annotated[str, AGENT] = "dc3"
    noise0: Annotated[str | None, NOISE] = None
    noise1: Annotated[str | None, NOISE] = None

    @property
    def words(self) -> tuple[str, str]:
        """The agents of team 0 and team 1 as given."""
        return self.team0, self.team1


@dataclass(frozen=True, kw_only=True)
class Match:
    """Match"""

    ice: IceOption = "fcv1"
    rules: Annotated[
        str | None, Option(help="Rule set (docs/rules.md); by default that of the clients.")
    ] = None
    arrangement: Annotated[
        int, Option(min=0, max=5, metavar="N", help="Mixed doubles: version 4's placed stones.")
    ] = 0
    ends: Annotated[int, Option(min=1, max=20, help="Number of ends.")] = 8
    time: Annotated[
        float, Option(min=1, max=1e5, help="Thinking time of each team for the game [s].")
    ] = 600.0
    extra_time: Annotated[
        float, Option(min=1, max=1e5, help="Thinking time for each extra end [s].")
    ] = 60.0
    evolve: Annotated[
        bool, Option("--evolve", help="Let the ice wear and frost over, and stones differ.")
    ] = False
    sweep: Annotated[bool, Option("--sweep", help="Sweep stones that are light.")] = False
    announce: Annotated[
        str | None,
        Option(metavar="NAME", help="Physics reported to clients; else curling_ice or fcv1."),
    ] = None

    def setting(self, teams: Teams, seed: int) -> HostSetting:
        """Describe the match.

        Raises
        ------
        InputError : an ice that cannot be read, unknown rules or skills, or clients that do not fit
        """
        from agents.digital_curling.hosting.setting import HostSetting, throwers_from
        from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION
        from curling_env.ice import load_ice

        usual = "dc4_server" if "dc4" in teams.words else "digital_curling"
        home, away = (throwers_from(n or "digital-curling") for n in (teams.noise0, teams.noise1))
        setting = HostSetting(
            ice=load_ice(self.ice),
            ice_name=self.ice,
            rule_name=self.rules or usual,
            arrangement=self.arrangement,
            ends=self.ends,
            thinking_time=self.time,
            extra_time=self.extra_time,
            throwers=(home, away),
            announced=self.announce or ("fcv1" if self.ice == "fcv1" else "curling_ice"),
            ice_evolution=TYPICAL_EVOLUTION if self.evolve else NO_EVOLUTION,
            sweeping=self.sweep,
            seed=seed,
        )
        if setting.is_doubles and "dc3" in teams.words:
            raise InputError("clients of version 3 play fours only: give --team0 and --team1")
        warn_about(setting.ice)
        return setting


@dataclass(frozen=True, kw_only=True)
class Server:
    """Server"""

    bind: Annotated[
        str, Option(metavar="ADDRESS", help="Address to listen on; 0.0.0.0 for all networks.")
    ] = "127.0.0.1"
    port: Annotated[
        int, Option(min=0, max=65534, help="Port of team 0; team 1 has the next; 0: free ones.")
    ] = 10000
    http: Annotated[
        int | None,
        Option(min=0, max=65535, metavar="PORT", help="Port to watch on, and of version 4."),
    ] = None
    passwords: Annotated[
        Path | None,
        Option(metavar="FILE.json", help="Version 4: passwords by user; else new ones."),
    ] = None
    certificate: Annotated[
        Path | None, Option(metavar="CERT.pem", help="Serve https with this certificate.")
    ] = None
    key: Annotated[
        Path | None, Option(metavar="KEY.pem", help="Its private key, if not in the same file.")
    ] = None

    def serve(
        self,
        hosting: Hosting,
        players: tuple[PlayerSeat | None, PlayerSeat | None],
        teams: Teams,
        units: Units,
    ) -> Coroutine[Any, Any, Any]:
        """Serve a game to its end; ports, users and passwords are reported once they are open.

        Raises
        ------
        InputError : options that do not fit together, or a file that cannot be read
        """
        from agents.digital_curling.hosting.server import host_game
        from curling_env.game.rules import Team

        ports = (self.port, self.port + 1 if self.port else 0)
        has_dc4 = "dc4" in teams.words
        if self.certificate is None and self.key is not None:
            raise InputError("--key belongs to a --certificate")

        def report_ports(opened: tuple[int, int]) -> None:
            for team, word in enumerate(teams.words):
                if word == "dc3":
                    _report(f"team{team} comes in at {self.bind}:{opened[team]}")

        if self.http is None and not has_dc4:
            if self.certificate is not None:
                raise InputError("--certificate is for --http and clients of version 4")
            return host_game(hosting, players, address=self.bind, ports=ports, opened=report_ports)
        from agents.digital_curling.dc4.web_host import host_on_the_web, read_passwords
        from curling_env.infrastructure.web_server import Certificate

        proof = None
        if self.certificate is not None:
            proof = Certificate(certificate=self.certificate, key=self.key)
        scheme = "http" if proof is None else "https"
        if proof is None and self.bind not in LOCAL and has_dc4:
            _report("over http:// passwords can be read on their way; --certificate hides them")
        users = read_passwords(self.passwords)

        def report_all(opened: tuple[int, int], web_port: int) -> None:
            report_ports(opened)
            _report(f"watch on {scheme}://{self.bind}:{web_port}/")
            if has_dc4:
                _report(f"version 4 comes in there, for the match {hosting.game_id}")
                for user, password in {} if self.passwords else users.items():
                    _report(f"user {user}, password {password}")

        return host_on_the_web(
            hosting,
            players,
            {team for team in Team if teams.words[team] == "dc4"},
            users,
            address=self.bind,
            ports=ports,
            http_port=8000 if self.http is None else self.http,
            own_errors={team for team in Team if (teams.noise0, teams.noise1)[team] is None},
            units=units,
            certificate=proof,
            opened=report_all,
        )


@grouped
def host(
    *,
    teams: Teams,
    match: Match,
    server: Server,
    output: Annotated[
        Path | None,
        output_to("DIR", "Folder for game.jsonl, game.html and Digital Curling's logs."),
        Writes(folder=True),
    ] = None,
    results: Measured,
    seed: SeedOption = 0,
) -> None:
    """Host a game of Digital Curling on any ice, for its clients and for our players.

    \b
    Examples:
        curling host --ice ice.json --team1 search -o runs/match
        curling host --ice standard --announce fcv1 --ends 4 --time 300
        curling host --team0 dc4 --team1 dc4 --bind 0.0.0.0 --certificate cert.pem --key key.pem

    Unmodified clients connect as to their own server: version 3 over TCP, version 4 over HTTP.
    Team 1 has the hammer in the first end. Only programs on this machine get in, unless --bind
    allows others. See docs/digital-curling.md.
    """
    import asyncio

    from agents.digital_curling.hosting.seats import PlayerSeat
    from agents.digital_curling.hosting.server import Hosting
    from agents.playing.record import write_lines
    from agents.playing.replay.page import write_page
    from agents.playing.scoreboard import scoreboard
    from agents.playing.trained_player import player_from
    from curling_env.infrastructure.files.storage import make_directory, together
    from curling_env.infrastructure.threads import one_thread

    one_thread()
    setting = match.setting(teams, seed)
    first, second = (
        None if word in CLIENTS else PlayerSeat(player_from(word)) for word in teams.words
    )
    folder = None if output is None else make_directory(output)
    hosting = Hosting(setting, remark=_report)
    running = server.serve(hosting, (first, second), teams, results.units)
    try:
        asyncio.run(running)
    finally:
        # A game that broke off is recorded up to there.
        if folder is not None and hosting.game is not None:
            lines = hosting.game.record()
            with together():
                hosting.log.write(folder, hosting.game, hosting.game_id, hosting.date_time)
                write_lines(folder / "game.jsonl", lines)
                write_page(folder / "game.html", lines, results.units)
    game = hosting.game
    assert game is not None
    assert game.result is not None
    if folder is not None:
        say(f"recorded in {folder}; open {folder / 'game.html'} to watch the game")
    results.show(
        {
            "team0": game.names[0],
            "team1": game.names[1],
            "game_id": hosting.game_id,
            "ice": match.ice,
            "seed": seed,
            "score": list(game.game.score),
            "line_score": [list(end) for end in game.game.line_score],
            "winner": game.result["winner"],
            "reason": game.result["reason"],
            "stones": sum(shot["trajectory"] is not None for shot in game.shots),
        },
        scoreboard(game.game, game.names),
        outcome_of(game.names, game.result["winner"], game.result["reason"]),
    )


def _report(text: str) -> None:
    """Report to the person at the host at once; a client may have any name."""
    say(shortened(text), now=True)
