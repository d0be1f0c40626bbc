"""Opens the app of a club to browsers, and closes it in order."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import TYPE_CHECKING

from agents.app.club import Club
from curling_env.infrastructure.local_server import ADDRESS, network_address
from curling_env.infrastructure.threads import one_thread
from curling_env.infrastructure.web_server import listening, serving

if TYPE_CHECKING:
    from agents.app.gate import Gate

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
    own, host = club.secret("this machine"), network_address() if share else None
    with listening(ADDRESS, _usual_port() if port is None else port) as listener:
        there = int(listener.getsockname()[1])
        opened(
            f"http://{ADDRESS}:{there}/{own}/",
            None if host is None else f"http://{host}:{there}/{club.secret('network')}/",
        )
        from agents.app.application import application
        from agents.app.club.films import settle_films
        from agents.app.club.session_files import finish_files
        from agents.app.work.queue import WorkQueue

        settle_films(club)
        finish_files(club)
        begin()
        with WorkQueue(club) as work:
            app = application(club, work, secret=own, hosts=[ADDRESS, "localhost"])
            asyncio.run(_serve(app, listener, share))


async def _serve(app: Gate, listener: socket.socket, share: bool) -> None:
    async with serving(app, listener) as port:
        try:
            await app.sharing.switch(share, port)
            await asyncio.Event().wait()
        finally:
            await app.sharing.switch(False, port)


def _usual_port() -> int:
    """Return the usual port if it is free, or else any."""
    try:
        with socket.create_server((ADDRESS, USUAL_PORT)):
            return USUAL_PORT
    except OSError:
        return 0
