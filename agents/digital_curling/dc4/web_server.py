"""Serves an application beside a hosted game, in the same event loop."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager

import uvicorn
from starlette.applications import Starlette

from curling_env.errors import InputError

MAX_CONNECTIONS = 64
"""Connections at one time."""
GOODBYE = 3
"""Time that open answers have when the game is over [s]."""


class _Server(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the command, which ends the game and then this server."""
        yield


@asynccontextmanager
async def serving(application: Starlette, address: str, port: int) -> AsyncIterator[int]:
    """Serve an application while something else goes on; gives its port.

    Parameters
    ----------
    application : what is served
    address, port : where; port 0 takes any free one

    Raises
    ------
    InputError : the port is taken, or the address is none of this machine's
    """
    try:
        listener = socket.create_server((address, port))
    except OSError as error:
        reason = f"cannot listen there: {(error.strerror or str(error)).lower()}"
        raise InputError(reason, source=f"{address}:{port}") from error
    server = _Server(
        uvicorn.Config(
            application,
            http="h11",
            ws="none",
            lifespan="off",
            log_config=None,
            access_log=False,
            server_header=False,
            limit_concurrency=MAX_CONNECTIONS,
            timeout_graceful_shutdown=GOODBYE,
        )
    )
    running = asyncio.create_task(server.serve(sockets=[listener]))
    try:
        while not server.started:
            await asyncio.sleep(0.01)
            if running.done():
                await running
        yield int(listener.getsockname()[1])
    finally:
        server.should_exit = True
        await running
        listener.close()
