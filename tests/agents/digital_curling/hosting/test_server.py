"""Hosting: our client against our host, strange clients, clocks, and the logs."""

from __future__ import annotations

import asyncio
import json
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.digital_curling import (
    MAX_BAD_LINES,
    Client,
    Hosting,
    HostSetting,
    PlayerSeat,
    WireLog,
    host_game,
    play_on_server,
)
from agents.playing import Match, SearchPlayer, read_record
from curling_env.game import DrawPlayer, GameSimulator, Player, RuleBasedPlayer, Team, rule_set
from curling_env.ice import load_ice
from curling_env.throw import FROM_HACK
from tests.agents.digital_curling.host_thread import HostThread

SHOT = {
    "cmd": "move",
    "move": {"type": "shot", "velocity": {"x": 0.13, "y": 2.39}, "rotation": "ccw"},
}


def setting(**changes: Any) -> HostSetting:
    return HostSetting(**{"ice": load_ice("fcv1"), "ends": 1, **changes})


class Host(HostThread):
    """Host in a separate thread; clients are in the others.

    Parameters
    ----------
    players : players of this project; None for a client
    changes : of the setting
    """

    def __init__(self, *players: Player | None, **changes: Any) -> None:
        self.remarks: list[str] = []
        super().__init__(Hosting(setting(**changes), remark=self.remarks.append))
        self._seats = tuple(None if player is None else PlayerSeat(player) for player in players)
        self.ports = (0, 0)

    def _run(self) -> None:
        asyncio.run(host_game(self.hosting, self._seats, ports=(0, 0), opened=self._opened))

    def _opened(self, ports: tuple[int, int]) -> None:
        self.ports = ports
        self._open.set()


class Wire:
    """Client by hand."""

    def __init__(self, port: int, *, ready: bool = True) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=120)
        self.stream = self.socket.makefile("rb")
        if ready:
            assert self.hear()["cmd"] == "dc"
            self.say({"cmd": "dc_ok", "name": "by hand"})
            assert self.hear()["cmd"] == "is_ready"
            self.say({"cmd": "ready_ok", "player_order": [0, 1, 2, 3]})

    def __enter__(self) -> Wire:
        return self

    def __exit__(self, *error: object) -> None:
        self.stream.close()
        self.socket.close()

    def say(self, message: Any) -> None:
        raw = message if isinstance(message, bytes) else json.dumps(message).encode() + b"\n"
        self.socket.sendall(raw)

    def hear(self) -> dict[str, Any]:
        line = self.stream.readline()
        return json.loads(line) if line else {"cmd": "gone"}

    def until(self, cmd: str, **wanted: Any) -> dict[str, Any]:
        """Return the next message of that kind with these fields."""
        while True:
            message = self.hear()
            assert cmd == "gone" or message["cmd"] != "gone", "the host hung up"
            if message["cmd"] == cmd and wanted.items() <= message.items():
                return message


def joined(port: int, player: Player, **settings: Any) -> tuple[Client, threading.Thread]:
    client = Client(player, **settings)
    thread = threading.Thread(
        target=play_on_server, args=("127.0.0.1", port, client, WireLog()), daemon=True
    )
    thread.start()
    return client, thread


def played_here(players, *, ends: int, seed: int, ice="fcv1"):
    """Play the game as `curling play` does: the match itself, without any network."""
    simulator = GameSimulator(
        ice,
        rules=rule_set("digital_curling", ends=ends),
        skills="digital-curling",
        delivery=FROM_HACK,
    )
    match = Match(simulator, players, seed=seed, last_stone=Team.AWAY, paths=True)
    return list(match), match.game


def check_same(record: list[dict[str, Any]], deliveries, game) -> None:
    assert record[-1]["line_score"] == [list(end) for end in game.line_score]
    assert len(record) - 2 == len(deliveries)
    for line, played in zip(record[1:-1], deliveries, strict=True):
        assert line["thrown"]["speed"] == pytest.approx(played.shot.thrown.speed, abs=1e-9)
        direction = played.shot.direction
        there = [(s.stone, s.x, s.y) for s in played.shot.stones_after]
        lying = [
            (s["stone"], direction * s["x"], direction * s["y"] - 17.3735) for s in line["lying"]
        ]
        assert [s[0] for s in lying] == [s[0] for s in there]
        for mine, theirs in zip(lying, there, strict=True):
            assert mine[1:] == pytest.approx(theirs[1:], abs=1e-6)


# --- the same game as without any wire ------------------------------------------------------------


@pytest.mark.parametrize("ice", ["fcv1", "standard"])
def test_two_clients_play_the_game_that_curling_play_plays(ice):
    with Host(None, None, ice=load_ice(ice), ends=2, seed=5) as host:
        known = load_ice(ice)
        home, one = joined(host.ports[0], RuleBasedPlayer(), seed=5, ice=known)
        away, two = joined(host.ports[1], RuleBasedPlayer(), seed=5, ice=known)
        one.join(60)
        two.join(60)
    players = (RuleBasedPlayer(), RuleBasedPlayer())
    check_same(host.game.record(), *played_here(players, ends=2, seed=5, ice=ice))
    assert home.result == away.result
    assert home.result is not None
    assert home.is_over
    assert away.is_over


def test_a_search_that_joins_plays_as_it_does_here():
    with Host(drawing := DrawPlayer(), None, seed=2) as host:
        _, thread = joined(host.ports[1], SearchPlayer(150), seed=2)
        thread.join(60)
    assert drawing.name == host.game.names[0]
    check_same(host.game.record(), *played_here((DrawPlayer(), SearchPlayer(150)), ends=1, seed=2))


def test_join_and_host_are_two_commands(tmp_path):
    """Two processes: the host prints its port on stderr, and the client connects to it."""
    curling = [sys.executable, "-m", "curling_env.commands.cli"]
    words = ["host", "--team0", "draw", "--port", "0", "--ends", "1", "--seed", "3"]
    host = subprocess.Popen(
        [*curling, *words, "--json", "-o", str(tmp_path / "host")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert host.stderr is not None
        where = host.stderr.readline().split()[-1]
        options = ["--player", "rulebased", "--seed", "3", "-o", str(tmp_path / "client")]
        client = subprocess.run(
            [*curling, "join", where, *options], capture_output=True, text=True, timeout=120
        )
        out, _ = host.communicate(timeout=60)
    finally:
        host.kill()
    assert (client.returncode, host.returncode) == (0, 0), client.stderr
    theirs, ours = json.loads(client.stdout), json.loads(out)
    for name in ("team0", "team1", "score", "winner", "reason", "game_id", "stones"):
        assert theirs[name] == ours[name]
    deliveries, game = played_here((DrawPlayer(), RuleBasedPlayer()), ends=1, seed=3)
    check_same(read_record(tmp_path / "host" / "game.jsonl"), deliveries, game)
    check_logs(tmp_path / "host", deliveries)
    # What the client saw of the game is what the host has played.
    seen = read_record(tmp_path / "client" / "game.jsonl")
    for mine, hosted in zip(
        seen[1:-2], read_record(tmp_path / "host" / "game.jsonl")[1:-2], strict=True
    ):
        for a, b in zip(mine["lying"], hosted["lying"], strict=True):
            assert (a["x"], a["y"]) == pytest.approx((b["x"], b["y"]), abs=1e-9)


def check_logs(folder: Path, deliveries) -> None:
    """Check that the logs have the fields that Digital Curling's viewers read."""
    entries = [json.loads(line) for line in (folder / "game.dcl2").read_text().splitlines()]
    assert {entry["tag"] for entry in entries} == {"gam"}
    assert [entry["id"] for entry in entries] == list(range(len(entries)))
    messages = [entry["log"] for entry in entries]
    begin = ["dc", "meta", "dc_ok", "dc_ok", "is_ready", "ready_ok", "ready_ok", "new_game"]
    kinds = [message["cmd"] for message in messages]
    assert kinds == [*begin, "update", *["move", "update"] * len(deliveries), "game_over"]
    assert messages[4]["game"]["rule"] == "normal"
    assert messages[4]["game"]["setting"]["max_end"] == 1
    updates = [message for message in messages if message["cmd"] == "update"]
    for k, played in enumerate(deliveries):
        shot = json.loads((folder / f"shot_e000s{k:02}.json").read_text())
        assert shot["tag"] == "sht"
        log = shot["log"]
        assert (log["end"], log["shot"]) == (0, k)
        assert log["actual_move"] == updates[k + 1]["last_move"]["actual_move"]
        check_trajectory(log["trajectory"], played, updates[k]["state"], updates[k + 1]["state"])


def check_trajectory(trajectory, played, before, after) -> None:
    """Check that a path begins at the hack and ends at the stones' places."""
    team, slot = f"team{played.shot.team.value}", played.shot.number // 2
    thrown = trajectory["start"][team][slot]
    assert thrown["position"] == pytest.approx({"x": 0.0, "y": 0.0}, abs=1e-9)
    others = json.loads(json.dumps(trajectory["start"]))
    others[team][slot] = None
    assert others == before["stones"]
    if after["shot"]:
        assert trajectory["finish"] == after["stones"]
    last = trajectory["frames"][-1]
    assert trajectory["seconds_per_frame"] * len(trajectory["frames"]) >= played.shot.outcome.time
    for change in last:
        lying = trajectory["finish"][change["team"]][change["index"]]
        if lying is not None and played.shot.ruling.fault is None:
            assert change["value"]["position"] == pytest.approx(lying["position"], abs=1e-6)


# --- strange clients ------------------------------------------------------------------------------


def play_on(wire: Wire, team: str) -> dict[str, Any]:
    """Play the same draw until the game is over; the last position."""
    last: dict[str, Any] = {}
    while (message := wire.hear())["cmd"] not in ("game_over", "gone"):
        last = message
        if message.get("next_team") == team:
            wire.say(SHOT)
    return last


def test_bad_lines_are_dropped_and_the_game_continues():
    with Host(None, DrawPlayer()) as host, Wire(host.ports[0]) as wire:
        wire.until("update", next_team="team0")
        for line in (
            b"hello\n",
            b"[]\n",
            b'{"cmd":"move"}\n',
            b"\xff\n",
            b'{"cmd":"dc_ok","name":"x"}\n',
        ):
            wire.say(line)
        wire.say(b"\n\n")
        wire.say(SHOT)
        assert play_on(wire, "team0")["state"]["game_result"]["reason"] == "score"
    assert len(host.game.shots) >= 16


def test_too_many_bad_lines_lose_the_game_for_who_sends_them():
    with Host(None, None) as host, Wire(host.ports[0]) as bad, Wire(host.ports[1]) as good:
        bad.until("update", next_team="team0")
        bad.say(b"nonsense\n" * (MAX_BAD_LINES + 1))
        over = good.until("update", next_team=None)
        assert over["state"]["game_result"] == {"winner": "team1", "reason": "concede"}
        assert good.hear()["cmd"] == "game_over"
    assert "too many bad lines" in host.remarks[-1]


def test_a_flood_out_of_turn_does_not_stop_the_game():
    with Host(None, None) as host, Wire(host.ports[0]) as calm, Wire(host.ports[1]) as flood:
        calm.until("update", next_team="team0")
        flood.say(b'{"cmd":"move","move":{"type":"concede"}}\n' * 2000)
        calm.say(SHOT)
        over = play_on(calm, "team0")
        assert over["state"]["game_result"]["winner"] == "team0"


@pytest.mark.parametrize("when", ["its turn", "the other's turn"])
def test_a_client_that_disconnects_loses(when):
    with Host(None, None) as host, Wire(host.ports[0]) as leaving, Wire(host.ports[1]) as staying:
        leaving.until("update", next_team="team0")
        if when == "the other's turn":
            leaving.say(SHOT)
            staying.until("update", next_team="team1")
        leaving.__exit__()
        if when == "the other's turn":
            staying.say(SHOT)
        over = staying.until("update", next_team=None)
        assert over["state"]["game_result"] == {"winner": "team1", "reason": "concede"}
        assert over["state"]["hammer"] is None
        assert staying.hear()["cmd"] == "game_over"
    assert "team0 (by hand) left the game: it closed the connection" in host.remarks[-1]


def test_a_line_without_end_loses_the_seat():
    with Host(None, DrawPlayer()) as host, Wire(host.ports[0]) as wire:
        wire.until("update", next_team="team0")
        wire.say(b"x" * 200_000)
    assert "more than 65536 bytes" in host.remarks[-1]
    assert host.game.result == {"winner": "team1", "reason": "concede"}


def test_a_team_whose_time_is_up_loses():
    with Host(None, DrawPlayer(), thinking_time=0.3) as host, Wire(host.ports[0]) as wire:
        wire.until("update", next_team="team0")
        begin = time.perf_counter()
        over = wire.until("update", next_team=None)
        assert 0.2 < time.perf_counter() - begin < 120
        assert over["state"]["game_result"] == {"winner": "team1", "reason": "time_limit"}
        assert over["last_move"]["actual_move"] == {"type": "concede"}
        assert over["state"]["thinking_time_remaining"]["team0"] == 0
        assert over["state"]["shot"] == 1


def test_a_clock_runs_only_for_the_team_to_throw():
    with Host(DrawPlayer(), None, thinking_time=50.0) as host, Wire(host.ports[1]) as wire:
        first = wire.until("update", next_team="team1")
        time.sleep(0.4)
        wire.say(SHOT)
        second = wire.until("update", next_team="team0")
        wire.say({"cmd": "bye"})
        clock = [m["state"]["thinking_time_remaining"]["team1"] for m in (first, second)]
        assert clock[0] == 50.0
        assert clock[1] == pytest.approx(49.6, abs=0.3)
        wire.until("update", next_team="team1")
        wire.say({"cmd": "move", "move": {"type": "concede"}})
        over = wire.until("update", next_team=None)
        assert over["state"]["game_result"] == {"winner": "team0", "reason": "concede"}


def test_a_client_that_is_refused_makes_room(monkeypatch):
    monkeypatch.setattr("agents.digital_curling.hosting.seats.GREETING_TIMEOUT", 0.2)
    with Host(None, DrawPlayer()) as host:
        for words in (b"GET / HTTP/1.1\r\n\r\n", b"", b'{"cmd":"ready_ok"}\n'):
            with Wire(host.ports[0], ready=False) as stranger:
                stranger.say(words)
                stranger.until("gone")
        for _ in range(100):
            with Wire(host.ports[0], ready=False) as wire:
                if wire.hear()["cmd"] == "dc":
                    wire.say({"cmd": "dc_ok", "name": "late"})
                    wire.until("is_ready")
                    wire.say({"cmd": "ready_ok", "player_order": [3, 2, 1, 0]})
                    wire.until("update", next_team="team0")
                    with Wire(host.ports[0], ready=False) as third:
                        assert third.hear()["cmd"] == "gone"  # the seat is taken
                    wire.say({"cmd": "move", "move": {"type": "concede"}})
                    wire.until("game_over")
                    break
            time.sleep(0.05)
    assert host.game.names[0] == "late"
    assert sum("was refused" in remark for remark in host.remarks) == 3


@pytest.mark.parametrize("order", [[0, 1, 2], [0, 0, 1, 2], [0, 1, 2, 9]])
def test_an_order_names_each_player_once(order):
    with Host(None, DrawPlayer()) as host:
        with Wire(host.ports[0], ready=False) as wire:
            wire.hear()
            wire.say({"cmd": "dc_ok", "name": "x"})
            wire.hear()
            wire.say({"cmd": "ready_ok", "player_order": order})
            assert wire.until("gone")["cmd"] == "gone"
        while True:
            with Wire(host.ports[0], ready=False) as wire:
                if wire.hear()["cmd"] == "gone":
                    time.sleep(0.05)
                    continue
                wire.say({"cmd": "dc_ok", "name": "x"})
                wire.hear()
                wire.say({"cmd": "ready_ok", "player_order": [1, 0, 3, 2]})
                wire.until("update")
                break


def test_a_port_in_use_is_reported(curling):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        # In a thread: the browser of other tests leaves an event loop running in this one.
        with ThreadPoolExecutor() as pool:
            out = pool.submit(curling, "host", "--team1", "draw", "--port", port).result()
    assert out.complaint.startswith(f"127.0.0.1:{port}: cannot listen on this address")


@settings(max_examples=8)
@given(st.lists(st.binary(min_size=1, max_size=40), max_size=MAX_BAD_LINES - 1))
def test_whatever_a_client_sends_the_other_plays_on(lines):
    with Host(None, DrawPlayer()) as host, Wire(host.ports[0]) as wire:
        wire.until("update", next_team="team0")
        for line in lines:
            wire.say(line.replace(b"\n", b" ") + b"\n")
        wire.say(SHOT)
        wire.until("update", next_team="team0")
        wire.say({"cmd": "move", "move": {"type": "concede"}})
        over = wire.until("update", next_team=None)
        assert over["state"]["game_result"]["winner"] == "team1"
