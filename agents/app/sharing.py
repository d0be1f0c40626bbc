"""The app for other machines in the network, while it is switched on."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import NamedTuple

from starlette.types import ASGIApp

from agents.app.club import Club
from curling_env.infrastructure.local_server import network_address
from curling_env.infrastructure.web_server import listening, serving


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
