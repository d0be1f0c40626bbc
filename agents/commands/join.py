"""`curling join`: play on a Digital Curling server."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from getpass import getpass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from typer import Argument, Option

from agents.commands.games.play import PlayerOption
from curling_env.commands.options import Measured, SeedOption, grouped, option, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark, progress_bar
from curling_env.errors import InputError

if TYPE_CHECKING:
    from agents.digital_curling.dc4.join import Place4

PASSWORD = "CURLING_PASSWORD"
"""Environment variable with the password for a server of version 4."""


@dataclass(frozen=True, kw_only=True)
class Version4:
    """Servers of version 4"""

    match: str | None = option(None, "Match ID returned at its creation.", metavar="ID")
    team: Literal["team0", "team1"] = option("team0", "Team to play for; team0 throws first.")
    user: str | None = option(None, f"User; the password is {PASSWORD}.", metavar="NAME")
    certificate: Path | None = option(None, "Further certificate to trust.", metavar="FILE.pem")

    def place(self, url: str) -> Place4:
        """Find the game to join; the password comes from the environment, or is asked for.

        Raises
        ------
        InputError : no match, user or password is given
        """
        from agents.digital_curling.dc4.join import Place4

        if self.match is None or self.user is None:
            raise InputError("version 4 needs --match ID and --user NAME")
        password = os.environ.get(PASSWORD)
        if password is None:
            if not sys.stdin.isatty():
                raise InputError(f"no password: set {PASSWORD}")
            password = getpass(f"password of {self.user}: ")
        place = Place4(
            url=url,
            match_id=self.match,
            team=self.team,
            user=self.user,
            password=password,
            certificate=self.certificate,
        )
        if place.is_open:
            print_remark("http:// sends the password unencrypted; use https://")
        return place


@grouped
def join(
    server: Annotated[str, Argument(metavar="HOST:PORT|URL", help="Server of version 3, or 4.")],
    player: PlayerOption = "search",
    name: Annotated[str | None, Option(metavar="NAME", help="Name of the team.")] = None,
    ice: Annotated[str | None, Option(metavar="ICE", help="Ice as the player knows it.")] = None,
    *,
    version4: Version4,
    output: Annotated[
        Path | None,
        output_to("DIR", "Folder for game.jsonl, game.html and the messages (wire.jsonl)."),
        Writes(folder=True),
    ] = None,
    results: Measured,
    seed: SeedOption = 0,
) -> None:
    """Play a game on a Digital Curling server, version 3 (TCP) or 4 (HTTP).

    \b
    Examples:
        curling join 127.0.0.1:10000 --player search
        curling join 192.168.0.7:10001 --player search:1000 --name "Ice Age" -o runs/match
        curling join https://dc.example.org --match 0192… --team team1 --user anna

    A server of version 3 has a port for each team: team 0 throws first, and team 1 has the hammer
    in the first end. The player thinks for a share of the time on its clock, `search` with up to
    30,000 simulated throws for each stone. With -o, game.html replays the game, and `curling
    replay` makes a film of it. See docs/digital-curling.md.
    """
    from functools import partial

    from agents.digital_curling.client import Client
    from agents.digital_curling.dc4.join import play_on_web_server
    from agents.digital_curling.game_record import summary_of, write_game
    from agents.digital_curling.join import WireLog, address_of, play_on_server
    from agents.playing.trained_player import player_from
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.writing import make_directory
    from curling_env.infrastructure.threads import one_thread

    one_thread()
    known = None if ice is None else load_ice(ice)
    if "://" in server:
        rules, play = "dc4_server", partial[Any](play_on_web_server, version4.place(server))
    else:
        rules, play = "digital_curling", partial[Any](play_on_server, *address_of(server))
    client = Client(
        player_from(player), name=name, seed=seed, ice=known, remark=print_remark, rule_name=rules
    )
    folder = None if output is None else make_directory(output)
    log = WireLog()
    try:
        with progress_bar("stone") as progress:

            def show() -> None:
                progress("playing", len(client.seen), client.rules.ends * client.rules.deliveries)

            play(client, log, on_update=show)
    finally:
        # A game that broke off is recorded up to that point.
        if folder is not None and log.lines:
            write_game(folder, client, log, ice=ice or "fcv1", units=results.units)
    if folder is not None and client.seen:
        print_remark(f"recorded in {folder}; open {folder / 'game.html'} to watch the game")
    results.show(*summary_of(client))
