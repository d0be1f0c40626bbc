"""Server of a game between two seats, with clients over TCP."""

from __future__ import annotations

import asyncio
import os
import socket
import uuid
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from agents.digital_curling.conversation import PROTOCOL
from agents.digital_curling.game_record import outcome_of
from agents.digital_curling.hosting.hosted_game import HostedGame
from agents.digital_curling.hosting.logs import DcLog, local_time
from agents.digital_curling.hosting.seats import (
    MAX_CLIENT_LINE,
    ClientSeat,
    OutOfTimeError,
    PlayerSeat,
    Seat,
    SeatLostError,
)
from agents.digital_curling.hosting.setting import HostSetting
from agents.digital_curling.messages import TEAMS, ConcedeMessage
from agents.playing.record import write_lines
from agents.playing.replay.page import write_page
from agents.playing.scoreboard import scoreboard
from curling_env.errors import InputError
from curling_env.game.rules import Team
from curling_env.infrastructure.files.writing import together
from curling_env.units import Units

Remark = Callable[[str], None]
_Answer = TypeVar("_Answer")


@dataclass
class Hosting:
    """Hosted game and its records.

    Parameters
    ----------
    setting : settings of the game
    remark : called with remarks for the host's user
    changed : called when there is a new position to show
    """

    setting: HostSetting
    remark: Remark = lambda text: None
    changed: Callable[[], None] = lambda: None
    game: HostedGame | None = None
    log: DcLog = field(default_factory=DcLog)
    game_id: str = field(default_factory=lambda: str(uuid.uuid4()))
    date_time: str = field(default_factory=local_time)

    @property
    def greeting(self) -> dict[str, Any]:
        """Return the host's first line."""
        return {
            "cmd": "dc",
            "version": {"major": PROTOCOL, "minor": 0},
            "game_id": self.game_id,
            "date_time": self.date_time,
        }

    def write(self, folder: Path, units: Units = Units.METRES) -> None:
        """Write the logs, the record and its page for the game up to now."""
        lines = self._played.record()
        with together():
            self.log.write(folder, self.game, self.game_id, self.date_time)
            write_lines(folder / "game.jsonl", lines)
            write_page(folder / "game.html", lines, units)

    def summary(self) -> dict[str, Any]:
        """Return the result of the game for JSON."""
        game = self._played
        assert game.result is not None
        return {
            "team0": game.names[0],
            "team1": game.names[1],
            "game_id": self.game_id,
            "ice": self.setting.ice_name,
            "seed": self.setting.seed,
            "score": list(game.game.score),
            "line_score": [list(end) for end in game.game.line_score],
            "winner": game.result["winner"],
            "reason": game.result["reason"],
            "stones": sum(shot["trajectory"] is not None for shot in game.shots),
        }

    def sentences(self) -> tuple[str, str]:
        """Return the line score and the winner."""
        game, found = self._played, self.summary()
        table = scoreboard(game.game, game.names)
        return table, outcome_of(game.names, found["winner"], found["reason"])

    @property
    def _played(self) -> HostedGame:
        assert self.game is not None
        return self.game

    async def play(self, seats: tuple[Seat, Seat]) -> HostedGame:
        """Play the game between two ready seats to its end."""
        names, orders = (seats[0].name, seats[1].name), (seats[0].order, seats[1].order)
        given = self.setting.throwers
        own = [seat.throwers or given[team] for team, seat in enumerate(seats)]
        self.setting = replace(self.setting, throwers=(own[0], own[1]))
        game = self.game = HostedGame(self.setting, names, orders)
        self.log.beginning(self.greeting, self.setting.announcement, names, orders)
        for seat in seats:
            if isinstance(seat, PlayerSeat):
                await seat.warm_up(game.example)
        lost: set[Team] = set()
        await self._broadcast(
            seats, lost, {"cmd": "new_game", "name": dict(zip(TEAMS, names, strict=True))}
        )
        self.log.game(game.update)
        self.changed()
        while not game.is_over:
            if game.awaits_placement:
                await self._placement(game, seats, lost)
            else:
                await self._turn(game, seats, lost)
                shot = game.shots[-1]
                self.log.game({"cmd": "move", "move": shot["selected_move"], "team": shot["team"]})
            self.log.game(_without_trajectory(game.update))
            self.changed()
        await self._broadcast(seats, lost, game.update)
        await self._broadcast(seats, lost, {"cmd": "game_over"})
        self.log.game({"cmd": "game_over"})
        return game

    async def _placement(self, game: HostedGame, seats: tuple[Seat, Seat], lost: set[Team]) -> None:
        """Get the placement of an end of mixed doubles, which uses no time of the clock.

        A team that takes longer than its clock has left loses nevertheless.
        """
        team = game.decides
        clock = game.clock[team]
        placement = await self._asked(
            game, seats, lost, team, lambda seat: seat.place(game.view, clock)
        )
        if placement is not None:
            game.place(placement.side, placement.throws_first)

    async def _turn(self, game: HostedGame, seats: tuple[Seat, Seat], lost: set[Team]) -> None:
        """Get one move, or its substitute if a team has disconnected or has no time left."""
        team = game.to_throw
        await self._send_to(seats, lost, team.other, game.update)
        clock = game.clock[team]
        turn = await self._asked(
            game, seats, lost, team, lambda seat: seat.decide(game.update, game.view, clock)
        )
        if turn is None:
            return
        if isinstance(turn.move, ConcedeMessage):
            game.give_up(team)
        else:
            await asyncio.to_thread(game.shoot, turn.move, turn.seconds)

    async def _asked(
        self,
        game: HostedGame,
        seats: tuple[Seat, Seat],
        lost: set[Team],
        team: Team,
        ask: Callable[[Seat], Awaitable[_Answer]],
    ) -> _Answer | None:
        """Get a team's answer; None if it has disconnected or has no time left, and so loses."""
        if team in lost:
            game.give_up(team)
            return None
        try:
            return await ask(seats[team])
        except SeatLostError as error:
            self._note_loss(seats, lost, team, error)
            game.give_up(team)
        except OutOfTimeError:
            game.give_up(team, "time_limit")
        return None

    async def _broadcast(
        self, seats: tuple[Seat, Seat], lost: set[Team], message: dict[str, Any]
    ) -> None:
        for team in Team:
            await self._send_to(seats, lost, team, message)

    async def _send_to(
        self, seats: tuple[Seat, Seat], lost: set[Team], team: Team, message: dict[str, Any]
    ) -> None:
        if team in lost:
            return
        try:
            await seats[team].send(message)
        except SeatLostError as error:
            self._note_loss(seats, lost, team, error)

    def _note_loss(
        self, seats: tuple[Seat, Seat], lost: set[Team], team: Team, error: SeatLostError
    ) -> None:
        lost.add(team)
        self.remark(f"{TEAMS[team]} ({seats[team].name}) left the game: {error}")


class Door:
    """Port for clients of one team, one at a time.

    Parameters
    ----------
    team : team of the clients
    """

    def __init__(self, team: Team) -> None:
        self.team = team
        self._arrived: asyncio.Queue[ClientSeat] = asyncio.Queue()
        self._is_taken = False
        self.port = 0

    async def open(self, address: str, port: int) -> asyncio.Server:
        """Listen; port 0 takes any free one.

        Raises
        ------
        InputError : the port is taken, or the address is not one of this machine's
        """
        try:
            server = await asyncio.start_server(
                self._come_in, address, port, limit=MAX_CLIENT_LINE, backlog=8
            )
        except OSError as error:
            # asyncio repeats the address in addition to the system's message.
            number = error.errno or 0
            reason = (os.strerror(number) if number > 0 else "no such address").lower()
            raise InputError(
                f"cannot listen on this address: {reason}", source=f"{address}:{port}"
            ) from error
        self.port = int(server.sockets[0].getsockname()[1])
        return server

    async def _come_in(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._is_taken:
            writer.close()  # the seat is already taken
            return
        self._is_taken = True
        connection = writer.get_extra_info("socket")
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        await self._arrived.put(ClientSeat(reader, writer))

    async def seat(self, hosting: Hosting) -> ClientSeat:
        """Wait for a client that is ready to play."""
        while True:
            seat = await self._arrived.get()
            try:
                await seat.prepare(hosting.greeting, hosting.setting.announcement, self.team)
            except SeatLostError as error:
                hosting.remark(f"a client for {TEAMS[self.team]} was refused: {error}")
                await seat.close()
                self._is_taken = False
                continue
            hosting.remark(f"{seat.name} is ready as {TEAMS[self.team]}")
            return seat


async def host_game(
    hosting: Hosting,
    players: tuple[Seat | None, Seat | None],
    *,
    address: str = "127.0.0.1",
    ports: tuple[int, int] = (10000, 10001),
    opened: Callable[[tuple[int, int]], None] = lambda ports: None,
) -> HostedGame:
    """Host one game.

    Parameters
    ----------
    hosting : the game
    players : seat of each team that is already taken; None for one that a client takes
    address, ports : address, and ports for clients of team 0 and of team 1
    opened : called with the ports once they are open

    Raises
    ------
    InputError : a port that cannot be opened
    """
    doors = [Door(team) for team in Team]
    async with AsyncExitStack() as stack:
        for door, player, port in zip(doors, players, ports, strict=True):
            if player is None:
                stack.callback((await door.open(address, port)).close)
        opened((doors[0].port, doors[1].port))
        seats = await asyncio.gather(
            *(
                door.seat(hosting) if player is None else _prepared(player, hosting, door.team)
                for door, player in zip(doors, players, strict=True)
            )
        )
        for seat in seats:
            stack.push_async_callback(seat.leave)
        return await hosting.play((seats[0], seats[1]))


async def _prepared(seat: Seat, hosting: Hosting, team: Team) -> Seat:
    await seat.prepare(hosting.greeting, hosting.setting.announcement, team)
    return seat


def _without_trajectory(update: dict[str, Any]) -> dict[str, Any]:
    """Return the message as in the game's log; the paths are in the shots' own files."""
    last_move = update["last_move"]
    if last_move is None or "trajectory" not in last_move:
        return update
    return {**update, "last_move": {k: v for k, v in last_move.items() if k != "trajectory"}}
