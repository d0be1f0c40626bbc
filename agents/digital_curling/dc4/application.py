"""HTTP application of a host: Digital Curling 4's requests, and a page for spectators."""

from __future__ import annotations

import asyncio
import base64
import binascii
import hashlib
import hmac
import json
import time
from collections import deque
from collections.abc import AsyncIterator, Mapping
from contextlib import aclosing
from typing import Any, TypeVar

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from agents.digital_curling.dc4.match import Match4, RefusedError
from agents.digital_curling.dc4.messages import MODES, REQUEST_NAMES, Shot4, Team4
from agents.digital_curling.messages import TEAMS
from agents.playing.replay.page import live_policy, page_of
from curling_env.errors import InputError
from curling_env.game.rules import Team
from curling_env.infrastructure.files.reading import parse_json
from curling_env.infrastructure.files.schema import checked
from curling_env.units import Units

MAX_BODY = 64 * 1024
"""Maximum size of a request [bytes]."""
REQUESTS, PERIOD = 30, 60.0
"""Maximum number of requests of a user, or failed ones of an address, in a period [s] per path."""
LIVE = "game.json"

Form = TypeVar("Form")


class RateLimit:
    """Counter of requests by user and path.

    Parameters
    ----------
    most : maximum number of requests in a period
    period : length of a period [s]
    """

    def __init__(self, most: int = REQUESTS, period: float = PERIOD) -> None:
        self.most, self.period = most, period
        self._times: dict[tuple[str, str], deque[float]] = {}

    def take(self, who: str, path: str) -> None:
        """Count a request.

        Raises
        ------
        RefusedError : too many
        """
        now = time.monotonic()
        if len(self._times) > 1000:  # of many strangers, old ones are forgotten
            recent = {k: t for k, t in self._times.items() if t and t[-1] > now - self.period}
            self._times = recent
        times = self._times.setdefault((who, path), deque())
        while times and times[0] <= now - self.period:
            times.popleft()
        if len(times) >= self.most:
            raise RefusedError(429, "Too many requests.")
        times.append(now)


class Credentials:
    """Users and passwords, compared in constant time.

    Parameters
    ----------
    passwords : passwords by user
    """

    def __init__(self, passwords: Mapping[str, str]) -> None:
        self._digests = {
            user: _digest(f"{user}:{password}") for user, password in passwords.items()
        }

    def user(self, header: str) -> str | None:
        """Return the user of an ``Authorization`` header; None if unknown."""
        scheme, _, encoded = header.partition(" ")
        try:
            given = base64.b64decode(encoded, validate=True).decode("utf-8")
        except (binascii.Error, UnicodeDecodeError, ValueError):
            given = ""
        digest, found = _digest(given), None
        for user, known in self._digests.items():
            if hmac.compare_digest(digest, known):
                found = user
        return found if scheme.lower() == "basic" else None


def _digest(text: str) -> bytes:
    return hashlib.sha256(text.encode()).digest()


def application(
    match: Match4, passwords: Mapping[str, str], *, units: Units = Units.METRES
) -> Starlette:
    """Make the application of a host.

    Parameters
    ----------
    match : the hosted game
    passwords : passwords by user
    units : units of lengths on the page
    """
    answers = _Answers(match, Credentials(passwords), units)
    one = "/matches/{match_id}"
    routes = [
        Route("/", answers.page),
        Route(f"/{LIVE}", answers.lines),
        Route("/favicon.ico", answers.icon),
        WebSocketRoute("/ws", answers.socket),
        Route("/ws", answers.no_socket),
        Route("/matches", answers.make_match, methods=["POST"]),
        Route("/store-team-config", answers.take_seat, methods=["POST"]),
        Route("/shots", answers.shoot, methods=["POST"]),
        Route(f"{one}/end-setup", answers.set_up_end, methods=["POST"]),
        Route(one, answers.match_data),
        Route(f"{one}/latest-state", answers.latest_state),
        Route(f"{one}/score", answers.score),
        Route(f"{one}/stream", answers.stream),
        Route(f"{one}/viewer", answers.viewer),
    ]
    return Starlette(
        routes=routes, exception_handlers={RefusedError: _refuse, InputError: _refuse_input}
    )


class _Answers:
    def __init__(self, match: Match4, credentials: Credentials, units: Units) -> None:
        self.match, self.credentials, self.units = match, credentials, units
        self.limit, self.failures = RateLimit(), RateLimit()

    # --- those who play ---------------------------------------------------------------------------

    async def make_match(self, request: Request) -> Response:
        """Answer with the hosted match, by the host's setting."""
        self._user(request, limited=True)
        await _document(request, dict[str, Any])
        return JSONResponse(self.match.hosting.game_id)

    async def take_seat(self, request: Request) -> Response:
        user = self._user(request, limited=True)
        self._check_match(request.query_params.get("match_id", ""))
        wanted = request.query_params.get("expected_match_team_name", "")
        if wanted not in TEAMS:
            raise RefusedError(422, "expected_match_team_name must be team0 or team1.")
        team = await _document(request, Team4)
        return JSONResponse(TEAMS[self.match.take_seat(user, Team(TEAMS.index(wanted)), team)])

    async def shoot(self, request: Request) -> Response:
        user = self._user(request, limited=True)
        self._check_match(request.query_params.get("match_id", ""))
        await self.match.shoot(user, await _document(request, Shot4))
        return JSONResponse(None)

    async def set_up_end(self, request: Request) -> Response:
        user = self._user(request, limited=True)
        self._check_match(request.path_params["match_id"])
        asked = request.query_params.get("request", "")
        for wish in REQUEST_NAMES:
            if wish == asked:
                await self.match.set_up_end(user, wish)
                return JSONResponse(None)
        raise RefusedError(422, f"request must be one of {', '.join(REQUEST_NAMES)}.")

    async def stream(self, request: Request) -> Response:
        user = self._user(request, limited=True)
        self._check_match(request.path_params["match_id"])
        if user not in self.match.users:
            raise RefusedError(401, "This user is in no team of this match.")
        return _events(self.match, self.match.users[user])

    async def socket(self, connection: WebSocket) -> None:
        """Serve the stream over a WebSocket, of a team with its password or for spectators."""
        try:
            team = self._team_of(connection)
        except RefusedError as error:
            await connection.send_denial_response(await _refuse(connection, error))
            return
        await connection.accept()
        tasks = [
            asyncio.create_task(_send_events(connection, self.match, team)),
            asyncio.create_task(_until_gone(connection)),
        ]
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in tasks:
            task.cancel()
        # A client may leave in the middle of a message.
        await asyncio.gather(*tasks, return_exceptions=True)

    async def no_socket(self, request: Request) -> Response:
        """Refuse an ordinary request on a WebSocket path."""
        raise RefusedError(426, "Expected a WebSocket.")

    def _team_of(self, connection: WebSocket) -> Team | None:
        """Return the team whose stream a connection may have; None for a spectator.

        Raises
        ------
        RefusedError : another match, or a team that is not the user's
        """
        self._check_match(connection.query_params.get("match", ""))
        asked = connection.query_params.get("team", "viewer")
        if asked == "viewer":
            self.limit.take(_address(connection), "viewer")
            return None
        user = self._user(connection, limited=True)
        team = self.match.users.get(user)
        if team is None or asked != TEAMS[team]:
            raise RefusedError(401, "This user does not play for that team.")
        return team

    # --- those who watch --------------------------------------------------------------------------

    async def viewer(self, request: Request) -> Response:
        self._check_match(request.path_params["match_id"])
        self.limit.take(_address(request), "viewer")
        return _events(self.match, None)

    async def match_data(self, request: Request) -> Response:
        self._check_match(request.path_params["match_id"])
        setting, teams = self.match.hosting.setting, self.match.teams
        names = [teams[team].team_name if team in teams else None for team in Team]
        if self.match.game is not None:
            names = list(self.match.game.names)
        return JSONResponse(
            {
                "match_id": self.match.hosting.game_id,
                "game_mode": MODES[0] if setting.is_doubles else "standard",
                "applied_rule": 2 if setting.is_doubles else int(setting.rules.no_tick),
                "mixed_doubles_settings": {"positioned_stones_pattern": setting.arrangement}
                if setting.is_doubles
                else None,
                "standard_end_count": setting.ends,
                "time_limit": setting.thinking_time,
                "extra_end_time_limit": setting.extra_time,
                "first_team_name": names[0],
                "second_team_name": names[1],
                "created_at": self.match.hosting.date_time,
            }
        )

    async def latest_state(self, request: Request) -> Response:
        return JSONResponse(self._latest(request))

    async def score(self, request: Request) -> Response:
        return JSONResponse(self._latest(request)["score"])

    async def page(self, request: Request) -> Response:
        game = self.match.game
        if game is None:
            return HTMLResponse(WAITING, headers=_headers("default-src 'none'"))
        page = page_of(game.record(), self.units, live=LIVE)
        return HTMLResponse(page, headers=_headers(live_policy(self.units, LIVE)))

    async def icon(self, request: Request) -> Response:
        """Return no icon for the tab; browsers request one by themselves."""
        return Response(status_code=204)

    async def lines(self, request: Request) -> Response:
        """Return the deliveries after those that a page has, and the result."""
        game, after = self.match.game, request.query_params.get("after", "0")
        if game is None or not (after.isascii() and after.isdecimal()):
            raise RefusedError(404, "There is no such delivery.")
        document = {"lines": game.lines_after(int(after[:6])), "result": game.record()[-1]}
        return JSONResponse(document, headers=_headers("default-src 'none'"))

    # --- checks -----------------------------------------------------------------------------------

    def _latest(self, request: Request) -> dict[str, Any]:
        self._check_match(request.path_params["match_id"])
        if self.match.latest is None:
            raise RefusedError(404, "The match has not started.")
        return self.match.latest

    def _check_match(self, match_id: str) -> None:
        if match_id != self.match.hosting.game_id:
            raise RefusedError(404, "There is no such match.")

    def _user(self, request: HTTPConnection, *, limited: bool) -> str:
        user = self.credentials.user(request.headers.get("Authorization", ""))
        if user is None:
            self.failures.take(_address(request), "password")
            raise RefusedError(401, "Wrong user or password.")
        if limited:
            self.limit.take(user, request.scope["path"])
        return user


def _address(request: HTTPConnection) -> str:
    return "" if request.client is None else request.client.host


async def _document(request: Request, form: type[Form]) -> Form:
    """Read the body of a request.

    Raises
    ------
    RefusedError : the body is too long
    InputError : the body has another form
    """
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > MAX_BODY:
            raise RefusedError(413, f"The request is too long; expected at most {MAX_BODY} bytes.")
    return checked(parse_json(body, source=""), form)


def _events(match: Match4, team: Team | None) -> Response:
    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    events = _server_sent(match, team)
    return StreamingResponse(events, media_type="text/event-stream", headers=headers)


async def _server_sent(match: Match4, team: Team | None) -> AsyncIterator[str]:
    """Yield the events of a stream as text; a comment keeps it open while nothing happens."""
    async with aclosing(match.events(team)) as events:
        async for event in events:
            if event is None:
                yield ": ping\n\n"
            else:
                yield f"event: {event[0]}\ndata: {json.dumps(event[1])}\n\n"


async def _send_events(connection: WebSocket, match: Match4, team: Team | None) -> None:
    """Send the events of a stream over a WebSocket, which keeps itself open, and close it."""
    async with aclosing(match.events(team)) as events:
        async for event in events:
            if event is not None:
                await connection.send_json({"type": event[0], "payload": event[1]})
    await connection.close()


def _headers(policy: str) -> dict[str, str]:
    return {
        "Cache-Control": "no-store",
        "Content-Security-Policy": f"{policy}; frame-ancestors 'none'",
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
    }


async def _until_gone(connection: WebSocket) -> None:
    """Wait until a client leaves, and ignore its messages."""
    while (await connection.receive())["type"] != "websocket.disconnect":
        pass


async def _refuse(request: HTTPConnection, error: Exception) -> Response:
    status = error.status if isinstance(error, RefusedError) else 400
    headers = {"WWW-Authenticate": 'Basic realm="curling"'} if status == 401 else None
    return JSONResponse({"detail": str(error)}, status_code=status, headers=headers)


async def _refuse_input(request: Request, error: Exception) -> Response:
    return JSONResponse({"detail": str(error)}, status_code=422)


WAITING = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta http-equiv="refresh" content="2">
<title>Curling</title></head>
<body><p>The game starts when both teams are connected.</p></body></html>
"""
