"""A host of version 4 in a thread, and clients of it, for the tests of this folder."""

from __future__ import annotations

import asyncio
import base64
import json
import threading
from http.client import HTTPConnection
from typing import Any

import pytest

from agents.digital_curling import (
    Client,
    Hosting,
    HostSetting,
    Place4,
    PlayerSeat,
    WireLog,
    host_on_the_web,
    play_on_web_server,
    record_of,
)
from agents.playing import Match
from curling_env.game import Player, Team
from curling_env.ice import load_ice
from curling_env.infrastructure import Certificate
from tests.agents.digital_curling.host_thread import HostThread

PASSWORDS = {"anna": "correct horse", "ben": "battery staple"}
TEAM = {"use_default_config": True, "team_name": "by hand", "player1": {}, "player2": {}}


class WebHost(HostThread):
    """Host of version 4 in a separate thread."""

    def __init__(
        self, *players: Player | None, certificate: Certificate | None = None, **changes: Any
    ) -> None:
        setting = HostSetting(
            **{"ice": load_ice("fcv1"), "ends": 1, "rule_name": "dc4_server", **changes}
        )
        super().__init__(Hosting(setting))
        self.players, self.certificate = players, certificate
        self.port = 0

    @property
    def url(self) -> str:
        if self.certificate is not None:
            return f"https://localhost:{self.port}"
        return f"http://127.0.0.1:{self.port}"

    def _run(self) -> None:
        seats = [None if player is None else PlayerSeat(player) for player in self.players]
        over_http = {team for team in Team if seats[team] is None}
        asyncio.run(
            host_on_the_web(
                self.hosting,
                (seats[0], seats[1]),
                over_http,
                PASSWORDS,
                address="127.0.0.1",
                ports=(0, 0),
                http_port=0,
                own_errors=over_http,
                certificate=self.certificate,
                opened=self._opened,
            )
        )

    def _opened(self, ports: tuple[int, int], http: int) -> None:
        self.port = http
        self._open.set()

    def ask(
        self, path: str, body: Any = None, user: str | None = "anna", **query: str
    ) -> tuple[int, Any]:
        """Status and document of an answer."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=120)
        headers = {}
        if user is not None:
            password = PASSWORDS.get(user, "wrong")
            token = base64.b64encode(f"{user}:{password}".encode()).decode()
            headers["Authorization"] = f"Basic {token}"
        path += "".join(f"{'&' if k else '?'}{n}={v}" for k, (n, v) in enumerate(query.items()))
        data = body if isinstance(body, bytes | None) else json.dumps(body).encode()
        connection.request("GET" if data is None else "POST", path, data, headers)
        answer = connection.getresponse()
        text = answer.read()
        connection.close()
        try:
            return answer.status, json.loads(text)
        except ValueError:
            return answer.status, text.decode()

    @property
    def match(self) -> dict[str, str]:
        return {"match_id": self.hosting.game_id}

    def take_seat(self, user: str = "anna", team: str = "team0") -> tuple[int, Any]:
        return self.ask(
            "/store-team-config", TEAM, user, **self.match, expected_match_team_name=team
        )


class Stream:
    """A client's server-sent events."""

    def __init__(self, host: WebHost, user: str | None = "anna", what: str = "stream") -> None:
        self._connection = HTTPConnection("127.0.0.1", host.port, timeout=120)
        headers = {}
        if user is not None:
            token = base64.b64encode(f"{user}:{PASSWORDS[user]}".encode()).decode()
            headers["Authorization"] = f"Basic {token}"
        self._connection.request("GET", f"/matches/{host.hosting.game_id}/{what}", headers=headers)
        self.answer = self._connection.getresponse()

    def events(self):
        kind = ""
        while line := self.answer.readline().decode():
            name, _, value = line.rstrip("\n").partition(": ")
            if name == "event":
                kind = value
            elif name == "data":
                yield kind, json.loads(value)

    def close(self) -> None:
        self._connection.close()


def joined(host: WebHost, user: str, team: Any, player: Player, **settings: Any):
    client = Client(player, rule_name="dc4_server", **settings)
    place = Place4(
        url=host.url,
        match_id=host.hosting.game_id,
        team=team,
        user=user,
        password=PASSWORDS[user],
    )
    thread = threading.Thread(
        target=play_on_web_server, args=(place, client, WireLog()), daemon=True
    )
    thread.start()
    return client, thread


def check_same_game(host: WebHost, clients: tuple[Client, Client], match: Match) -> None:
    """The host and both of its clients have the game that `match` plays, stone by stone."""
    deliveries = list(match)
    assert host.game.game.line_score == match.game.line_score
    assert host.game.game.hammers == match.game.hammers
    assert host.game.game.power_plays == match.game.power_plays
    for shot, played in zip(host.game.shots, deliveries, strict=True):
        finish = shot["trajectory"]["finish"]
        there = {(s.team.value, s.number): (s.x, s.y + 38.405) for s in played.shot.stones_after}
        lying = {
            (team, slot): (stone["position"]["x"], stone["position"]["y"])
            for team in range(2)
            for slot, stone in enumerate(finish[f"team{team}"])
            if stone is not None
        }
        assert lying.keys() == there.keys()
        for stone, place in there.items():
            assert lying[stone] == pytest.approx(place, abs=1e-6)
    for client in clients:
        assert client.result is not None
        assert client.result.winner == host.game.result["winner"]
        assert client.game is not None
        assert client.game.line_score == match.game.line_score
        assert client.game.hammers == match.game.hammers
        assert len(client.seen) == len(deliveries)
        assert len(record_of(client, ice="fcv1")) == 2 + len(deliveries)
