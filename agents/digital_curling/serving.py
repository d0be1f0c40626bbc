"""Host of a game with its ports: over TCP, over HTTP, or none."""

from __future__ import annotations

from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from agents.digital_curling.dc4.web_host import host_on_the_web, read_passwords
from agents.digital_curling.hosting.seats import Seat
from agents.digital_curling.hosting.server import Hosting, host_game
from curling_env.errors import InputError
from curling_env.game.rules import Team
from curling_env.infrastructure.web_server import Certificate
from curling_env.units import Units

LOCAL = ("127.0.0.1", "localhost", "::1")
HTTP_PORT = 8000


def serve(
    hosting: Hosting,
    seats: tuple[Seat | None, Seat | None],
    agents: tuple[str, str],
    *,
    own_errors: set[Team],
    bind: str,
    port: int,
    http: int | None = None,
    passwords: Path | None = None,
    certificate: Path | None = None,
    key: Path | None = None,
    units: Units = Units.METRES,
) -> Coroutine[Any, Any, Any]:
    """Host one game, and report its ports, users and new passwords once they are open.

    Parameters
    ----------
    hosting : the game; its `remark` gets the reports
    seats : as in `host_game`
    agents : ``dc3`` or ``dc4`` for a client of that version, anything else for a seated player
    own_errors : teams whose clients set the execution errors of their players
    bind, port : address, and port of team 0; team 1 has the next one, and 0 takes free ones
    http : port to watch on, and of version 4; None opens it for clients of version 4 only
    passwords : file with passwords by user; None makes new ones
    certificate, key : files of the certificate and its private key; None for plain http
    units : units of lengths on the page

    Raises
    ------
    InputError : options that do not fit together, or a file that cannot be read
    """
    ports, has_dc4 = (port, port + 1 if port else 0), "dc4" in agents
    if certificate is None and key is not None:
        raise InputError("--key needs a --certificate")

    def report_ports(opened: tuple[int, int]) -> None:
        for team, agent in enumerate(agents):
            if agent == "dc3":
                hosting.remark(f"team{team}: connect to {bind}:{opened[team]}")

    if http is None and not has_dc4:
        if certificate is not None:
            raise InputError("--certificate needs --http or clients of version 4")
        return host_game(hosting, seats, address=bind, ports=ports, opened=report_ports)
    proof = None if certificate is None else Certificate(certificate=certificate, key=key)
    if proof is None and bind not in LOCAL and has_dc4:
        hosting.remark("http:// sends passwords unencrypted; use --certificate")
    users = read_passwords(passwords)

    def report_all(opened: tuple[int, int], web_port: int) -> None:
        report_ports(opened)
        scheme = "http" if proof is None else "https"
        hosting.remark(f"watch on {scheme}://{bind}:{web_port}/")
        if has_dc4:
            hosting.remark(f"version 4 connects there, for the match {hosting.game_id}")
            for user, password in {} if passwords else users.items():
                hosting.remark(f"user {user}, password {password}")

    return host_on_the_web(
        hosting,
        seats,
        {team for team in Team if agents[team] == "dc4"},
        users,
        address=bind,
        ports=ports,
        http_port=HTTP_PORT if http is None else http,
        own_errors=own_errors,
        units=units,
        certificate=proof,
        opened=report_all,
    )
