"""Conversations of Digital Curling, versions 3 and 4, with either side of it.

A game is played once, and every message of its two sides is kept. Each may then be damaged and
sent to its recipient, at its point of the game. Every message must be
read or refused in one line; any other result, such as an answer of 500, is unclean.
"""

from __future__ import annotations

import asyncio
import base64
import copy
import io
import json
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple
from unittest import mock

import msgspec

from agents.digital_curling.client import Client
from agents.digital_curling.conversation import from_server, write_line
from agents.digital_curling.dc4.application import application
from agents.digital_curling.dc4.join import Connection4, Place4, answer_state
from agents.digital_curling.dc4.match import Match4, called, doubles_of
from agents.digital_curling.dc4.messages import Reader4, Team4, shot_of, state_of
from agents.digital_curling.hosting.hosted_game import HostedGame
from agents.digital_curling.hosting.seats import (
    MAX_CLIENT_LINE,
    ClientSeat,
    OutOfTimeError,
    SeatLostError,
)
from agents.digital_curling.hosting.server import Hosting
from agents.digital_curling.hosting.setting import HostSetting
from agents.digital_curling.join import WireLog
from agents.digital_curling.messages import ConcedeMessage, Point, ShotMessage
from curling_env.errors import InputError
from curling_env.game.opponents import DrawPlayer
from curling_env.game.rules import Team
from curling_env.ice import load_ice
from fuzz.app import answer, request

FOURS, DOUBLES = "dc4_server", "dc4_server_mixed_doubles"
ORDERS = ((0, 1, 2, 3), (0, 1, 2, 3))
PASSWORDS = {"anna": "correct horse"}
DRAW = ShotMessage(velocity=Point(0.13, 2.39), rotation="ccw")
NAMES = {"team0": "home", "team1": "away"}


class Message(NamedTuple):
    """Message and its recipient; each process sends one message."""

    message: bytes
    give: Callable[[bytes], object]


def sides() -> dict[str, list[Message]]:
    """Return the messages to each side."""
    return {
        "client of version 3": client_of_version_3(),
        "host of version 3": host_of_version_3(),
        "client of version 4": client_of_version_4(),
        "host of version 4": host_of_version_4(),
    }


def played(rules: str) -> Iterator[HostedGame]:
    """Yield a game of one end before each of its shots, and after the last."""
    setting = HostSetting(ice=load_ice("fcv1"), ends=1, rule_name=rules)
    game = HostedGame(setting, ("home", "away"), ORDERS)
    while True:
        yield game
        if game.is_over:
            return
        if game.awaits_placement:
            game.place("left", False)
        else:
            game.shoot(DRAW, 1.0)


# --- version 3 ------------------------------------------------------------------------------------


def client_of_version_3() -> list[Message]:
    """Return messages of a server to a client."""
    hosting = Hosting(HostSetting(ice=load_ice("fcv1"), ends=1))
    messages: list[dict[str, Any]] = [
        hosting.greeting,
        {"cmd": "is_ready", "team": "team0", "game": hosting.setting.announcement},
        {"cmd": "new_game", "name": NAMES},
        *(game.update for game in played("digital_curling")),
        {"cmd": "game_over"},
    ]
    client, found = Client(DrawPlayer()), list[Message]()
    for line in map(write_line, messages):
        found.append(Message(line, partial(_answer, copy.deepcopy(client))))
        client.answer(from_server(line))
    return found


def _answer(client: Client, line: bytes) -> None:
    client.time_manager.prepare = lambda views: None  # the same every time, and slow
    reply = client.answer(from_server(line))
    if reply is not None:
        write_line(reply)


def host_of_version_3() -> list[Message]:
    """Return messages of clients to a host: names, readiness and moves."""
    hosting = Hosting(HostSetting(ice=load_ice("fcv1"), ends=1))
    ready = [{"cmd": "dc_ok", "name": "home"}, {"cmd": "ready_ok", "player_order": [3, 1, 0, 2]}]
    lines = [write_line(message) for message in ready]
    moves = [
        {"cmd": "move", "move": msgspec.to_builtins(DRAW)},
        {"cmd": "move", "move": {"type": "concede"}},
    ]
    game = next(played("digital_curling"))

    def play(line: bytes) -> None:
        move = asyncio.run(_decide(game, line))
        if not isinstance(move, ConcedeMessage):
            game.shoot(move, 1.0)

    return [
        Message(lines[0], lambda line: asyncio.run(_get_ready(hosting, [line, lines[1]]))),
        Message(lines[1], lambda line: asyncio.run(_get_ready(hosting, [lines[0], line]))),
        *(Message(write_line(move), play) for move in [*moves, moves[0], moves[0]]),
    ]


async def _seat(lines: list[bytes]) -> ClientSeat:
    reader = asyncio.StreamReader(limit=MAX_CLIENT_LINE)
    seat = ClientSeat(reader, mock.create_autospec(asyncio.StreamWriter))  # deaf, and never full
    for line in lines:
        reader.feed_data(line)
    reader.feed_eof()
    return seat


async def _get_ready(hosting: Hosting, lines: list[bytes]) -> None:
    seat = await _seat(lines)
    try:
        await seat.prepare(hosting.greeting, hosting.setting.announcement, Team.HOME)
    finally:
        await seat.close()


async def _decide(game: HostedGame, line: bytes) -> Any:
    seat = await _seat([line + b"\n"])
    try:
        return (await seat.decide(game.update, game.view, 5.0)).move
    except OutOfTimeError as error:
        raise SeatLostError("its time is up") from error
    finally:
        await seat.close()


# --- version 4 ------------------------------------------------------------------------------------


class _Served(Connection4):
    """Connection whose server sends given messages."""

    stream = b""

    def _open(self, path: str, query: Any, data: bytes | None, patience: float) -> Any:
        return io.BytesIO(self.stream if data is None else b"null")


def client_of_version_4() -> list[Message]:
    """Events that a server sends to a client: of fours and of mixed doubles."""
    place = Place4(
        url="http://127.0.0.1:9", match_id="x", team="team0", user="anna", password="secret"
    )
    found: list[Message] = []
    for rules in (FOURS, DOUBLES):
        client, reader = Client(DrawPlayer(), rule_name=rules), Reader4()
        hosting = Hosting(HostSetting(ice=load_ice("fcv1"), ends=1))
        is_ready = {"cmd": "is_ready", "team": "team0", "game": hosting.setting.announcement}
        client.answer(from_server(write_line(is_ready)))
        for game in played(rules):
            last = shot_of(DRAW) if game.update["state"]["shot"] else None
            more = {"last_move": last, "clocks": game.clocks, "doubles": doubles_of(game)}
            state = state_of(game.update, game.names, **more)
            event = b"event: latest_state_update\r\ndata: " + json.dumps(state).encode() + b"\n\n"
            take = partial(_take, copy.deepcopy(client), copy.deepcopy(reader), place)
            found.append(Message(event, take))
            _take(client, reader, place, event)
    return found


def _take(client: Client, reader: Reader4, place: Place4, stream: bytes) -> None:
    connection = _Served(place, WireLog())
    connection.stream = stream
    for state, is_latest in connection.states():
        answer_state(connection, client, reader, state, is_latest)


def host_of_version_4() -> list[Message]:
    """Requests to a host in the middle of a game."""
    token = base64.b64encode(b"anna:correct horse").decode()
    team = msgspec.json.encode(Team4("home"))
    shot = msgspec.json.encode(shot_of(DRAW))
    found: list[Message] = []
    for rules in (FOURS, DOUBLES):
        hosting = Hosting(HostSetting(ice=load_ice("fcv1"), ends=1, rule_name=rules))
        game = next(played(rules))
        if game.awaits_placement:
            game.place("left", False)
        one, match = f"/matches/{hosting.game_id}", f"match_id={hosting.game_id}"
        asked = (
            ("POST", f"/shots?{match}", shot),
            ("POST", f"/shots?{match}", shot),
            ("POST", f"/store-team-config?{match}&expected_match_team_name=team0", team),
            ("POST", f"{one}/end-setup?request=pp_left", b""),
            ("POST", "/matches", b'{"game_mode": "standard"}'),
            *(("GET", path, b"") for path in ("/", one, f"{one}/score", f"{one}/latest-state")),
            ("GET", "/game.json?after=0", b""),
        )
        headers = {"Host": "127.0.0.1", "Authorization": f"Basic {token}"}
        found += [
            Message(request(method, path, headers, body), partial(_ask, hosting, game))
            for method, path, body in asked
        ]
    return found


def _ask(hosting: Hosting, game: HostedGame, message: bytes) -> None:
    """Let a host answer a request; a shot that is taken is played.

    Raises
    ------
    InputError : the request is refused
    AssertionError : the host answers with an internal error
    """

    async def asked() -> int:
        hosting.game = game
        match = Match4(hosting, set(Team))
        match.users["anna"] = game.to_throw
        waiting = asyncio.create_task(match.shot.of(game.to_throw, 5.0))
        await asyncio.sleep(0)
        status = await answer(application(match, PASSWORDS), message)
        await asyncio.sleep(0)
        if waiting.done():
            game.shoot(called(waiting.result()), 1.0)
        waiting.cancel()
        return status

    status = asyncio.run(asked())
    assert status < 500, status
    if status >= 400:
        raise InputError(f"status {status}")
