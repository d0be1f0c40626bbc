"""Version 4's streams over WebSockets."""

from __future__ import annotations

import base64
import json
from contextlib import ExitStack

import pytest

pytest.importorskip("uvicorn", reason="make setup installs it")
pytest.importorskip("websockets", reason="make setup installs it")

from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from curling_env.game import DrawPlayer
from tests.agents.digital_curling.dc4.web_hosting import PASSWORDS, Stream, WebHost

RULES = "dc4_server_mixed_doubles"
SHOT = {"translational_velocity": 2.39, "shot_angle": 1.5167, "angular_velocity": -1.5708}


@pytest.fixture(autouse=True)
def no_farewell(monkeypatch):
    monkeypatch.setattr("agents.digital_curling.dc4.web_host.RESULT_SECONDS", 0.3)


@pytest.fixture
def socket():
    """Opens connections of the library's own client, and closes them."""
    with ExitStack() as connections:

        def opened(host: WebHost, team: str, user: str | None = None, match: str = ""):
            headers = {}
            if user is not None:
                token = base64.b64encode(f"{user}:{PASSWORDS.get(user, 'wrong')}".encode()).decode()
                headers["Authorization"] = f"Basic {token}"
            query = f"match={match or host.hosting.game_id}&team={team}"
            url = f"ws://127.0.0.1:{host.port}/ws?{query}"
            return connections.enter_context(connect(url, additional_headers=headers))

        yield opened


def received(connection: ClientConnection):
    """Return the messages until the host closes the connection."""
    try:
        while True:
            yield json.loads(connection.recv(timeout=120))
    except ConnectionClosed:
        return


def test_a_game_over_websockets_has_the_same_events_as_server_sent_events(socket):
    with WebHost(None, DrawPlayer(), rule_name=RULES, ends=1) as host:
        host.take_seat()
        # Its stream is what makes the team ready, as the stream of events does.
        player = socket(host, "team0", "anna")
        watching = socket(host, "viewer")
        events = Stream(host, None, "viewer")
        watching.send("hello")  # ignored
        seen = []
        for message in received(player):
            seen.append(message)
            if message["payload"]["next_shot_team"] == "team0":
                assert host.ask("/shots", SHOT, **host.match) == (200, None)
        assert [state for _, state in events.events()] == [m["payload"] for m in seen]
        assert [m["payload"] for m in received(watching)] == [m["payload"] for m in seen]
        events.close()
    assert {message["type"] for message in seen} == {"latest_state_update"}
    totals = [message["payload"]["total_shot_number"] for message in seen]
    assert totals == [None, *range(10), None]
    assert seen[-1]["payload"]["winner_team"] == host.game.result["winner"]


def test_unauthorised_listeners_are_refused_before_the_connection(socket):
    with WebHost(None, DrawPlayer(), thinking_time=0.5) as host:
        host.take_seat()
        for team, user, match, status in [
            ("team0", None, "", 401),
            ("team0", "eve", "", 401),
            ("team1", "anna", "", 401),
            ("team0", "ben", "", 401),
            ("viewer", None, "x", 404),
        ]:
            with pytest.raises(InvalidStatus) as refused:
                socket(host, team, user, match)
            assert refused.value.response.status_code == status
        assert host.ask("/ws", match=host.hosting.game_id)[0] == 426
        player = socket(host, "team0", "anna")
        player.send("x" * 70_000)  # too long: the host hangs up
        assert len(list(received(player))) <= 1
        last = list(received(socket(host, "team0", "anna")))[-1]
        assert last["payload"]["winner_team"] == "team1"
