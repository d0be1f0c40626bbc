"""Mixed doubles of version 4: the placement before each end, its stones, two players a team."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

pytest.importorskip("uvicorn", reason="make setup installs it")

from agents.digital_curling import (
    HostedGame,
    HostSetting,
    Point,
    Reader4,
    ShotMessage,
    State4,
    doubles_of,
    game_of,
    placement_of,
    request_of,
    shot_of,
    state_of,
)
from agents.playing import Match, SearchPlayer
from curling_env.errors import InputError
from curling_env.game import DrawPlayer, GameSimulator, RuleBasedPlayer, Team, rule_set
from curling_env.ice import load_ice
from curling_env.infrastructure import checked
from curling_env.throw import FROM_HACK, SKILLS, Skill
from tests.agents.digital_curling.dc4.web_hosting import (
    PASSWORDS,
    TEAM,
    Stream,
    WebHost,
    check_same_game,
    joined,
)

RULES = "dc4_server_mixed_doubles"
DRAW = ShotMessage(velocity=Point(0.13, 2.39), rotation="ccw")
SHOT = {"translational_velocity": 2.39, "shot_angle": 1.5167, "angular_velocity": -1.5708}
NOWHERE = {"x": 0.0, "y": 0.0}
ORDERS = ((0, 1, 2, 3), (0, 1, 2, 3))


@pytest.fixture(autouse=True)
def no_farewell(monkeypatch):
    monkeypatch.setattr("agents.digital_curling.dc4.web_host.RESULT_SECONDS", 0.05)


class Leading(RuleBasedPlayer):
    """Throws first if it may choose, and has its power play in the second end."""

    name = "leading"

    def power_play(self, view):
        return "left" if len(view.game.line_score) == 1 else None

    def throws_first(self, view):
        return True


def update_of(state: dict) -> State4:
    return checked(json.loads(json.dumps(state)), State4)


# --- states ---------------------------------------------------------------------------------------


def server_state(**changes) -> State4:
    """Return the first state of mixed doubles, as sent by the competition's server."""
    return update_of(
        {
            "winner_team": None,
            "first_team_name": "a",
            "second_team_name": "b",
            "end_number": 0,
            "team_shot_number": None,
            "total_shot_number": None,
            "next_shot_team": None,
            "first_team_remaining_time": 600.0,
            "second_team_remaining_time": 600.0,
            "first_team_extra_end_remaining_time": 60.0,
            "second_team_extra_end_remaining_time": 60.0,
            "mixed_doubles_settings": {
                "end_setup_team": "team1",
                "positioned_stones_pattern": 2,
                "power_play_end": {"team0": None, "team1": None},
            },
            "last_move": None,
            "stone_coordinate": {"data": {"team0": [NOWHERE] * 6, "team1": [NOWHERE] * 6}},
            "score": {"team0": [0] * 9, "team1": [0] * 9},
            **changes,
        }
    )


SET_UP = {
    "team0": [{"x": 0.0, "y": 34.435}, *[NOWHERE] * 7],
    "team1": [{"x": 0.0, "y": 38.87}, *[NOWHERE] * 7],
}
STARTED = {"team_shot_number": 0, "total_shot_number": 0, "next_shot_team": "team0"}
THROWN = {"translational_velocity": 2.4, "shot_angle": math.pi / 2, "angular_velocity": 1.57}


def test_an_end_waits_for_its_placement_and_then_begins():
    rules, reader = rule_set(RULES, arrangement=2), Reader4()
    waiting = reader.read(server_state())
    assert waiting is not None
    game = game_of(waiting.state, rules, rules.lines())
    assert (game.end, game.last_stone, game.is_over) == (None, Team.AWAY, False)
    placed = reader.read(server_state(**STARTED, stone_coordinate={"data": SET_UP}))
    assert placed is not None
    assert placed.next_team == "team0"
    game = game_of(placed.state, rules, rules.lines())
    assert game.end is not None
    assert (game.end.hammer, game.end.delivered) == (Team.AWAY, 0)
    lying = [(s.team, s.number, s.x, round(s.y, 3)) for s in game.end.stones]
    assert lying == [(Team.HOME, 5, 0.0, -3.97), (Team.AWAY, 5, 0.0, 0.465)]


def test_the_state_after_the_last_shot_does_not_wait_for_a_placement():
    """It too has neither a number of shots nor a team, but a last move."""
    reader = Reader4()
    reader.read(server_state(**{**STARTED, "total_shot_number": 9, "next_shot_team": "team1"}))
    after = server_state(last_move=THROWN, stone_coordinate={"data": SET_UP})
    assert not after.awaits_placement
    assert reader.read(after) is None
    waits = server_state(end_number=1)
    assert waits.awaits_placement
    update = reader.read(waits)
    assert update is not None
    assert isinstance(update.last_move.actual_move, ShotMessage)


def test_the_last_state_ends_the_game_by_its_score():
    reader = Reader4()
    reader.read(server_state(**{**STARTED, "end_number": 7, "total_shot_number": 9}))
    scored = {"team0": [1, *[0] * 8], "team1": [0] * 9}
    update = reader.read(
        server_state(end_number=7, winner_team="team0", last_move=THROWN, score=scored)
    )
    assert update is not None
    assert update.state.game_result is not None
    assert update.state.game_result.reason == "score"
    assert update.state.end == 8


def test_settings_are_read_by_either_name():
    settings = {"end_setup_team": "team0", "positioned_stones_pattern": 1}
    state = server_state(mixed_doubles_settings=None, mix_doubles_settings=settings)
    assert state.doubles is not None
    assert state.doubles.end_setup_team == "team0"
    with pytest.raises(InputError, match="positioned_stones_pattern"):
        server_state(mixed_doubles_settings={**settings, "positioned_stones_pattern": 6})


def test_a_hosted_game_reads_in_version_4_as_it_is():
    setting = HostSetting(ice=load_ice("fcv1"), ends=3, rule_name=RULES, arrangement=3, seed=2)
    game, reader = HostedGame(setting, ("a", "b"), ORDERS), Reader4()
    wishes = [("left", False), (None, True), ("right", False), (None, False)]
    while not game.is_over:
        last = shot_of(DRAW) if game.shots and game.update["state"]["shot"] else None
        more = {"last_move": last, "clocks": game.clocks, "doubles": doubles_of(game)}
        reported = update_of(state_of(game.update, game.names, **more))
        update = reader.read(reported)
        assert update is not None
        seen = game_of(update.state, game.setting.rules, game.game.lines)
        assert seen.line_score == game.game.line_score
        assert seen.last_stone is game.game.last_stone
        assert sorted(seen.power_plays) == sorted(game.game.power_plays)
        if game.awaits_placement:
            assert reported.awaits_placement
            assert seen.end is None
            game.place(*wishes.pop(0))
            continue
        assert seen.end is not None
        assert game.game.end is not None
        assert seen.end.hammer is game.game.end.hammer
        assert seen.end.delivered == game.game.end.delivered
        assert sorted(s[:2] for s in seen.end.stones) == sorted(s[:2] for s in game.game.end.stones)
        game.shoot(DRAW, 1.0)
    assert len(game.shots) % 10 == 0


def test_a_second_power_play_is_the_usual_placement_with_the_hammer():
    setting = HostSetting(ice=load_ice("fcv1"), ends=4, rule_name=RULES, seed=1)
    game = HostedGame(setting, ("a", "b"), ORDERS)
    first = game.decides
    game.place("left", False)
    while not game.awaits_placement:
        game.shoot(DRAW, 1.0)
    while game.decides is not first:
        game.place(None, False)
        while not game.awaits_placement:
            game.shoot(DRAW, 1.0)
    game.place("right", False)
    end = game.game.end
    assert end is not None
    assert (end.power_play, end.hammer) == (None, first)
    assert game.power_plays == {first: 0}


def test_two_players_throw_in_the_order_of_mixed_doubles():
    first, second = Skill(name="a", sigma_speed=0.01), Skill(name="b", sigma_speed=0.02)
    team = (first, second, SKILLS["club"], SKILLS["club"])
    setting = HostSetting(ice=load_ice("fcv1"), rule_name=RULES, throwers=(team, team))
    thrown = setting.simulator(ORDERS).throwers
    assert thrown is not None
    assert [skill.sigma_speed for skill in thrown[0]] == [0.01, 0.02, 0.02, 0.02, 0.01]


@pytest.mark.parametrize("side", [None, "left", "right"])
@pytest.mark.parametrize("first", [False, True])
def test_a_request_is_read_and_written(side, first):
    wanted = side, first and side is None
    assert placement_of(request_of(*wanted)) == wanted


def test_search_has_its_power_play_late_unless_it_leads_by_far():
    rules = rule_set(RULES, ends=4)
    simulator = GameSimulator("fcv1", rules=rules, delivery=FROM_HACK)
    state = simulator.new_game(0)
    player = SearchPlayer(10)
    assert player.power_play(simulator.view(state)) is None  # four ends to play

    def after(*scores):
        game = replace(state.game, line_score=scores, last_stone=Team.HOME)
        return player.power_play(simulator.view(replace(state, game=game)))

    assert after((0, 1)) == "right"
    assert after((0, 1), (1, 0)) == "right"
    assert after((2, 0), (2, 0)) is None


# --- whole games ----------------------------------------------------------------------------------


def test_two_clients_play_the_game_that_is_played_here():
    players = (RuleBasedPlayer(), Leading())
    with WebHost(None, None, rule_name=RULES, arrangement=4, ends=2, seed=6) as host:
        home, one = joined(host, "anna", "team0", players[0], seed=6)
        away, two = joined(host, "ben", "team1", players[1], seed=6)
        one.join(90)
        two.join(90)
    simulator = GameSimulator(
        "fcv1",
        rules=rule_set(RULES, ends=2, arrangement=4),
        skills="digital-curling",
        delivery=FROM_HACK,
    )
    match = Match(simulator, players, seed=6, last_stone=Team.AWAY)
    check_same_game(host, (home, away), match)
    assert match.game.hammers[0] is Team.HOME  # away, which decides first, throws first


def test_the_conversation_is_that_of_the_competitions_server():
    with WebHost(None, DrawPlayer(), rule_name=RULES, arrangement=1) as host:
        about = host.ask(f"/matches/{host.hosting.game_id}")[1]
        assert (about["game_mode"], about["applied_rule"]) == ("mixed_doubles", 2)
        assert about["mixed_doubles_settings"] == {"positioned_stones_pattern": 1}
        setup = f"/matches/{host.hosting.game_id}/end-setup"
        four = {**TEAM, "player3": {}, "player4": {}}
        seat = {**host.match, "expected_match_team_name": "team1"}
        assert host.ask("/store-team-config", four, **seat)[0] == 400
        assert host.ask(setup, b"", request="center_house")[0] == 401  # plays in no team yet
        # Only team 0 is free; the player of this project has the hammer and decides.
        assert host.take_seat() == (200, "team0")
        stream = Stream(host)
        events = stream.events()
        first = next(events)[1]
        assert first["total_shot_number"] is None
        assert first["mixed_doubles_settings"]["end_setup_team"] == "team1"
        assert first["stone_coordinate"]["data"]["team0"] == [NOWHERE] * 6
        begun = next(events)[1]
        assert (begun["total_shot_number"], begun["next_shot_team"]) == (0, "team0")
        assert begun["stone_coordinate"]["data"]["team0"][0] == pytest.approx({"x": 0, "y": 35.06})
        assert begun["stone_coordinate"]["data"]["team1"][0] == pytest.approx({"x": 0, "y": 38.87})
        assert host.ask(setup, b"", request="pp_left")[0] == 409
        assert host.ask(setup, b"", request="anything")[0] == 422
        host.ask("/shots", SHOT, **host.match)
        totals = []
        for _, state in events:
            totals.append(state["total_shot_number"])
            if state["next_shot_team"] == "team0":
                host.ask("/shots", SHOT, **host.match)
        assert totals == [*range(1, 10), None]
        stream.close()


def test_the_deciding_team_asks_and_is_answered():
    with WebHost(DrawPlayer(), None, rule_name=RULES, ends=1) as host:
        setup = f"/matches/{host.hosting.game_id}/end-setup"
        assert host.take_seat(team="team1") == (200, "team1")
        stream = Stream(host)
        events = stream.events()
        next(events)
        status, answer = host.ask("/shots", SHOT, **host.match)
        assert (status, answer["detail"]) == (409, "End setup required.")
        assert host.ask(setup, b"", request="pp_left") == (200, None)
        begun = next(events)[1]
        assert begun["mixed_doubles_settings"]["power_play_end"] == {"team0": None, "team1": 0}
        assert begun["stone_coordinate"]["data"]["team1"][0] == pytest.approx(
            {"x": -1.219, "y": 38.26}
        )
        for _, state in events:
            if state["next_shot_team"] == "team1":
                host.ask("/shots", SHOT, **host.match)
        stream.close()
    assert host.game.game.hammers == (Team.AWAY,)


def test_a_team_that_never_decides_loses():
    with WebHost(DrawPlayer(), None, rule_name=RULES, thinking_time=0.3) as host:
        host.take_seat(team="team1")
        stream = Stream(host)
        *_, (_, last) = stream.events()
        assert last["winner_team"] == "team0"
        stream.close()
    assert host.game.result == {"winner": "team0", "reason": "time_limit"}


def test_join_plays_mixed_doubles_too(curling, monkeypatch, tmp_path):
    monkeypatch.setenv("CURLING_PASSWORD", PASSWORDS["anna"])
    with WebHost(None, RuleBasedPlayer(), rule_name=RULES, ends=1) as host:
        options = ["--match", host.hosting.game_id, "--user", "anna", "--player", "rulebased"]
        out = curling("join", host.url, *options, "-o", tmp_path)
    assert out.status == 0, out.err
    assert out.json()["winner"] == host.game.result["winner"]
    assert out.json()["stones"] == 10


def test_fours_have_no_set_up_and_version_3_no_doubles(curling):
    with WebHost(None, DrawPlayer(), thinking_time=0.3) as host:
        host.take_seat()
        setup = f"/matches/{host.hosting.game_id}/end-setup"
        assert host.ask(setup, b"", request="center_house")[0] == 400
        stream = Stream(host)
        list(stream.events())
        stream.close()
    assert "version 3" in curling("host", "--rules", RULES, "--team1", "draw").complaint
