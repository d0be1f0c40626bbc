"""Serves a web application in an event loop in which other things go on.

Needs uvicorn and Starlette, of the extras `digital-curling` and `app`.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncGenerator, Generator
from contextlib import asynccontextmanager, contextmanager

import uvicorn
from starlette.types import ASGIApp

from curling_env.errors import InputError

MAX_CONNECTIONS = 64
"""Connections at one time."""
GOODBYE = 3
"""Time that open answers have when the server ends [s]."""


class _Server(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Generator[None]:
        """Leave signals to the command, which ends what goes on and then this server."""
        yield


def listening(address: str, port: int) -> socket.socket:
    """An open port: whoever asks there waits until it is served.

    Parameters
    ----------
    address, port : where; port 0 takes any free one

    Raises
    ------
    InputError : the port is taken, or the address is none of this machine's
    """
    try:
        return socket.create_server((address, port))
    except OSError as error:
        reason = f"cannot listen there: {(error.strerror or str(error)).lower()}"
        raise InputError(reason, source=f"{address}:{port}") from error


@asynccontextmanager
async def serving(application: ASGIApp, address: str, port: int) -> AsyncGenerator[int]:
    """Serve an application while something else goes on; gives its port.

    Parameters
    ----------
    application : what is served
    address, port : see `listening`

    Raises
    ------
    InputError : see `listening`
    """
    async with serving_at(application, listening(address, port)) as there:
        yield there


@asynccontextmanager
async def serving_at(application: ASGIApp, listener: socket.socket) -> AsyncGenerator[int]:
    """Serve an application at an open port, which is closed in the end; gives its number."""
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
