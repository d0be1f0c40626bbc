"""Seats of the teams: a client on a connection, or a player of this project.

A client may send anything: lines that are not moves are counted and dropped while its clock runs,
and after a few it loses its seat. Lines out of turn wait in the network, so that a flood costs the
host nothing.
"""

from __future__ import annotations

import asyncio
import time
from abc import ABC, abstractmethod
from typing import Any, NamedTuple

from agents.digital_curling.conversation import DcOk, MoveLine, ReadyOk, from_client, write_line
from agents.digital_curling.hosting.setting import THROWERS, Order
from agents.digital_curling.messages import TEAMS, ConcedeMessage, ShotMessage
from agents.digital_curling.time_manager import TimeManager
from curling_env.errors import CurlingError, InputError
from curling_env.game import Call, Player, PlayerView
from curling_env.game.rules import Team
from curling_env.game.rules.rulesets import Side
from curling_env.throw import Skill

GREETING_TIMEOUT = 10.0
"""Timeout for a client's name [s]."""
READY_TIMEOUT = 900.0
"""Timeout for a client's readiness [s]."""
WRITE_TIMEOUT = 10.0
"""Timeout for sending a line to a client [s]."""
CLOSE_TIMEOUT = 5.0
"""Timeout for a client to close the connection after the game [s]."""
MAX_CLIENT_LINE = 64 * 1024
"""Maximum length of a client's line [bytes]; a move has some hundred."""
WAITING_LINES = 4
"""Number of a client's lines that are read ahead of its turn."""
MAX_BAD_LINES = 10
"""Maximum number of invalid lines before a client loses its seat."""


class SeatLostError(CurlingError):
    """A team has lost its seat; the text has the reason."""


class Turn(NamedTuple):
    """Decision of a seat, and its duration [s]."""

    move: ShotMessage | ConcedeMessage | Call
    seconds: float


class Placement(NamedTuple):
    """Placement of the stones: the side of a power play, or whether the team throws first."""

    side: Side | None = None
    throws_first: bool = False


class OutOfTimeError(Exception):
    """A team's clock ran out before it decided."""


class Seat(ABC):
    """Seat that decides for a team."""

    name: str = ""
    order: Order = tuple(range(THROWERS))
    throwers: tuple[Skill, ...] | None = None
    """Execution errors of a team's own; by default those of the setting."""

    @abstractmethod
    async def prepare(self, greeting: dict[str, Any], game: dict[str, Any], team: Team) -> None:
        """Get the name, and wait until the seat is ready; see `ClientSeat`."""

    @abstractmethod
    async def send(self, message: dict[str, Any]) -> None:
        """Send a message that needs no answer."""

    @abstractmethod
    async def decide(self, update: dict[str, Any], view: PlayerView, left: float) -> Turn:
        """Return a move.

        Parameters
        ----------
        update : position as sent to clients
        view : the same as a view for players of this project
        left : time on its clock [s]

        Raises
        ------
        SeatLostError : the client has disconnected
        OutOfTimeError : its time is up
        """

    async def place(self, view: PlayerView, left: float) -> Placement:
        """Return the placement of the coming end of mixed doubles; by default the usual one.

        Parameters
        ----------
        view : the game as a view for players of this project
        left : time for it [s]

        Raises
        ------
        SeatLostError : the client has disconnected
        OutOfTimeError : its time is up
        """
        return Placement()

    @abstractmethod
    async def leave(self) -> None:
        """Close the seat."""


class PlayerSeat(Seat):
    """Player of this project, with a clock like any client.

    Parameters
    ----------
    player : player that decides
    """

    def __init__(self, player: Player) -> None:
        self.name = player.name
        self.player, self.time_manager = player, TimeManager(player)

    async def prepare(self, greeting: dict[str, Any], game: dict[str, Any], team: Team) -> None:
        """Return at once; the first decision compiles before its clock runs."""

    async def send(self, message: dict[str, Any]) -> None:
        """Do nothing: the player gets the game on its turn."""

    async def leave(self) -> None:
        """Do nothing: there is no connection to close."""

    async def warm_up(self, view: PlayerView) -> None:
        """Compile and plan before the clock runs."""
        await asyncio.to_thread(self.time_manager.prepare, [view])

    async def place(self, view: PlayerView, left: float) -> Placement:
        side = self.player.power_play(view) if view.game.may_power_play else None
        return Placement(side, side is None and self.player.throws_first(view))

    async def decide(self, update: dict[str, Any], view: PlayerView, left: float) -> Turn:
        begin = time.perf_counter()
        if self.player.concedes(view):
            return Turn(ConcedeMessage(), 0.0)
        call = await asyncio.to_thread(self.time_manager.call, view, left)
        return Turn(call, time.perf_counter() - begin)


class ClientSeat(Seat):
    """Client on a connection.

    Parameters
    ----------
    reader, writer : the connection
    """

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer
        self._lines: asyncio.Queue[tuple[float, bytes] | None] = asyncio.Queue(WAITING_LINES)
        self._listening = asyncio.create_task(self._listen())
        self._bad = 0
        self._gone = False
        self._why = "it closed the connection"

    async def prepare(self, greeting: dict[str, Any], game: dict[str, Any], team: Team) -> None:
        """Greet the client, announce the game, and wait until it is ready.

        Raises
        ------
        SeatLostError : it disconnected, took too long, or sent something else
        """
        await self.send(greeting)
        name = await self._expect(DcOk, GREETING_TIMEOUT)
        self.name = name.name
        await self.send({"cmd": "is_ready", "team": TEAMS[team], "game": game})
        ready = await self._expect(ReadyOk, READY_TIMEOUT)
        if sorted(ready.player_order) != list(range(THROWERS)):
            raise SeatLostError(f"player_order {ready.player_order} does not list each player once")
        self.order = tuple(ready.player_order)

    async def send(self, message: dict[str, Any]) -> None:
        """Send a message.

        Raises
        ------
        SeatLostError : it disconnected, or does not read
        """
        try:
            self._writer.write(write_line(message))
            await asyncio.wait_for(self._writer.drain(), WRITE_TIMEOUT)
        except (OSError, TimeoutError) as error:
            raise SeatLostError("it does not read its messages") from error

    async def decide(self, update: dict[str, Any], view: PlayerView, left: float) -> Turn:
        # A line sent before the position is not an answer to it.
        while not self._lines.empty():
            self._held(await self._next())
            self._count_bad("a line out of turn")
        begin = time.perf_counter()
        await self.send(update)
        while True:
            rest = left - (time.perf_counter() - begin)
            try:
                line = await asyncio.wait_for(self._next(), max(rest, 0.0))
            except TimeoutError as error:
                raise OutOfTimeError from error
            came, text = self._held(line)
            try:
                message = from_client(text)
                if not isinstance(message, MoveLine):
                    raise InputError("expected a move")
            except InputError as error:
                self._count_bad(str(error))
                continue
            return Turn(message.move, max(came - begin, 0.0))

    async def leave(self) -> None:
        """Give the client time to close the connection, and then close it."""
        try:
            async with asyncio.timeout(CLOSE_TIMEOUT):
                while not self._gone:
                    await self._next()
        except TimeoutError:
            pass
        await self.close()

    async def close(self) -> None:
        """Close the connection."""
        self._listening.cancel()
        self._writer.close()
        try:
            await asyncio.wait_for(self._writer.wait_closed(), CLOSE_TIMEOUT)
        except (OSError, TimeoutError):
            return

    # --- its lines --------------------------------------------------------------------------------

    async def _listen(self) -> None:
        """Queue the client's lines with their arrival times; None when it has disconnected."""
        try:
            while line := await self._reader.readline():
                if not line.endswith(b"\n"):
                    break
                if line.strip():
                    await self._lines.put((time.perf_counter(), line))
        except ValueError:
            self._why = f"it sent a line of more than {MAX_CLIENT_LINE} bytes"
        except OSError:  # it disconnected with unread data
            pass
        await self._lines.put(None)

    async def _expect(self, form: type[Any], patience: float) -> Any:
        try:
            _, text = self._held(await asyncio.wait_for(self._next(), patience))
        except TimeoutError as error:
            raise SeatLostError(f"it sent nothing for {patience:g} s") from error
        try:
            message = from_client(text)
        except InputError as error:
            raise SeatLostError(str(error)) from error
        if not isinstance(message, form):
            raise SeatLostError(f"expected {form.__struct_config__.tag}")
        return message

    async def _next(self) -> tuple[float, bytes] | None:
        """Return the next line with its arrival time; None when the client has disconnected."""
        line = await self._lines.get()
        self._gone = self._gone or line is None
        return line

    def _held(self, line: tuple[float, bytes] | None) -> tuple[float, bytes]:
        """Return the line if the seat is still held."""
        if line is None:
            raise SeatLostError(self._why)
        return line

    def _count_bad(self, problem: str) -> None:
        """Count an invalid line; the seat is lost after too many."""
        self._bad += 1
        if self._bad > MAX_BAD_LINES:
            raise SeatLostError(f"too many bad lines, last: {problem}")
