"""Opens the app of a club to browsers, and closes it in order."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable

from starlette.types import ASGIApp

from agents.app.club import Club
from curling_env.infrastructure.local_server import ADDRESS, network_address
from curling_env.infrastructure.threads import one_thread
from curling_env.infrastructure.web_server import listening, serving

USUAL_PORT = 8711
"""Tried first, so that addresses stay the same from day to day."""


def serve(
    club: Club,
    *,
    port: int | None,
    share: bool,
    opened: Callable[[str, str | None], object],
    begin: Callable[[], object] = lambda: None,
) -> None:
    """Serve a club until it is interrupted.

    The address is there at once. A browser that opens it waits for the few seconds in which the
    app is loaded and work that an earlier one left undone is finished.

    Parameters
    ----------
    club : its folder, which no other process serves meanwhile
    port : where; 0 takes any free one, None the usual one or else any free one
    share : whether other machines of the network may open it
    opened : called with the address on this machine, and with that in the network if it is shared
    begin : called once the club is in order, to ask for further work

    Raises
    ------
    InputError : a port that cannot be opened
    OutputError : there is no network to share it in
    """
    one_thread()  # requests are worked out side by side
    own, hosts, network = club.secret("this machine"), [ADDRESS, "localhost"], None
    if share:
        network = (network_address(), club.secret("network"))
    address = ADDRESS if network is None else "0.0.0.0"
    with listening(address, _usual_port(address) if port is None else port) as listener:
        there = int(listener.getsockname()[1])
        opened(
            f"http://{ADDRESS}:{there}/{own}/",
            None if network is None else f"http://{network[0]}:{there}/{network[1]}/",
        )
        from agents.app.application import application
        from agents.app.club.films import settle_films
        from agents.app.club.session_files import finish_files
        from agents.app.work.jobs import measure_all
        from agents.app.work.queue import WorkQueue

        settle_films(club)
        measure_all(club)
        finish_files(club)
        begin()
        with WorkQueue(club) as work:
            app = application(club, work, secret=own, hosts=hosts, network=network)
            asyncio.run(_serve(app, listener))


async def _serve(app: ASGIApp, listener: socket.socket) -> None:
    async with serving(app, listener):
        await asyncio.Event().wait()


def _usual_port(address: str) -> int:
    """Return the usual port if it is free, or else any."""
    try:
        with socket.create_server((address, USUAL_PORT)):
            return USUAL_PORT
    except OSError:
        return 0
