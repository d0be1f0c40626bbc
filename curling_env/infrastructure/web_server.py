"""Web server for an application in an event loop that also runs other tasks.

Needs uvicorn and Starlette, of the extras `digital-curling` and `app`; for WebSockets also the
library of that name, of the first of these.
"""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import AsyncGenerator, Generator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import uvicorn
from starlette.types import ASGIApp

from curling_env.errors import InputError

MAX_CONNECTIONS = 64
"""Maximum number of simultaneous connections."""
MAX_MESSAGE = 64 * 1024
"""Maximum length of a message over a WebSocket [bytes]."""
SHUTDOWN_GRACE = 3
"""Time for open answers to finish when the server ends [s]."""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Certificate and key of a server.

    Parameters
    ----------
    certificate : file of the certificate and its chain up to a known authority, PEM
    key : file of its private key, PEM, without a passphrase; None if the first file has it

    Raises
    ------
    InputError : a file that is missing or unreadable, or a key that does not match the certificate
    """

    certificate: Path
    key: Path | None = None

    def __post_init__(self) -> None:
        for path in (self.certificate, self.key or self.certificate):
            try:
                path.open("rb").close()
            except OSError as error:
                reason = (error.strerror or str(error)).lower()
                raise InputError(f"cannot be read: {reason}", source=path) from error
        questions: list[str] = []

        def passphrase() -> str:
            questions.append("passphrase")
            return ""  # otherwise OpenSSL would ask at the terminal

        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        try:
            context.load_cert_chain(self.certificate, self.key, password=passphrase)
        except (ssl.SSLError, OSError, ValueError) as error:
            problem = "expected a certificate and its private key in PEM format"
            if questions:
                problem = "its private key has a passphrase; expected a key without one"
            elif "MISMATCH" in (getattr(error, "reason", "") or ""):
                problem = "does not belong to the private key"
            raise InputError(problem, source=self.certificate) from error


class _Server(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Generator[None]:
        """Leave signals to the command, which ends the work and then this server."""
        yield


def listening(address: str, port: int) -> socket.socket:
    """Open a port; clients that connect wait until it is served.

    Parameters
    ----------
    address, port : address to bind; port 0 takes any free one

    Raises
    ------
    InputError : the port is taken, or the address is not one of this machine's
    """
    try:
        return socket.create_server((address, port))
    except OSError as error:
        reason = f"cannot listen on this address: {(error.strerror or str(error)).lower()}"
        raise InputError(reason, source=f"{address}:{port}") from error


@asynccontextmanager
async def serving(
    application: ASGIApp, listener: socket.socket, *, certificate: Certificate | None = None
) -> AsyncGenerator[int]:
    """Serve an application while other tasks run, and provide its port number.

    Parameters
    ----------
    application : the application to serve
    listener : an open port, see `listening`; it is closed at the end
    certificate : serves https with it; None for http
    """
    server = _Server(
        uvicorn.Config(
            application,
            ssl_certfile=None if certificate is None else certificate.certificate,
            ssl_keyfile=None if certificate is None else certificate.key,
            http="h11",
            ws="websockets-sansio" if find_spec("websockets") else "none",
            ws_max_size=MAX_MESSAGE,
            lifespan="off",
            log_config=None,
            access_log=False,
            server_header=False,
            limit_concurrency=MAX_CONNECTIONS,
            timeout_graceful_shutdown=SHUTDOWN_GRACE,
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
