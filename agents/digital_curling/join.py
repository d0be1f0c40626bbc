"""Client of Digital Curling's server (DC3) on a TCP connection."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from agents.digital_curling.client import Client
from agents.digital_curling.conversation import MAX_LINE, Update, from_server, write_line
from curling_env.errors import InputError

CONNECT_TIMEOUT = 10.0
"""Timeout of the connection [s]."""


@dataclass
class WireLog:
    """Log of all lines of a connection, in the form of Digital Curling's users: ``<`` is
    received.
    """

    lines: list[str] = field(default_factory=list[str])

    def received(self, line: bytes) -> None:
        """Log a line of the server."""
        self._note("<", line)

    def sent(self, line: bytes) -> None:
        """Log a line of the client."""
        self._note(">", line)

    def text(self) -> str:
        """Return the whole log."""
        return "".join(line + "\n" for line in self.lines)

    def _note(self, way: str, line: bytes) -> None:
        self.lines.append(f"{way} {line.decode('utf-8', 'replace').rstrip()}")


def address_of(text: str) -> tuple[str, int]:
    """Parse host and port of ``HOST:PORT``; an IPv6 address is in brackets.

    Raises
    ------
    InputError : anything else
    """
    host, colon, port = text.rpartition(":")
    bare = host.removeprefix("[").removesuffix("]")
    is_port = port.isascii() and port.isdecimal() and 0 < int(port[:6]) < 65536
    if not (colon and bare and is_port) or (":" in bare and not host.startswith("[")):
        raise InputError(f"expected a server HOST:PORT, such as 127.0.0.1:10000, got {text[:80]!r}")
    return bare, int(port)


def play_on_server(
    host: str,
    port: int,
    client: Client,
    log: WireLog,
    *,
    on_update: Callable[[], None] = lambda: None,
) -> None:
    """Play a game to its end.

    Parameters
    ----------
    host, port : address of the server for this team
    client : client of the team
    log : log of all lines
    on_update : called after each position

    Raises
    ------
    InputError : no server answers, an invalid line, or a server that disconnects before the game is
        over
    """
    with _connected(host, port) as connection:
        try:
            for number, line in enumerate(_lines(connection, f"{host}:{port}"), start=1):
                log.received(line)
                try:
                    message = from_server(line)
                    answer = client.answer(message)
                except InputError as error:
                    place = f"line {number}" + (f", {error.where}" if error.where else "")
                    raise InputError(error.problem, source=f"{host}:{port}", where=place) from error
                if answer is not None:
                    written = write_line(answer)
                    log.sent(written)
                    connection.sendall(written)
                if isinstance(message, Update):
                    on_update()
                if client.is_over:
                    return
        except (ConnectionError, TimeoutError) as error:
            raise _connection_closed(client, f"{host}:{port}") from error
    # The server may close immediately after sending the result.
    if client.result is None:
        raise _connection_closed(client, f"{host}:{port}")


@contextmanager
def _connected(host: str, port: int) -> Iterator[socket.socket]:
    try:
        connection = socket.create_connection((host, port), timeout=CONNECT_TIMEOUT)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"no server answers: {reason}", source=f"{host}:{port}") from error
    with connection:
        # An opponent may think for minutes; the system notices a lost server.
        connection.settimeout(None)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        yield connection


def _lines(connection: socket.socket, source: str) -> Iterator[bytes]:
    """Yield the server's lines, however the network splits and joins them, without empty ones."""
    with connection.makefile("rb") as stream:
        while line := stream.readline(MAX_LINE + 1):
            if len(line) > MAX_LINE:
                raise InputError(
                    f"a line is too long; expected at most {MAX_LINE} bytes", source=source
                )
            if not line.endswith(b"\n"):
                return  # incomplete line
            if line.strip():
                yield line


def _connection_closed(client: Client, source: str) -> InputError:
    return InputError(
        f"the server closed the connection before the game was over ({client.place()})",
        source=source,
    )
