"""`curling host`: a server for Digital Curling's clients on our ice."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from curling_env.commands.options import IceOption, Measured, SeedOption, grouped, option, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark, shortened, warn_about
from curling_env.errors import InputError

if TYPE_CHECKING:
    from agents.digital_curling.hosting.setting import HostSetting

CLIENTS = ("dc3", "dc4")
AGENT = Option(metavar="AGENT", help="dc3 or dc4 (a client), or a player, see `curling play`.")
NOISE = Option(
    metavar="SKILL",
    help="Execution error: a skill or SPEED:ANGLE [m/s, rad], one or four with commas.",
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
        """Return the agents of team 0 and team 1 as given."""
        return self.team0, self.team1


@dataclass(frozen=True, kw_only=True)
class Match:
    """Match"""

    ice: IceOption = "fcv1"
    rules: str | None = option(None, "Rule set (docs/rules.md); default: that of the clients.")
    arrangement: int = option(0, "Placed stones of mixed doubles in version 4.", min=0, max=5)
    ends: int = option(8, "Number of ends.", min=1, max=20)
    time: float = option(600.0, "Thinking time of each team [s].", min=1, max=1e5)
    extra_time: float = option(60.0, "Thinking time for an extra end [s].", min=1, max=1e5)
    evolve: bool = option(False, "Let the ice wear and frost, and stones differ.", "--evolve")
    sweep: bool = option(False, "Sweep light stones.", "--sweep")
    announce: str | None = option(None, "Physics reported to clients, e.g. fcv1.", metavar="NAME")

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
            raise InputError(
                "clients of version 3 play fours only; give players for --team0 and --team1"
            )
        warn_about(setting.ice)
        return setting


@dataclass(frozen=True, kw_only=True)
class Server:
    """Server"""

    bind: str = option(
        "127.0.0.1", "Address to listen on; 0.0.0.0: all networks.", metavar="ADDRESS"
    )
    port: int = option(10000, "Port of team 0; team 1 has the next.", min=0, max=65534)
    http: int | None = option(None, "Port of the page, and of version 4.", min=0, max=65535)
    passwords: Path | None = option(None, "Version 4: passwords by user.", metavar="FILE.json")
    certificate: Path | None = option(None, "Certificate, to serve https.", metavar="CERT.pem")
    key: Path | None = option(None, "Private key, if in another file.", metavar="KEY.pem")


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
    Team 1 has the hammer in the first end. Only programs on this machine can connect, unless --bind
    allows others. See docs/digital-curling.md.
    """
    import asyncio

    from agents.digital_curling.hosting.seats import PlayerSeat
    from agents.digital_curling.hosting.server import Hosting
    from agents.digital_curling.serving import serve
    from agents.playing.trained_player import player_from
    from curling_env.game.rules import Team
    from curling_env.infrastructure.files.writing import make_directory
    from curling_env.infrastructure.threads import one_thread

    one_thread()
    setting = match.setting(teams, seed)
    first, second = (
        None if word in CLIENTS else PlayerSeat(player_from(word)) for word in teams.words
    )
    folder = None if output is None else make_directory(output)
    hosting = Hosting(setting, remark=_report)
    own_errors = {team for team in Team if (teams.noise0, teams.noise1)[team] is None}
    running = serve(
        hosting,
        (first, second),
        teams.words,
        own_errors=own_errors,
        units=results.units,
        **vars(server),
    )
    try:
        asyncio.run(running)
    finally:
        # A game that broke off is recorded up to that point.
        if folder is not None and hosting.game is not None:
            hosting.write(folder, results.units)
    if folder is not None:
        print_remark(f"recorded in {folder}; open {folder / 'game.html'} to watch the game")
    results.show(hosting.summary(), *hosting.sentences())


def _report(text: str) -> None:
    """Report to the host's user immediately; a client may have any name."""
    print_remark(shortened(text), now=True)
