"""Host of a game with a page for spectators, and for clients of version 4."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path

from agents.digital_curling.dc4.application import application
from agents.digital_curling.dc4.match import HttpSeat, Match4
from agents.digital_curling.hosting.hosted_game import HostedGame
from agents.digital_curling.hosting.seats import Seat
from agents.digital_curling.hosting.server import Hosting, host_game
from agents.digital_curling.messages import TEAMS
from curling_env.errors import InputError, placed
from curling_env.game.rules import Team
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.schema import checked
from curling_env.infrastructure.web_server import Certificate, listening, serving
from curling_env.units import Units

RESULT_SECONDS = 2.0
"""Time after the game during which pages can still get the result [s]."""
MAX_USERS = 100


def read_passwords(path: Path | None) -> dict[str, str]:
    """Read passwords by user; make new ones for team0 and team1 without a file.

    Raises
    ------
    InputError : a file without passwords, or a user name that Basic authentication does not allow
    """
    if path is None:
        return {name: secrets.token_urlsafe(12) for name in TEAMS}
    with placed(source=path):
        users = checked(read_json(path), dict[str, str])
    if not 1 <= len(users) <= MAX_USERS or any(not u or ":" in u for u in users):
        raise InputError(f"expected 1 to {MAX_USERS} users with names without a colon", source=path)
    if any(len(password) < 8 for password in users.values()):
        raise InputError("expected passwords of at least 8 characters", source=path)
    return users


async def host_on_the_web(
    hosting: Hosting,
    seats: tuple[Seat | None, Seat | None],
    over_http: set[Team],
    passwords: Mapping[str, str],
    *,
    address: str,
    ports: tuple[int, int],
    http_port: int,
    own_errors: set[Team],
    units: Units = Units.METRES,
    certificate: Certificate | None = None,
    opened: Callable[[tuple[int, int], int], None] = lambda ports, http: None,
) -> HostedGame:
    """Host one game, and serve its page and the requests of version 4.

    Parameters
    ----------
    hosting : the game
    seats : as in `host_game`
    over_http : teams that clients of version 4 take; their seats are made here
    passwords : passwords by user, for those clients
    address, ports : address and ports for clients of version 3
    http_port : port of the page and for clients of version 4
    own_errors : teams whose clients set their execution errors
    units : units of lengths on the page
    certificate : certificate for https; None for http
    opened : called with the ports once they are open

    Raises
    ------
    InputError : a port that cannot be opened
    """
    match = Match4(hosting, over_http)
    hosting.changed = match.publish
    home, away = (
        HttpSeat(match, team, brings_errors=team in own_errors)
        if team in over_http
        else seats[team]
        for team in Team
    )
    pages = application(match, passwords, units=units)
    listener = listening(address, http_port)
    async with serving(pages, listener, certificate=certificate) as port:
        try:
            game = await host_game(
                hosting,
                (home, away),
                address=address,
                ports=ports,
                opened=lambda tcp: opened(tcp, port),
            )
            await asyncio.sleep(RESULT_SECONDS)
        finally:
            match.close()
    return game
