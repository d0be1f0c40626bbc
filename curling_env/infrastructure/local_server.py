"""Server for pages on this machine: it serves only its own page, with bounded time and size.

It answers only requests that name it as their host and come from its own page, so that no other
page in the same browser can reach it, by whatever name. A silent connection is closed, and any
number of connections uses only a few threads.
"""

from __future__ import annotations

import socket
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Lock
from typing import Any

from curling_env.errors import OutputError

IDLE_TIMEOUT = 10.0
"""Timeout of a connection that has not been answered [s]."""
MAX_CONNECTIONS = 16
"""Maximum number of simultaneous connections; a browser opens six."""
ADDRESS = "127.0.0.1"


def network_address() -> str:
    """Return the address of this machine for other machines in the same network.

    Raises
    ------
    OutputError : this machine is in no network
    """
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            # Nothing is sent: the system only returns the address that it would use.
            probe.connect(("192.0.2.1", 9))
            return str(probe.getsockname()[0])
    except OSError as error:
        raise OutputError("cannot share the page: this machine is in no network") from error


class LocalServer(ThreadingHTTPServer):
    """An HTTP server with a bounded number of threads.

    Parameters
    ----------
    handler : answers requests; derives from `LocalHandler`
    port : 0 takes any free one
    host : address of the server; any but this machine's own opens it to the network

    Raises
    ------
    OSError : the port is taken
    """

    daemon_threads = True
    block_on_close = False

    def __init__(
        self,
        handler: type[LocalHandler],
        port: int = 0,
        *,
        host: str = ADDRESS,
    ) -> None:
        self._open: dict[Any, float] = {}
        self._lock = Lock()
        super().__init__((ADDRESS if host == ADDRESS else "0.0.0.0", port), handler)
        names = {ADDRESS, "localhost", host}
        self.own_hosts = frozenset(f"{name}:{self.server_address[1]}" for name in names)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Start a thread, unless too many are busy; the longest idle one may be closed for it."""
        with self._lock:
            full = len(self._open) >= MAX_CONNECTIONS
            oldest = min(self._open, key=self._open.__getitem__) if full else None
            idled = oldest is None or time.monotonic() - self._open[oldest] >= IDLE_TIMEOUT
            if idled and oldest is not None:
                _hang_up(oldest)
                del self._open[oldest]
            if idled:
                self._open[request] = time.monotonic()
        if idled:
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)  # acquires the lock itself

    def close_request(self, request: Any) -> None:
        """Remove a connection that has been answered."""
        with self._lock:
            self._open.pop(request, None)
        super().close_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report nothing: a stranger's broken request does not concern the user."""


class LocalHandler(BaseHTTPRequestHandler):
    """Handler of requests from the server's own page; a subclass has `answer`."""

    timeout = IDLE_TIMEOUT
    max_body = 100_000
    """Maximum length of a request [bytes]."""
    policy = "default-src 'none'"
    """Content security policy of the served page."""

    def answer(self, path: str, body: bytes | None) -> tuple[HTTPStatus, str, bytes]:
        """Return status, content type and content for a path; `body` is None for a GET."""
        raise NotImplementedError

    def do_GET(self) -> None:
        """Answer a GET."""
        self._reply(None)

    def do_POST(self) -> None:
        """Answer a POST."""
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdecimal() and int(length[:10]) <= self.max_body):
            self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            return
        self._reply(int(length))

    def _reply(self, length: int | None) -> None:
        if not self._is_ours():
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        try:
            body = None if length is None else self.rfile.read(length)
            status, kind, content = self.answer(self.path, body)
        except (OSError, TimeoutError):
            raise
        except Exception:  # a malformed request may raise anything
            self.send_error(HTTPStatus.BAD_REQUEST)
            return
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", f"{self.policy}; frame-ancestors 'none'")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.end_headers()
        self.wfile.write(content)

    def _is_ours(self) -> bool:
        """Return whether a request names this server, and comes from its own page if from any."""
        server = self.server
        assert isinstance(server, LocalServer)
        origin = self.headers.get("Origin")
        return self.headers.get("Host", "").lower() in server.own_hosts and (
            origin is None or origin.lower().removeprefix("http://") in server.own_hosts
        )

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing, because standard error is for the user's messages."""


def _hang_up(connection: Any) -> None:
    try:
        connection.shutdown(socket.SHUT_RDWR)
    except OSError:  # the connection is closed already
        return
