"""Client of Digital Curling 4's server: HTTP requests, and a stream of server-sent events."""

from __future__ import annotations

import base64
import json
import ssl
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from http.client import HTTPException, HTTPResponse
from pathlib import Path
from typing import Annotated, Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode, urlsplit
from urllib.request import (
    BaseHandler,
    HTTPRedirectHandler,
    HTTPSHandler,
    Request,
    build_opener,
)

import msgspec

from agents.digital_curling.client import Client
from agents.digital_curling.conversation import GameMessage, IsReady, MoveLine, PlayerMessage
from agents.digital_curling.dc4.messages import (
    MODES,
    RULES,
    Player4,
    Reader4,
    Shot4,
    State4,
    Team4,
    player_from,
    request_of,
    shot_of,
)
from agents.digital_curling.join import WireLog
from agents.digital_curling.messages import TEAMS, SettingMessage, ShotMessage, TeamName
from curling_env.errors import InputError, placed
from curling_env.game.rules.rulesets import ARRANGEMENTS
from curling_env.infrastructure.files.reading import parse_json
from curling_env.infrastructure.files.schema import Short, checked, within

REQUEST_TIMEOUT = 20.0
"""Timeout of a request [s]."""
STREAM_TIMEOUT = 120.0
"""Time without even a ping after which a stream counts as broken [s]; pings come every 30 s."""
MAX_ATTEMPTS = 5
"""Number of attempts to open a stream, or to send a shot, before the game is given up."""
RETRY_DELAY = 2.0
"""Time before the next attempt [s]."""
KINDS = ("latest_state_update", "state_update")
"""Events with a state: the latest, and those before it for a late client."""
RETRY_STATUSES = (429, 502, 503, 504)
"""Statuses after which a request may be repeated."""
MAX_EVENT = 2**20
"""Maximum length of an event [bytes]."""


class MatchDoubles(msgspec.Struct):
    """Mixed-doubles data of a match."""

    positioned_stones_pattern: Annotated[int, within(0, ARRANGEMENTS - 1)] = 0


class MatchData(msgspec.Struct):
    """Server's data of a match."""

    standard_end_count: int | None = None
    applied_rule: int | Short | None = None
    time_limit: float | None = None
    extra_end_time_limit: float | None = None
    game_mode: Short = "standard"
    mixed_doubles_settings: MatchDoubles | None = None
    mix_doubles_settings: MatchDoubles | None = None

    @property
    def rules(self) -> str:
        """Return the rules by their number or name."""
        rule = self.applied_rule
        named = RULES[rule] if isinstance(rule, int) and 0 <= rule < len(RULES) else rule
        return RULES[2] if self.game_mode in MODES else str(named)

    @property
    def arrangement(self) -> int:
        """Return the arrangement of the placed stones."""
        settings = self.mixed_doubles_settings or self.mix_doubles_settings
        return 0 if settings is None else settings.positioned_stones_pattern


@dataclass(frozen=True, kw_only=True)
class Place4:
    """Server, match and user.

    Parameters
    ----------
    url : address of the server, ``https://…``
    match_id : the match
    team : the team wanted; the server may give the other one
    user, password : for Basic authentication
    certificate : file of a certificate to trust in addition to those of the system, PEM

    Raises
    ------
    InputError : an invalid address, or a file without a certificate
    """

    url: str
    match_id: str
    team: TeamName
    user: str
    password: str
    certificate: Path | None = None

    def __post_init__(self) -> None:
        parts = urlsplit(self.url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.username:
            raise InputError(
                f"expected a server https://HOST or http://HOST:PORT, got {self.url[:80]!r}"
            )
        if self.certificate is not None:
            self.trust()

    def trust(self) -> ssl.SSLContext:
        """Return the trusted certificates: those of the system's authorities, and the given one."""
        context = ssl.create_default_context()
        if self.certificate is not None:
            try:
                context.load_verify_locations(self.certificate)
            except (OSError, ValueError) as error:  # ssl's own error is an OSError
                raise InputError(
                    "expected a certificate in PEM form", source=self.certificate
                ) from error
        return context

    @property
    def is_open(self) -> bool:
        """Return whether the password crosses a network unencrypted."""
        parts = urlsplit(self.url)
        return parts.scheme == "http" and parts.hostname not in ("127.0.0.1", "localhost", "::1")


class _NoRedirects(HTTPRedirectHandler):
    """Handler that refuses redirects: the password goes only to the named server."""

    def redirect_request(self, *args: Any, **kwargs: Any) -> None:
        """Return None: no other request replaces the first."""


class Connection4:
    """Requests to a server.

    Parameters
    ----------
    place : server, match and user
    log : log of the messages
    """

    def __init__(self, place: Place4, log: WireLog) -> None:
        self.place, self.log = place, log
        handlers: list[BaseHandler] = [_NoRedirects()]
        if urlsplit(place.url).scheme == "https":
            handlers.append(HTTPSHandler(context=place.trust()))
        self._opener = build_opener(*handlers)
        token = base64.b64encode(f"{place.user}:{place.password}".encode()).decode()
        self._headers = {"Authorization": f"Basic {token}", "User-Agent": "curling-sheet"}

    def ask(self, path: str, query: dict[str, str] | None = None, body: Any = None) -> Any:
        """Return the document that answers a request; one with a body is a POST.

        Raises
        ------
        InputError : the request is refused, or there is no answer
        """
        data = None if body is None else msgspec.json.encode(body)
        return self._answer(path, query, data)

    def post(self, path: str, query: dict[str, str], body: Any) -> Any:
        """Return the document that answers a request that changes something; see `ask`."""
        return self._answer(path, query, b"" if body is None else msgspec.json.encode(body))

    def _answer(self, path: str, query: dict[str, str] | None, data: bytes | None) -> Any:
        if data is not None:
            sent = data or urlencode(query or {}).encode()
            self.log.sent(path.encode() + b" " + sent)
        with closing(self._open(path, query, data, REQUEST_TIMEOUT)) as response:
            text = response.read(MAX_EVENT)
        return parse_json(text, source=self.place.url) if text.strip() else None

    def states(self) -> Iterator[tuple[State4, bool]]:
        """Yield the states of the stream, and whether each is the latest, until it ends.

        Raises
        ------
        InputError : an invalid event
        """
        path = f"/matches/{self.place.match_id}/stream"
        with closing(self._open(path, None, None, STREAM_TIMEOUT)) as response:
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
        with placed(source=self.place.url):
            return checked(document, State4)

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
                reason = _detail(error.read(4096))
            raise RefusedByServerError(error.code, reason, self.place.url) from error
        except (OSError, HTTPException) as error:
            reason = error.reason if isinstance(error, URLError) else error
            if isinstance(reason, ssl.SSLError):
                raise InputError(_tls_failure(reason), source=self.place.url) from error
            raise NoAnswerError(f"no answer: {str(reason)[:120]}", source=self.place.url) from error


class NoAnswerError(InputError):
    """No answer, or the connection broke."""


class RefusedByServerError(InputError):
    """Request that the server refuses.

    Parameters
    ----------
    status : HTTP status
    detail : the server's message
    source : its address
    """

    def __init__(self, status: int, detail: str, source: str) -> None:
        meaning = {401: "user or password refused", 404: "no such match", 429: "too many requests"}
        text = meaning.get(status, "the server refuses this")
        super().__init__(f"{text} ({status}{': ' if detail else ''}{detail})", source=source)
        self.status = status


def play_on_web_server(
    place: Place4, client: Client, log: WireLog, *, on_update: Callable[[], None] = lambda: None
) -> None:
    """Play a match to its end.

    Parameters
    ----------
    place : server, match and user
    client : client of the team
    log : log of all messages
    on_update : called after each position

    Raises
    ------
    InputError : a request is refused, a state is invalid, or the server is lost
    """
    connection = Connection4(place, log)
    given = connection.ask(f"/matches/{place.match_id}")
    data = checked(given if isinstance(given, dict) else {}, MatchData, inside="match")
    player = Player4(player_name=client.name)
    team = Team4(client.name, False, player, player, player, player)
    if data.rules == RULES[1]:
        client.use_rules("dc4_server_no_tick")
    elif data.rules == RULES[2]:
        client.use_rules("dc4_server_mixed_doubles", data.arrangement)
        team = Team4(client.name, False, player, player)
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
                answer_state(connection, client, reader, state, is_latest)
                on_update()
                if client.result is not None:
                    return
            problem: InputError = NoAnswerError(
                f"the server closed the connection before the game was over ({client.place()})",
                source=place.url,
            )
        except (NoAnswerError, RefusedByServerError) as error:
            if isinstance(error, RefusedByServerError) and error.status not in RETRY_STATUSES:
                raise
            problem = error
        except (OSError, HTTPException) as error:
            problem = NoAnswerError(
                f"the stream was interrupted ({client.place()})", source=place.url
            )
            problem.__cause__ = error
        failures += 1
        if failures >= MAX_ATTEMPTS:
            raise problem
        time.sleep(RETRY_DELAY)


def answer_state(
    connection: Connection4, client: Client, reader: Reader4, state: State4, is_latest: bool
) -> None:
    """Register a state, and answer the latest if an answer is expected."""
    client.names = (state.first_team_name or "team0", state.second_team_name or "team1")
    update = reader.read(state)
    if update is None:
        return
    if not is_latest:
        client.see(update)
        return
    answer = client.answer(update)
    if state.awaits_placement:
        _ask_for_placement(connection, client, state)
    if not isinstance(answer, MoveLine):
        return
    if not isinstance(answer.move, ShotMessage):
        # Version 4 has no concession: the stone is thrown away.
        answer = MoveLine(move=client.thrown_away())
    assert isinstance(answer.move, ShotMessage)
    query = {"match_id": connection.place.match_id}
    _send(connection, "/shots", query, shot_of(answer.move))


def _ask_for_placement(connection: Connection4, client: Client, state: State4) -> None:
    """Request the placement of an end of mixed doubles, if the client decides it."""
    doubles = state.doubles
    if doubles is None or doubles.end_setup_team != TEAMS[client.team]:
        return
    request = request_of(*client.placement())
    path = f"/matches/{connection.place.match_id}/end-setup"
    _send(connection, path, {"request": request}, None)


def _send(connection: Connection4, path: str, query: dict[str, str], body: Shot4 | None) -> None:
    """Send a shot or a request, repeatedly if the server is busy or does not answer."""
    perhaps_there = False
    for number in range(MAX_ATTEMPTS):
        try:
            connection.post(path, query, body)
            return
        except NoAnswerError:
            perhaps_there = True
            if number == MAX_ATTEMPTS - 1:
                raise
        except RefusedByServerError as error:
            if perhaps_there and error.status in (400, 409):
                return  # the one before has arrived: it is not our turn any more
            if error.status not in RETRY_STATUSES or number == MAX_ATTEMPTS - 1:
                raise
        time.sleep(RETRY_DELAY)


def _tls_failure(error: ssl.SSLError) -> str:
    """Return the reason why a connection over https fails."""
    if isinstance(error, ssl.SSLCertVerificationError):
        why = error.verify_message.rstrip(".")
        return (
            f"the server's certificate is not trusted: {why[:120]}; to trust it, give "
            "--certificate FILE.pem"
        )
    if error.reason == "WRONG_VERSION_NUMBER":
        return "the server does not support https there; try http://"
    return f"no secure connection: {(error.reason or str(error)).lower().replace('_', ' ')[:120]}"


def _detail(text: bytes) -> str:
    """Return the server's message in a refusal, as one short line."""
    try:
        document = json.loads(text)
    except ValueError:
        return ""
    detail = document.get("detail", "") if isinstance(document, dict) else ""
    return " ".join(str(detail).split())[:120]
