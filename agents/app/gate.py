"""Gate that keeps strangers out: nothing behind it is reached without the secret.

A request must name this server as its host, come from its own pages if from any, and know the
secret, which is the first part of every address: so addresses can be shared and opened again, and a
page of another site, which cannot know it, can neither ask nor send. A request that changes
something also brings the token that is in every form.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
from contextlib import AsyncExitStack
from typing import NamedTuple
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from agents.app.club import Club
from curling_env.infrastructure.local_server import network_address
from curling_env.infrastructure.web_server import listening, serving
from curling_env.units import shown_in

TOKEN_FIELD, TOKEN_HEADER = "csrf", "X-CSRF-Token"
MAX_BODY = 1_000_000
"""Longest request [bytes]."""
MAX_PIECE = 8 * 2**20
"""Longest piece of a film that is sent with PUT [bytes]."""
MAX_DIGITS = 15
"""Of a number in an address; the database has no larger ones."""
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "media-src 'self'; connect-src 'self'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'none'"
)
"""Content security policy: nothing inline, nothing from anywhere else."""
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    # With "no-referrer" browsers send forms without their origin. No other page learns the secret.
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
    "Cache-Control": "no-store",
}
"""Of every answer that does not say otherwise."""
READING = frozenset({"GET", "HEAD"})
ANSWERED = frozenset(f"throw/{name}" for name in ("run", "plan", "calls", "game", "advice"))
"""Addresses that a link for reading may send to: they change nothing."""
FORM = "application/x-www-form-urlencoded"


def token_for(secret: str) -> str:
    """The token that the forms of whoever knows a secret carry."""
    return hmac.new(secret.encode(), b"form", hashlib.sha256).hexdigest()[:32]


class Gate:
    """Lets through only requests of the app's own pages.

    Parameters
    ----------
    app : what is behind it; `scope["root_path"]` is the secret's part of the address
    sharing : the names, without a port, by which this server may be called, and the secrets that
        open it there
    """

    def __init__(self, app: ASGIApp, sharing: Sharing) -> None:
        self.app, self.sharing = app, sharing

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer it with a refusal."""
        if scope["type"] != "http":
            return
        send = _with_headers(send)
        try:
            receive = await self._check(scope, receive)
        except HTTPException as refused:
            await PlainTextResponse(refused.detail, refused.status_code)(scope, receive, send)
            return
        with shown_in(self.sharing.club.units):
            await self.app(scope, receive, send)

    async def _check(self, scope: Scope, receive: Receive) -> Receive:
        """Write the secret's part into the scope; gives what the body is read from.

        Raises
        ------
        HTTPException : the request is refused
        """
        headers, port = Headers(scope=scope), scope["server"][1]
        doors = self.sharing.doors
        own = {f"{name}:{port}" for door in doors for name in door.hosts}
        origin, host = headers.get("Origin"), headers.get("Host", "").lower()
        if host not in own:
            raise HTTPException(
                403, "Unknown host name in the address. Open the address that the program printed."
            )
        if origin is not None and origin.lower().removeprefix("http://") not in own:
            raise HTTPException(403, "Requests from other pages are refused.")
        first, *rest = [*scope["path"].split("/"), ""][1:]
        name = host.removesuffix(f":{port}")
        # All are compared, so that the time taken shows nothing.
        fitting = [door for door in doors if _same(first, door.secret) and name in door.hosts]
        if not fitting:
            raise HTTPException(404, "Page not found. Open the address that the program printed.")
        door = scope["door"] = fitting[0]
        secret = door.secret
        if any(part.isdecimal() and len(part) > MAX_DIGITS for part in scope["path"].split("/")):
            raise HTTPException(404, "Page not found: the number in the address is too long.")
        scope["root_path"] = f"/{secret}"
        if scope["method"] in READING:
            return receive
        if not (door.may_write or "/".join(rest).rstrip("/") in ANSWERED):
            raise HTTPException(
                403, "This link is read-only. Open the link for coaches to make changes."
            )
        most = MAX_PIECE if scope["method"] == "PUT" else MAX_BODY
        length = headers.get("Content-Length", "0")
        if not (length.isascii() and length.isdecimal()) or int(length[:15]) > most:
            raise HTTPException(413, f"The request is too long: expected at most {most} bytes.")
        body, receive = await _read(receive, most)
        token = token_for(secret)
        # A page that another part of the project wrote has the token in its address.
        known = _same(headers.get(TOKEN_HEADER, ""), token) or f"/{token}/" in scope["path"]
        if not known and headers.get("Content-Type", "").split(";")[0].strip() == FORM:
            fields = parse_qs(body.decode("utf-8", "replace"), max_num_fields=1000)
            known = _same(fields.get(TOKEN_FIELD, [""])[0], token)
        if not known:
            raise HTTPException(
                403, "The form has no valid token. Reload the page and send it again."
            )
        return receive


def _same(given: str, known: str) -> bool:
    return hmac.compare_digest(given.encode(errors="replace"), known.encode())


async def _read(receive: Receive, most: int) -> tuple[bytes, Receive]:
    """The whole body, and what gives it once more.

    Raises
    ------
    HTTPException : it is too long
    """
    body, more, given = b"", True, False
    while more:
        message = await receive()
        if message["type"] == "http.disconnect":
            break
        body += message.get("body", b"")
        if len(body) > most:
            raise HTTPException(413, f"The request is too long: expected at most {most} bytes.")
        more = message.get("more_body", False)

    async def again() -> Message:
        nonlocal given
        if given:
            return await receive()
        given = True
        return {"type": "http.request", "body": body, "more_body": False}

    return body, again


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return sending


class Door(NamedTuple):
    """A secret that opens the app by some names.

    Parameters
    ----------
    secret : the first part of every address
    hosts : names, without a port, by which browsers call this machine
    may_write : False for links that only show
    is_own : True for this machine's browsers, which may share the app
    """

    secret: str
    hosts: frozenset[str]
    may_write: bool = True
    is_own: bool = False


class Sharing:
    """The doors of the app; opens it to the network and closes it again.

    Parameters
    ----------
    club : whose secrets the addresses have
    own : the door of this machine's browsers
    """

    def __init__(self, club: Club, own: Door) -> None:
        self.club, self.doors = club, [own]
        self._open = AsyncExitStack()
        self._changing = asyncio.Lock()
        self.app: ASGIApp | None = None
        self.addresses: dict[bool, str] = {}
        """Addresses in the network, by whether they may write; empty while it is not shared."""

    async def switch(self, on: bool, port: int) -> None:
        """Share the app, or end that; those who have it open are shut out at once.

        Parameters
        ----------
        port : where it is served on this machine, and then in the network too

        Raises
        ------
        OutputError : there is no network to share it in
        InputError : the port is taken there
        """
        async with self._changing:
            if on == bool(self.addresses):
                return
            if not on:
                self.doors[:] = [door for door in self.doors if door.is_own]
                self.addresses = {}
                await self._open.aclose()
                return
            assert self.app is not None
            host = network_address()
            await self._open.enter_async_context(serving(self.app, listening(host, port)))
            for may_write, name in ((True, "network"), (False, "network, reading")):
                secret = self.club.secret(name)
                self.doors.append(Door(secret, frozenset({host}), may_write))
                self.addresses[may_write] = f"http://{host}:{port}/{secret}/"
