"""Plays on Digital Curling 4's server: HTTP requests, and a stream of server-sent events."""

from __future__ import annotations

import base64
import json
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from http.client import HTTPException, HTTPResponse
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode, urlsplit
from urllib.request import HTTPRedirectHandler, Request, build_opener

import msgspec

from agents.digital_curling.client import Client
from agents.digital_curling.conversation import GameMessage, IsReady, MoveLine, PlayerMessage
from agents.digital_curling.dc4.messages import (
    RULES,
    Player4,
    Reader4,
    Shot4,
    State4,
    Team4,
    player_from,
    shot_of,
)
from agents.digital_curling.join import WireLog
from agents.digital_curling.messages import TEAMS, SettingMessage, ShotMessage, TeamName
from curling_env.errors import InputError
from curling_env.infrastructure.files.schema import Short, checked
from curling_env.infrastructure.files.storage import parse_json

PATIENCE = 20.0
"""Time in which the server must answer a request [s]."""
SILENCE = 120.0
"""Time after which a stream without even a ping is taken for broken [s]; they come each 30 s."""
TRIES = 5
"""Times that a stream is opened anew, or a shot is sent, before the game is given up."""
PAUSE = 2.0
"""Time before the next try [s]."""
KINDS = ("latest_state_update", "state_update")
"""Events that tell a state: the latest, and those before it to who comes late."""
BUSY = (429, 502, 503, 504)
"""Answers after which a request may be made again."""
MAX_EVENT = 2**20
"""Longest event that is read [bytes]."""


class MatchData(msgspec.Struct):
    """What a server tells of a match."""

    standard_end_count: int | None = None
    applied_rule: int | Short | None = None
    time_limit: float | None = None
    extra_end_time_limit: float | None = None


@dataclass(frozen=True, kw_only=True)
class Place4:
    """Where to play, and as whom.

    Parameters
    ----------
    url : address of the server, ``https://…``
    match_id : the match
    team : the team wanted; the server may give the other one
    user, password : for Basic authentication
    """

    url: str
    match_id: str
    team: TeamName
    user: str
    password: str

    def __post_init__(self) -> None:
        parts = urlsplit(self.url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.username:
            raise InputError(
                f"a server is named https://HOST or http://HOST:PORT, got {self.url[:80]!r}"
            )

    @property
    def is_open(self) -> bool:
        """Whether the password crosses a network that others may read."""
        parts = urlsplit(self.url)
        return parts.scheme == "http" and parts.hostname not in ("127.0.0.1", "localhost", "::1")


class _NoRedirects(HTTPRedirectHandler):
    """The password goes to the server that was named, and to no other."""

    def redirect_request(self, *args: Any, **kwargs: Any) -> None:
        """No request takes the place of the first."""


class Connection4:
    """Requests to a server.

    Parameters
    ----------
    place : where, and as whom
    log : notes what is said
    """

    def __init__(self, place: Place4, log: WireLog) -> None:
        self.place, self.log = place, log
        self._opener = build_opener(_NoRedirects)
        token = base64.b64encode(f"{place.user}:{place.password}".encode()).decode()
        self._headers = {"Authorization": f"Basic {token}", "User-Agent": "curling-sheet"}

    def ask(self, path: str, query: dict[str, str] | None = None, body: Any = None) -> Any:
        """The document that answers a request; one with a body is a POST.

        Raises
        ------
        InputError : it is refused, or nobody answers
        """
        data = None if body is None else msgspec.json.encode(body)
        if data is not None:
            self.log.sent(path.encode() + b" " + data)
        with closing(self._open(path, query, data, PATIENCE)) as response:
            text = response.read(MAX_EVENT)
        return parse_json(text, source=self.place.url) if text.strip() else None

    def states(self) -> Iterator[tuple[State4, bool]]:
        """The states that the stream tells, and whether each is the latest, until it ends.

        Raises
        ------
        InputError : an event that is none
        """
        path = f"/matches/{self.place.match_id}/stream"
        with closing(self._open(path, None, None, SILENCE)) as response:
            kind, data = "", b""
            while line := response.readline(MAX_EVENT + 1):
                if len(line) + len(data) > MAX_EVENT:
                    raise InputError("an event is too long", source=self.place.url)
                name, _, value = line.rstrip(b"\r\n").partition(b":")
                value = value.removeprefix(b" ")
                if name == b"event":
                    kind = value.decode("utf-8", "replace")
                elif name == b"data":
                    data += value
                elif not line.strip():
                    if kind in KINDS and data:
                        self.log.received(data)
                        yield self._state(data), kind == KINDS[0]
                    kind, data = "", b""

    def _state(self, data: bytes) -> State4:
        document = parse_json(data, source=self.place.url)
        try:
            return checked(document, State4)
        except InputError as error:
            raise InputError(error.problem, source=self.place.url, where=error.where) from error

    def _open(
        self, path: str, query: dict[str, str] | None, data: bytes | None, patience: float
    ) -> HTTPResponse:
        url = self.place.url.rstrip("/") + path + (f"?{urlencode(query)}" if query else "")
        headers = dict(self._headers)
        if data is not None:
            headers["Content-Type"] = "application/json"
        try:
            return self._opener.open(Request(url, data=data, headers=headers), timeout=patience)
        except HTTPError as error:
            with error:
                said = _detail(error.read(4096))
            raise RefusedByServerError(error.code, said, self.place.url) from error
        except (OSError, HTTPException) as error:
            reason = error.reason if isinstance(error, URLError) else error
            raise NoAnswerError(f"no answer: {str(reason)[:120]}", source=self.place.url) from error


class NoAnswerError(InputError):
    """Nobody answers, or the connection broke."""


class RefusedByServerError(InputError):
    """The server refuses a request.

    Parameters
    ----------
    status : HTTP status
    detail : what the server says
    source : its address
    """

    def __init__(self, status: int, detail: str, source: str) -> None:
        meaning = {401: "user or password refused", 404: "no such match", 429: "too many requests"}
        said = meaning.get(status, "the server refuses this")
        super().__init__(f"{said} ({status}{': ' if detail else ''}{detail})", source=source)
        self.status = status


def play_on_web_server(
    place: Place4, client: Client, log: WireLog, *, on_update: Callable[[], None] = lambda: None
) -> None:
    """Play a match to its end.

    Parameters
    ----------
    place : where, and as whom
    client : plays for the team
    log : notes all that is said
    on_update : called after each position

    Raises
    ------
    InputError : a request is refused, a state is none, or the server is gone for good
    """
    connection = Connection4(place, log)
    given = connection.ask(f"/matches/{place.match_id}")
    data = checked(given if isinstance(given, dict) else {}, MatchData, inside="match")
    if data.applied_rule in (1, RULES[1]):
        client.use_rules("dc4_server_no_tick")
    player = Player4(player_name=client.name)
    team = Team4(client.name, False, player, player, player, player)
    named = connection.ask(
        "/store-team-config",
        {"match_id": place.match_id, "expected_match_team_name": place.team},
        team,
    )
    taken: TeamName = "team1" if named == TEAMS[1] else "team0"
    setting = SettingMessage(max_end=data.standard_end_count)
    players: dict[TeamName, list[PlayerMessage]] = {
        taken: [player_from(one) for one in team.players]
    }
    client.game_id = place.match_id
    client.answer(IsReady(team=taken, game=GameMessage(setting=setting, players=players)))
    reader, failures = Reader4(), 0
    while client.result is None:
        try:
            for state, is_latest in connection.states():
                failures = 0
                _answer(connection, client, reader, state, is_latest)
                on_update()
                if client.result is not None:
                    return
            problem: InputError = NoAnswerError(
                f"the server hung up before the game was over ({client.place()})", source=place.url
            )
        except (NoAnswerError, RefusedByServerError) as error:
            if isinstance(error, RefusedByServerError) and error.status not in BUSY:
                raise
            problem = error
        except (OSError, HTTPException) as error:
            problem = NoAnswerError(f"the stream broke off ({client.place()})", source=place.url)
            problem.__cause__ = error
        failures += 1
        if failures >= TRIES:
            raise problem
        time.sleep(PAUSE)


def _answer(
    connection: Connection4, client: Client, reader: Reader4, state: State4, is_latest: bool
) -> None:
    """Take note of a state, and answer the latest where that is expected."""
    client.names = (state.first_team_name or "team0", state.second_team_name or "team1")
    update = reader.read(state)
    if update is None:
        return
    if not is_latest:
        client.see(update)
        return
    answer = client.answer(update)
    if not isinstance(answer, MoveLine):
        return
    if not isinstance(answer.move, ShotMessage):
        # Version 4 knows no way to concede: the stone is thrown away.
        answer = MoveLine(move=client.thrown_away())
    assert isinstance(answer.move, ShotMessage)
    _send(connection, shot_of(answer.move))


def _send(connection: Connection4, shot: Shot4) -> None:
    """Send a shot, again if the server is busy or nobody answers."""
    perhaps_there = False
    for number in range(TRIES):
        try:
            connection.ask("/shots", {"match_id": connection.place.match_id}, shot)
            return
        except NoAnswerError:
            perhaps_there = True
            if number == TRIES - 1:
                raise
        except RefusedByServerError as error:
            if perhaps_there and error.status == 400:
                return  # the one before has arrived: it is not our turn any more
            if error.status not in BUSY or number == TRIES - 1:
                raise
        time.sleep(PAUSE)


def _detail(text: bytes) -> str:
    """What a server says in a refusal, as one short line."""
    try:
        document = json.loads(text)
    except ValueError:
        return ""
    detail = document.get("detail", "") if isinstance(document, dict) else ""
    return " ".join(str(detail).split())[:120]
