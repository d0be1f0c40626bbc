"""Damaged messages to both sides of Digital Curling: `python -m fuzz.wire --messages 10000`.

A game is played once, and everything that its two sides say to each other in versions 3 and 4 is
kept. Then one message after another is damaged and given to the side that it was for, as it stands
in the middle of the game. Every message must be read or refused in a line; whatever else happens,
such as another error or an answer of 500, is unclean.
"""

from __future__ import annotations

import argparse
import asyncio
import base64
import copy
import io
import json
import random
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
from tqdm import tqdm

from agents.digital_curling.client import Client
from agents.digital_curling.conversation import from_server, write_line
from agents.digital_curling.dc4.application import MAX_BODY, application
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
from curling_env.errors import CurlingError
from curling_env.game.opponents import DrawPlayer
from curling_env.game.rules import Team
from curling_env.ice import load_ice
from fuzz.mutations import damaged

FOURS, DOUBLES = "dc4_server", "dc4_server_mixed_doubles"
ORDERS = ((0, 1, 2, 3), (0, 1, 2, 3))
PASSWORDS = {"anna": "correct horse"}
DRAW = ShotMessage(velocity=Point(0.13, 2.39), rotation="ccw")
Side = Callable[[random.Random], tuple[bytes, Callable[[], str]]]
"""Draws a damaged message, and gives what becomes of it: `read` or `refused`."""


def main() -> int:
    options = argparse.ArgumentParser(prog="fuzz.wire")
    options.add_argument("--messages", type=int, default=10_000, help="to each of the four sides")
    options.add_argument("--seed", type=int, default=0)
    chosen = options.parse_args()
    found = fuzz(chosen.messages, chosen.seed)
    print(json.dumps(found, indent=2))
    return 1 if any(side["unclean"] for side in found["sides"].values()) else 0


def fuzz(messages: int, seed: int) -> dict[str, Any]:
    """Give each side so many damaged messages.

    Returns
    -------
    the seed, and for each side how many messages were read, refused and unclean, and what happened
    """
    sides = {
        "client of version 3": client_of_version_3(),
        "host of version 3": host_of_version_3(),
        "client of version 4": client_of_version_4(),
        "host of version 4": host_of_version_4(),
    }
    found: dict[str, Any] = {}
    for number, (name, side) in enumerate(sides.items()):
        rng = random.Random(f"{seed} {number}")
        counts: Counter[str] = Counter(read=0, refused=0, unclean=0)
        ends: list[dict[str, str]] = []
        for _ in tqdm(range(messages), name, unit="message", file=sys.stderr, mininterval=2):
            message, give = side(rng)
            try:
                counts[give()] += 1
            except Exception:
                counts["unclean"] += 1
                ends.append({"message": repr(message[:2000]), "error": traceback.format_exc()})
        found[name] = {"messages": messages, **counts, "ends": ends[:20]}
    return {"seed": seed, "sides": found}


# --- a game, and what is said in it ---------------------------------------------------------------


def played(rules: str) -> Iterator[HostedGame]:
    """A game of one end before each of its shots, and after the last."""
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


def refused_or(action: Callable[[], Any]) -> str:
    """`read` if an action succeeds, `refused` if it fails in a line."""
    try:
        action()
    except CurlingError as error:
        if "\n" in str(error):
            raise AssertionError("more than one line") from error
        return "refused"
    return "read"


# --- version 3 ------------------------------------------------------------------------------------


def client_of_version_3() -> Side:
    """A client, and what a server says to it."""
    hosting = Hosting(HostSetting(ice=load_ice("fcv1"), ends=1))
    names = {"team0": "home", "team1": "away"}
    said: list[dict[str, Any]] = [
        hosting.greeting,
        {"cmd": "is_ready", "team": "team0", "game": hosting.setting.told},
        {"cmd": "new_game", "name": names},
        *(game.update for game in played("digital_curling")),
        {"cmd": "game_over"},
    ]
    lines = [write_line(message) for message in said]
    client, before = Client(DrawPlayer()), list[Client]()
    for line in lines:
        before.append(copy.deepcopy(client))
        client.answer(from_server(line))

    def draw(rng: random.Random) -> tuple[bytes, Callable[[], str]]:
        k = rng.randrange(len(lines))
        line = damaged(lines[k], rng)
        player = copy.deepcopy(before[k])
        player.pace.prepare = lambda views: None  # the same every time, and slow

        def answer() -> None:
            reply = player.answer(from_server(line))
            if reply is not None:
                write_line(reply)

        return line, lambda: refused_or(answer)

    return draw


def host_of_version_3() -> Side:
    """A host, and what clients say to it: their names, that they are ready, and moves."""
    hosting = Hosting(HostSetting(ice=load_ice("fcv1"), ends=1))
    ready = [{"cmd": "dc_ok", "name": "home"}, {"cmd": "ready_ok", "player_order": [3, 1, 0, 2]}]
    moves = [
        {"cmd": "move", "move": msgspec.to_builtins(DRAW)},
        {"cmd": "move", "move": {"type": "concede"}},
    ]
    games = _Games("digital_curling")

    def draw(rng: random.Random) -> tuple[bytes, Callable[[], str]]:
        if rng.random() < 0.2:
            k = rng.randrange(len(ready))
            lines = [write_line(message) for message in ready]
            lines[k] = damaged(lines[k], rng)
            return lines[k], lambda: refused_or(lambda: asyncio.run(_get_ready(hosting, lines)))
        line = damaged(write_line(rng.choice(moves)), rng)

        def play() -> None:
            game = games.now
            move = asyncio.run(_decide(game, line))
            if not isinstance(move, ConcedeMessage):
                game.shoot(move, 1.0)

        return line, lambda: refused_or(play)

    return draw


class _Games:
    """Games of one end, one after another."""

    def __init__(self, rules: str) -> None:
        self._setting = HostSetting(ice=load_ice("fcv1"), ends=1, rule_name=rules)
        self._game = HostedGame(self._setting, ("home", "away"), ORDERS)

    @property
    def now(self) -> HostedGame:
        """The game with a shot to come."""
        if self._game.is_over:
            self._game = HostedGame(self._setting, ("home", "away"), ORDERS)
        if self._game.awaits_placement:
            self._game.place("left", False)
        return self._game


class _Deaf(asyncio.StreamWriter):
    """Takes whatever is written."""

    def __init__(self) -> None:
        """Needs no connection."""

    def __del__(self, *_: Any) -> None:
        """Has nothing to close."""

    def write(self, data: Any) -> None:
        """Nobody reads it."""

    async def drain(self) -> None:
        """There is always room."""

    def close(self) -> None:
        """Nothing is open."""

    async def wait_closed(self) -> None:
        """It is closed."""


async def _seat(lines: list[bytes]) -> ClientSeat:
    reader = asyncio.StreamReader(limit=MAX_CLIENT_LINE)
    seat = ClientSeat(reader, _Deaf())
    for line in lines:
        reader.feed_data(line)
    reader.feed_eof()
    return seat


async def _get_ready(hosting: Hosting, lines: list[bytes]) -> None:
    seat = await _seat(lines)
    try:
        await seat.prepare(hosting.greeting, hosting.setting.told, Team.HOME)
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
    """A connection whose server says what it is given."""

    stream = b""

    def _open(self, path: str, query: Any, data: bytes | None, patience: float) -> Any:
        return io.BytesIO(self.stream if data is None else b"null")


def client_of_version_4() -> Side:
    """A client, and the events that a server sends: of fours and of mixed doubles."""
    place = Place4(
        url="http://127.0.0.1:9", match_id="x", team="team0", user="anna", password="secret"
    )
    given: list[tuple[Client, Reader4, bytes]] = []
    for rules in (FOURS, DOUBLES):
        client, reader = Client(DrawPlayer(), rule_name=rules), Reader4()
        hosting = Hosting(HostSetting(ice=load_ice("fcv1"), ends=1))
        is_ready = {"cmd": "is_ready", "team": "team0", "game": hosting.setting.told}
        client.answer(from_server(write_line(is_ready)))
        for game in played(rules):
            last = shot_of(DRAW) if game.update["state"]["shot"] else None
            more = {"last_move": last, "clocks": game.clocks, "doubles": doubles_of(game)}
            state = state_of(game.update, game.names, **more)
            event = b"event: latest_state_update\ndata: " + json.dumps(state).encode() + b"\n\n"
            given.append((copy.deepcopy(client), copy.deepcopy(reader), event))
            _take(client, reader, place, event)

    def draw(rng: random.Random) -> tuple[bytes, Callable[[], str]]:
        client, reader, event = given[rng.randrange(len(given))]
        head, _, state = event.partition(b"data: ")
        stream = head + b"data: " + damaged(state.rstrip(), rng) + b"\n\n"
        if rng.random() < 0.2:
            stream = damaged(event, rng)
        player, reading = copy.deepcopy(client), copy.deepcopy(reader)
        return stream, lambda: refused_or(lambda: _take(player, reading, place, stream))

    return draw


def _take(client: Client, reader: Reader4, place: Place4, stream: bytes) -> None:
    connection = _Served(place, WireLog())
    connection.stream = stream
    for state, is_latest in connection.states():
        answer_state(connection, client, reader, state, is_latest)


def host_of_version_4() -> Side:
    """A host in the middle of a game, and requests to it."""
    token = base64.b64encode(b"anna:correct horse")
    games = {rules: _Games(rules) for rules in (FOURS, DOUBLES)}
    team = msgspec.json.encode(Team4("home"))
    shot = msgspec.json.encode(shot_of(DRAW))

    def draw(rng: random.Random) -> tuple[bytes, Callable[[], str]]:
        rules = rng.choice((FOURS, DOUBLES))
        hosting = Hosting(HostSetting(ice=load_ice("fcv1"), ends=1, rule_name=rules))
        one = f"/matches/{hosting.game_id}"
        match_id = f"match_id={hosting.game_id}".encode()
        method, path, query, body = rng.choice(
            (
                ("POST", "/shots", match_id, shot),
                ("POST", "/shots", match_id, shot),
                ("POST", "/store-team-config", match_id + b"&expected_match_team_name=team0", team),
                ("POST", f"{one}/end-setup", b"request=pp_left", b""),
                ("POST", "/matches", b"", b'{"game_mode": "standard"}'),
                ("GET", rng.choice(("/", one, f"{one}/score", f"{one}/latest-state")), b"", b""),
                ("GET", "/game.json", b"after=0", b""),
            )
        )
        parts = [path.encode(), query, b"Basic " + token, body]
        k = 3 if body and rng.random() < 0.6 else rng.randrange(3)
        parts[k] = damaged(parts[k], rng)

        def ask() -> str:
            status = asyncio.run(_ask(hosting, games[rules].now, method, parts))
            assert status < 500, status
            return "read" if status < 400 else "refused"

        return b"\n".join(parts), ask

    return draw


async def _ask(hosting: Hosting, game: HostedGame, method: str, parts: list[bytes]) -> int:
    """The status of an answer; a shot that is taken is played."""
    path, query, authorization, body = parts
    hosting.game = game
    match = Match4(hosting, set(Team))
    match.users["anna"] = game.to_throw
    waiting = asyncio.create_task(match.decision(game.to_throw, 5.0))
    await asyncio.sleep(0)
    scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": path.decode("utf-8", "replace"),
        "raw_path": path,
        "query_string": query,
        "headers": [(b"authorization", authorization), (b"host", b"127.0.0.1")],
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 80),
    }
    pieces = [body[a : a + MAX_BODY // 2] for a in range(0, len(body), MAX_BODY // 2)] or [b""]
    statuses: list[int] = []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": pieces.pop(0), "more_body": bool(pieces)}

    async def send(message: Any) -> None:
        if message["type"] == "http.response.start":
            statuses.append(message["status"])

    await application(match, PASSWORDS)(scope, receive, send)
    await asyncio.sleep(0)
    if waiting.done():
        game.shoot(called(waiting.result()), 1.0)
    waiting.cancel()
    return statuses[0]


if __name__ == "__main__":
    sys.exit(main())
