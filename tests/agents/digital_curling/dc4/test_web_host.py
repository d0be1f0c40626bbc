"""Version 4 over HTTP: our client against our host, strange requests, and the page for
spectators.
"""

from __future__ import annotations

import time

import pytest

pytest.importorskip("uvicorn", reason="make setup installs it")

from agents.digital_curling import Connection4, Credentials, RateLimit, RefusedError, read_passwords
from agents.playing import Match
from curling_env.errors import InputError
from curling_env.game import DrawPlayer, GameSimulator, RuleBasedPlayer, Team, rule_set
from curling_env.throw import FROM_HACK
from tests.agents.digital_curling.dc4.web_hosting import (
    PASSWORDS,
    TEAM,
    Stream,
    WebHost,
    check_same_game,
    joined,
)

SHOT = {"translational_velocity": 2.39, "shot_angle": 1.5167, "angular_velocity": -1.5708}


@pytest.fixture(autouse=True)
def no_farewell(monkeypatch):
    """Skip the wait at the end: only one page watches these games, and it asks each second."""
    monkeypatch.setattr("agents.digital_curling.dc4.web_host.RESULT_SECONDS", 0.05)


# --- whole games ----------------------------------------------------------------------------------


def test_two_clients_of_version_4_play_the_game_that_is_played_here():
    with WebHost(None, None, seed=6) as host:
        home, one = joined(host, "anna", "team0", RuleBasedPlayer(), seed=6)
        away, two = joined(host, "ben", "team1", RuleBasedPlayer(), seed=6)
        one.join(60)
        two.join(60)
    simulator = GameSimulator(
        "fcv1",
        rules=rule_set("dc4_server", ends=1),
        skills="digital-curling",
        delivery=FROM_HACK,
    )
    players = (RuleBasedPlayer(), RuleBasedPlayer())
    match = Match(simulator, players, seed=6, last_stone=Team.AWAY)
    check_same_game(host, (home, away), match)


def test_join_by_url_is_one_command(curling, monkeypatch, tmp_path):
    monkeypatch.setenv("CURLING_PASSWORD", PASSWORDS["anna"])
    with WebHost(None, DrawPlayer()) as host:
        options = ["--match", host.hosting.game_id, "--user", "anna", "--player", "draw"]
        out = curling("join", host.url, *options, "-o", tmp_path)
    assert out.status == 0, out.err
    assert out.json()["winner"] == host.game.result["winner"]
    assert out.json()["stones"] == 16
    assert PASSWORDS["anna"] not in (tmp_path / "wire.jsonl").read_text()


# --- the protocol ---------------------------------------------------------------------------------


def test_states_come_as_the_protocol_has_them():
    with WebHost(None, DrawPlayer()) as host:
        assert host.ask(f"/matches/{host.hosting.game_id}")[1]["standard_end_count"] == 1
        assert host.ask(f"/matches/{host.hosting.game_id}/latest-state")[0] == 404
        assert host.take_seat() == (200, "team0")
        assert host.take_seat(team="team1") == (200, "team0")  # a returning client keeps the seat
        assert host.take_seat("ben")[0] == 409
        stream, seen = Stream(host), []
        for kind, state in stream.events():
            seen.append(state)
            assert kind == "latest_state_update"
            if state["next_shot_team"] == "team0":
                assert host.ask("/shots", SHOT, **host.match) == (200, None)
        stream.close()
    totals = [state["total_shot_number"] for state in seen]
    assert totals == list(range(17))
    assert seen[-1]["winner_team"] == host.game.result["winner"]
    assert seen[-1]["next_shot_team"] is None
    assert seen[-1]["end_number"] == 0
    assert max(seen[-1]["score"]["team0"] + seen[-1]["score"]["team1"]) > 0
    assert len(seen[0]["score"]["team0"]) == 2
    assert seen[0]["stone_coordinate"]["data"]["team0"] == [{"x": 0.0, "y": 0.0}] * 8
    thrown = seen[1]["last_move"]
    assert thrown["angular_velocity"] == pytest.approx(SHOT["angular_velocity"], abs=1e-3)
    assert thrown["shot_angle"] == pytest.approx(SHOT["shot_angle"], abs=0.02)


def test_a_returning_client_gets_the_end_up_to_now():
    with WebHost(None, DrawPlayer()) as host:
        host.take_seat()
        first = Stream(host)
        events = first.events()
        while (state := next(events)[1])["total_shot_number"] < 4:
            if state["next_shot_team"] == "team0":
                host.ask("/shots", SHOT, **host.match)
        first.close()
        again = Stream(host)
        reported = again.events()
        kinds = [next(reported) for _ in range(5)]
        assert [kind for kind, _ in kinds] == [*["state_update"] * 4, "latest_state_update"]
        assert [state["total_shot_number"] for _, state in kinds] == [0, 1, 2, 3, 4]
        finish(host, reported)
        again.close()


def finish(host: WebHost, events) -> None:
    """Play a game to its end, from our turn on."""
    host.ask("/shots", SHOT, **host.match)
    for _, state in events:
        if state["next_shot_team"] == "team0":
            host.ask("/shots", SHOT, **host.match)


def test_requests_that_a_client_may_not_make_are_refused():
    with WebHost(None, DrawPlayer()) as host:
        seat = {**host.match, "expected_match_team_name": "team0"}
        assert host.ask("/store-team-config", TEAM, None, **seat)[0] == 401
        assert host.ask("/store-team-config", TEAM, "eve", **seat)[0] == 401
        assert host.ask("/store-team-config", TEAM, **{**seat, "match_id": "x"})[0] == 404
        wrong = {**seat, "expected_match_team_name": "team7"}
        assert host.ask("/store-team-config", TEAM, **wrong)[0] == 422
        assert host.ask("/store-team-config", {"team_name": 1}, **seat)[0] == 422
        assert host.ask("/store-team-config", b"{" * 100, **seat)[0] == 422
        assert host.ask("/store-team-config", b" " * 70_000, **seat)[0] == 413
        assert host.ask("/shots", SHOT, "ben", **host.match)[0] == 401
        assert host.ask("/matches/x/viewer")[0] == 404
        assert host.ask("/nowhere")[0] == 404
        assert host.take_seat()[0] == 200
        stream = Stream(host)
        events = stream.events()
        next(events)
        for bad in ({}, {**SHOT, "shot_angle": "x"}, [], 1e999, {**SHOT, "shot_angle": 1e9}):
            status, answer = host.ask("/shots", bad, **host.match)
            assert status == 422, answer
            assert isinstance(answer["detail"], str)
        finish(host, events)
        assert host.ask("/shots", SHOT, **host.match)[0] == 409
        stream.close()


def test_a_shot_out_of_turn_is_refused():
    with WebHost(None, None) as host:
        host.take_seat()
        host.take_seat("ben", "team1")
        streams = [Stream(host), Stream(host, "ben")]
        events = [stream.events() for stream in streams]
        next(events[1])
        status, answer = host.ask("/shots", SHOT, "ben", **host.match)
        assert (status, answer["detail"]) == (400, "It is not the turn of this team.")
        for number in range(16):
            user = "ben" if number % 2 else "anna"
            while (state := next(events[number % 2])[1])["total_shot_number"] < number:
                pass
            assert state["next_shot_team"] == f"team{number % 2}"
            assert host.ask("/shots", SHOT, user, **host.match)[0] == 200


def test_a_team_whose_time_is_up_loses():
    with WebHost(None, DrawPlayer(), thinking_time=0.3) as host:
        host.take_seat()
        stream = Stream(host)
        *_, (_, last) = stream.events()
        assert last["winner_team"] == "team1"
        assert last["first_team_remaining_time"] == 0
        stream.close()
    assert host.game.result == {"winner": "team1", "reason": "time_limit"}


def test_a_flood_of_requests_is_stopped(monkeypatch):
    monkeypatch.setattr("agents.digital_curling.dc4.application.REQUESTS", 30)
    with WebHost(None, DrawPlayer(), thinking_time=1.0) as host:
        answers = [host.ask("/shots", {}, **host.match)[0] for _ in range(31)]
        assert answers == [422] * 30 + [429]
        guesses = [host.ask("/shots", {}, "eve", **host.match)[0] for _ in range(31)]
        assert guesses == [401] * 30 + [429]
        host.take_seat()
        stream = Stream(host)
        list(stream.events())
        stream.close()


def test_a_rate_recovers(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    limit = RateLimit(2, 60.0)
    limit.take("anna", "/shots")
    limit.take("anna", "/shots")
    limit.take("ben", "/shots")
    with pytest.raises(RefusedError):
        limit.take("anna", "/shots")
    now[0] = 60.5
    limit.take("anna", "/shots")


@pytest.mark.parametrize(
    ("header", "user"),
    [
        ("Basic YW5uYTpjb3JyZWN0IGhvcnNl", "anna"),
        ("basic YW5uYTpjb3JyZWN0IGhvcnNl", "anna"),
        ("Bearer YW5uYTpjb3JyZWN0IGhvcnNl", None),
        ("Basic YW5uYTpiYXR0ZXJ5IHN0YXBsZQ==", None),  # another's password
        ("Basic !!", None),
        ("Basic /////w==", None),
        ("Basic", None),
        ("", None),
    ],
)
def test_credentials(header, user):
    assert Credentials(PASSWORDS).user(header) == user


def test_passwords_come_from_a_file_or_are_new(tmp_path):
    assert read_passwords(None).keys() == {"team0", "team1"}
    assert read_passwords(None) != read_passwords(None)
    path = tmp_path / "users.json"
    path.write_text('{"anna": "long enough"}')
    assert read_passwords(path) == {"anna": "long enough"}
    for text in ('{"a:b": "long enough"}', '{"a": "short"}', "{}", "[]", '{"a": 1}', "x"):
        path.write_text(text)
        with pytest.raises(InputError, match=r"users\.json"):
            read_passwords(path)


# --- a server that is not ours --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--match", "x"], "--user"),
        (["--user", "anna"], "--match"),
        (["--match", "x", "--user", "anna", "--team", "red"], "'team0', 'team1'"),
        (["--match", "x", "--user", "anna"], "no answer"),
    ],
)
def test_a_url_needs_a_match_and_a_user(words, says, curling, monkeypatch):
    monkeypatch.setenv("CURLING_PASSWORD", "x")
    assert says in curling("join", "http://127.0.0.1:9", "--player", "draw", *words).complaint


def test_a_refused_password_is_reported(curling, monkeypatch):
    monkeypatch.setenv("CURLING_PASSWORD", "wrong")
    with WebHost(None, DrawPlayer(), thinking_time=1.0) as host:
        options = ["--match", host.hosting.game_id, "--user", "anna", "--player", "draw"]
        out = curling("join", host.url, *options)
        assert out.complaint.startswith(f"{host.url}: user or password refused (401")
        assert "no such match (404" in curling("join", host.url, *options, "--match", "0").complaint
        host.take_seat()
        stream = Stream(host)
        list(stream.events())
        stream.close()


def test_a_stream_that_breaks_off_is_taken_up_again(monkeypatch):
    # Every break lasts longer than the other team thinks, so that all its shots fall into one.
    monkeypatch.setattr("agents.digital_curling.dc4.join.RETRY_DELAY", 0.3)
    # The last break may come with the end of the game; the host must still be there then.
    monkeypatch.setattr("agents.digital_curling.dc4.web_host.RESULT_SECONDS", 2.0)
    real = Connection4.states

    def until_own_shot(self):
        for state, is_latest in real(self):
            yield state, is_latest
            if is_latest and state.next_shot_team == "team0":
                return

    monkeypatch.setattr("agents.digital_curling.dc4.join.Connection4.states", until_own_shot)
    with WebHost(None, DrawPlayer()) as host:
        client, thread = joined(host, "anna", "team0", DrawPlayer())
        thread.join(60)
    assert client.result is not None
    assert len(client.seen) == 16


# --- the page -------------------------------------------------------------------------------------


def test_the_page_follows_the_game(page, monkeypatch):
    monkeypatch.setattr("agents.digital_curling.dc4.web_host.RESULT_SECONDS", 3.0)
    with WebHost(None, DrawPlayer()) as host:
        page.goto(host.url)
        assert "when both teams are connected" in page.inner_text("body")
        host.take_seat()
        stream = Stream(host)
        events = stream.events()
        next(events)
        page.goto(host.url)
        assert "in play" in page.inner_text("#about")
        finish_half(host, events)
        page.wait_for_function("document.getElementById('place').max > 6", timeout=120_000)
        assert "in play" in page.inner_text("#about")
        assert page.inner_text("#title") == "by hand against draw"
        finish(host, events)
        page.wait_for_function(
            "!document.getElementById('about').textContent.includes('in play')", timeout=120_000
        )
        stream.close()
    assert "16 stones" in page.inner_text("#about")


def finish_half(host: WebHost, events) -> None:
    """Play until eight stones are thrown."""
    host.ask("/shots", SHOT, **host.match)
    for _, state in events:
        if state["total_shot_number"] == 8:
            return
        if state["next_shot_team"] == "team0":
            host.ask("/shots", SHOT, **host.match)
