"""Joining a server: recorded conversations, replayed by a fake server in this process."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from agents.digital_curling import (
    Client,
    ConcedeMessage,
    ShotMessage,
    WireLog,
    address_of,
    from_server,
    play_on_server,
    record_of,
)
from agents.playing import read_record
from curling_env.errors import InputError
from curling_env.game import DrawPlayer, RuleBasedPlayer, Team
from curling_env.sheet import HACK_Y

WIRE = Path(__file__).parent / "wire"


def golden(name: str) -> list[tuple[str, dict[str, Any]]]:
    """A recorded conversation: (``<`` or ``>``, message)."""
    lines = (WIRE / f"{name}.jsonl").read_text().splitlines()
    return [(line[0], json.loads(line[2:])) for line in lines]


def messages_of(log: list[tuple[str, dict[str, Any]]]) -> list[dict[str, Any]]:
    """Return the server's lines of a conversation."""
    return [message for way, message in log if way == "<"]


def in_turn(connection: socket.socket, messages: list[tuple[str, dict[str, Any]]]) -> None:
    """Send each line, and wait for an answer where the recorded client sent one."""
    stream = connection.makefile("rb")
    for way, message in messages:
        if way == "<":
            connection.sendall(json.dumps(message).encode() + b"\n")
        else:
            stream.readline()


class FakeServer:
    """Server that accepts one connection, handles it, and closes it.

    Parameters
    ----------
    act : what is done with the connection
    """

    def __init__(self, act: Callable[[socket.socket], None]) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(120)
        self.port = int(self._listener.getsockname()[1])
        self.reported = b""
        self._act = act
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> FakeServer:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._thread.join(30)
        self._listener.close()

    def _serve(self) -> None:
        connection, _ = self._listener.accept()
        with connection:
            connection.settimeout(120)
            try:
                self._act(connection)
            except OSError:  # the client has had enough
                return
            connection.shutdown(socket.SHUT_WR)
            # What the client has still to say is heard, so that nothing is reset under it.
            while data := connection.recv(65536):
                self.reported += data


GAMES = ["extra-end-team1", "extra-end-team0"]


def line_of(message) -> bytes:
    return json.dumps(message).encode() + b"\n"


def answers(messages, player=None, **settings) -> tuple[Client, list]:
    """Return a client's answers to each message."""
    client = Client(player or RuleBasedPlayer(), **settings)
    return client, [client.answer(from_server(line_of(message))) for message in messages]


# --- whole games ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", GAMES)
def test_a_recorded_game_is_played_to_its_end(name, curling, tmp_path):
    log = golden(name)
    with FakeServer(lambda connection: in_turn(connection, log)) as server:
        out = curling("join", f"127.0.0.1:{server.port}", "--player", "rulebased", "-o", tmp_path)
    assert out.status == 0, out.err
    final = messages_of(log)[-2]["state"]
    result = out.json()
    assert result["team"] == name[-5:]
    assert (result["winner"], result["reason"]) == (final["game_result"]["winner"], "score")
    extra = final["extra_end_score"]
    assert result["line_score"] == [[0, 0], [extra["team0"], extra["team1"]]]
    assert result["stones"] == 32
    # The conversation is kept line by line, and the client's part of it has the protocol's form.
    wire = [line.split(" ", 1) for line in (tmp_path / "wire.jsonl").read_text().splitlines()]
    assert [way for way, _ in wire] == [way for way, _ in log]
    assert [json.loads(text) for way, text in wire if way == "<"] == messages_of(log)
    own = [json.loads(text) for way, text in wire if way == ">"]
    assert [message["cmd"] for message in own] == ["dc_ok", "ready_ok", *["move"] * 16]
    for message in own[2:]:
        assert message["move"]["rotation"] in ("cw", "ccw")
        velocity = message["move"]["velocity"]
        assert 2.0 < velocity["y"] <= 4.0
        assert abs(velocity["x"]) < 0.5
    check_record(read_record(tmp_path / "game.jsonl"), log)
    assert "golden" in (tmp_path / "game.html").read_text()


def check_record(lines, log) -> None:
    """Check that every stone of the record is at the server's place, and every path begins at the
    hack.
    """
    updates = [message for message in messages_of(log) if message["cmd"] == "update"]
    assert lines[0]["rules"] == "digital_curling"
    assert lines[0]["last_stone"] == "away"
    assert len(lines) == 2 + 32
    for k, line in enumerate(lines[1:-1]):
        state, direction = updates[k + 1]["state"], 1 if line["direction"] == "away" else -1
        assert (line["end"], line["stone"]) == (k // 16 + 1, k % 16 + 1)
        before = {stone["stone"] for stone in line["before"]}
        (thrown,) = [path for path in line["paths"] if path["stone"] not in before]
        assert direction * thrown["y"][0] == pytest.approx(-HACK_Y, abs=1e-3)
        actual = updates[k + 1]["last_move"]["actual_move"]["velocity"]
        if actual["y"] > 1:
            assert line["thrown"]["speed"] == pytest.approx(
                (actual["x"] ** 2 + actual["y"] ** 2) ** 0.5
            )
        if k % 16 < 15:
            reported = {
                8 * team + slot: (stone["position"]["x"], stone["position"]["y"] - 38.405)
                for team, key in enumerate(("team0", "team1"))
                for slot, stone in enumerate(state["stones"][key])
                if stone is not None
            }
            lying = {
                stone["stone"]: (direction * stone["x"], direction * stone["y"] - 17.3735)
                for stone in line["lying"]
            }
            assert lying.keys() == reported.keys()
            for stone, place in reported.items():
                assert lying[stone] == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("size", [1, 7, 100_000_000])
def test_lines_may_be_split_and_joined(size):
    log = golden("extra-end-team0")
    wire = b"".join(line_of(message) for message in messages_of(log))

    def all_at_once(connection: socket.socket) -> None:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for k in range(0, len(wire), size):
            connection.sendall(wire[k : k + size])

    client = Client(DrawPlayer())
    with FakeServer(all_at_once) as server:
        play_on_server("127.0.0.1", server.port, client, WireLog())
    assert client.result is not None
    assert client.result.winner == "team1"
    assert server.reported.count(b"\n") == 18
    assert client.is_over


def test_the_same_seed_makes_the_same_moves():
    log = messages_of(golden("extra-end-team1"))[:9]
    from agents.playing import SearchPlayer

    def moves(seed: int) -> list[str]:
        return [str(answer) for answer in answers(log, SearchPlayer(200), seed=seed)[1]]

    assert moves(3) == moves(3)
    assert moves(3) != moves(4)


# --- what a server may say ------------------------------------------------------------------------


def test_a_client_moves_only_at_its_own_turn():
    log = golden("extra-end-team1")
    _, replies = answers(messages_of(log), DrawPlayer())
    moved = [reply is not None for reply in replies]
    recorded = [
        k + 1 < len(log) and log[k + 1][0] == ">" for k, (way, _) in enumerate(log) if way == "<"
    ]
    assert moved == recorded


@pytest.mark.parametrize("undisclosed", [None, False, "missing"])
def test_undisclosed_fields_have_the_servers_defaults(undisclosed):
    log = deepcopy(messages_of(golden("extra-end-team1"))[:5])
    for name in ("setting", "simulator", "players"):
        if undisclosed == "missing":
            del log[1]["game"][name]
        else:
            log[1]["game"][name] = undisclosed
    client, replies = answers(log, DrawPlayer())
    assert client.rules.ends == 1  # as many as the score has
    assert client.rules.free_guard_until == 5
    assert isinstance(replies[4].move, ShotMessage)


def test_unknown_fields_are_let_through():
    log = deepcopy(messages_of(golden("extra-end-team1"))[:7])
    for message in log:
        message["new_in_1_1"] = {"deep": [1, None]}
    log[1]["game"]["setting"]["weather"] = "snow"
    log[6]["state"]["stones"]["team0"][1]["owner"] = "x"
    log[6]["last_move"]["trajectory"] = {"frames": [[{"team": "team0"}]], "seconds_per_frame": 0.1}
    _, replies = answers(log, DrawPlayer())
    assert isinstance(replies[6].move, ShotMessage)


def test_four_rocks_are_four():
    log = deepcopy(messages_of(golden("extra-end-team1"))[:2])
    log[1]["game"]["setting"]["five_rock_rule"] = False
    assert answers(log, DrawPlayer())[0].rules.free_guard_until == 4


@pytest.mark.parametrize("reason", ["concede", "time_limit"])
def test_a_game_that_is_given_up_is_over(reason):
    log = deepcopy(messages_of(golden("extra-end-team1"))[:6])
    last = deepcopy(log[-1])
    last["next_team"] = None
    last["last_move"] = {"actual_move": {"type": "concede"}, "free_guard_zone_foul": False}
    last["state"] |= {"hammer": None, "game_result": {"winner": "team1", "reason": reason}}
    client, replies = answers([*log, last, {"cmd": "game_over"}], DrawPlayer())
    assert replies[-2:] == [None, None]
    assert client.is_over
    lines = record_of(client, ice="fcv1")
    assert len(lines) == 2 + 2  # what was thrown, and no line for what was given up
    assert (lines[-1]["winner"], lines[-1]["reason"]) == ("away", reason)
    assert client.game is not None
    assert client.game.conceded is Team.HOME


def test_a_player_may_concede():
    class Modest(DrawPlayer):
        def concedes(self, view):
            return view.game.end.delivered == 3

    log = messages_of(golden("extra-end-team1"))
    _, replies = answers(log[:9], Modest())
    moves = [reply.move for reply in replies[3:] if reply is not None]
    assert [type(move) for move in moves] == [ShotMessage, ConcedeMessage, ShotMessage]


def test_a_stone_thrown_backwards_is_a_stone_that_is_removed():
    log = golden("extra-end-team1")
    updates = [message for message in messages_of(log) if message["cmd"] == "update"]
    back = [
        k
        for k, message in enumerate(updates[1:], start=1)
        if message["last_move"]["actual_move"]["velocity"]["y"] < 0
    ]
    assert back == [7]
    client, _ = answers(messages_of(log), DrawPlayer())
    line = record_of(client, ice="fcv1")[7]
    assert line["lying"] == line["before"]
    assert line["thrown"]["speed"] == pytest.approx(0.0071, abs=1e-3)
    assert max(abs(y) for y in line["paths"][-1]["y"]) == pytest.approx(HACK_Y, abs=1e-2)


def test_another_physics_is_remarked_on():
    log = deepcopy(messages_of(golden("extra-end-team1"))[:2])
    log[1]["game"]["simulator"] = {"type": "fcv2"}
    remarks: list[str] = []
    answers(log, DrawPlayer(), remark=remarks.append)
    assert "'fcv2'" in remarks[0]


# --- breaks of the protocol -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (b"hello\n", "line 1, row 1, column 1: not JSON"),
        (b"[1]\n", "expected a JSON object"),
        (b"\xff\xfe\n", "UTF-8"),
        (b'{"cmd":"dance"}\n', "dance"),
        (b"{}\n", "cmd"),
        (b'{"cmd":"dc","version":{"major":2,"minor":0}}\n', "version 2"),
        (b'{"cmd":"is_ready","team":"team7"}\n', "team7"),
        (b'{"cmd":"is_ready","team":"team0","game":{"rule":"mixed"}}\n', "'mixed'"),
        (b"[" * 100_000 + b"\n", "nested"),
        (b"x" * (8 * 2**20 + 2), "too long"),
    ],
)
def test_a_break_of_the_protocol_is_one_line(line, says, curling, tmp_path):
    with FakeServer(lambda connection: connection.sendall(line)) as server:
        where = f"127.0.0.1:{server.port}"
        out = curling("join", where, "--player", "draw", "-o", tmp_path / "log")
    assert out.complaint.startswith(where)
    assert says in out.complaint


def test_an_update_before_the_game_is_a_break_of_the_protocol():
    with pytest.raises(InputError, match="before is_ready"):
        answers(messages_of(golden("extra-end-team1"))[3:4])


def test_a_server_that_hangs_up_ends_the_game_and_the_log_stays(curling, tmp_path):
    log = golden("extra-end-team1")[:15]
    with FakeServer(lambda connection: in_turn(connection, log)) as server:
        out = curling("join", f"127.0.0.1:{server.port}", "--player", "draw", "-o", tmp_path)
    assert (
        "the server closed the connection before the game was over (end 1, stone 7)"
        in out.complaint
    )
    lines = read_record(tmp_path / "game.jsonl")
    assert len(lines) == 2 + 6
    assert lines[-1]["winner"] is None
    page = curling("replay", tmp_path / "game.jsonl", "-o", tmp_path / "again.html")
    assert page.status == 0
    assert (tmp_path / "wire.jsonl").read_text().count("\n") == 15


def test_a_line_that_breaks_off_is_no_line(curling):
    half = line_of(messages_of(golden("extra-end-team1"))[0])[:40]
    with FakeServer(lambda connection: connection.sendall(half)) as server:
        out = curling("join", f"127.0.0.1:{server.port}", "--player", "draw")
    assert (
        "closed the connection before the game was over (before the first stone)" in out.complaint
    )


def test_a_missing_server_is_reported(curling):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    assert "no server answers" in curling("join", f"127.0.0.1:{port}").complaint


@pytest.mark.parametrize("text", ["", "host", "host:", ":1", "a:0", "a:65536", "a:1e3", "::1:5"])
def test_invalid_addresses_are_refused(text, curling):
    assert "HOST:PORT" in curling("join", "--", text).complaint


def test_addresses():
    assert address_of("dc.example.org:10000") == ("dc.example.org", 10000)
    assert address_of("[::1]:10001") == ("::1", 10001)
