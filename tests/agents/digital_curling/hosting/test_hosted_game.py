"""A hosted game without a network: noise per thrower, strange shots, clocks, extra ends."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import msgspec
import pytest

from agents.digital_curling import (
    HostedGame,
    HostSetting,
    Point,
    ShotMessage,
    Update,
    from_server,
    game_of,
    throwers_from,
    write_line,
)
from agents.playing import check_lines
from curling_env.errors import InputError
from curling_env.game import IceEvolution
from curling_env.ice import load_ice
from curling_env.throw import SKILLS

DRAW = ShotMessage(velocity=Point(0.13, 2.39), rotation="ccw")
THROUGH = ShotMessage(velocity=Point(0.4, 3.9), rotation="cw")
FCV1 = load_ice("fcv1")
EXACT = (SKILLS["none"],) * 4


def hosted(orders=((0, 1, 2, 3), (0, 1, 2, 3)), **changes: Any) -> HostedGame:
    setting = HostSetting(**{"ice": FCV1, "ends": 1, "throwers": (EXACT, EXACT), **changes})
    return HostedGame(setting, ("a", "b"), orders)


def update_of(game: HostedGame) -> Update:
    """Return the position after conversion to the protocol and back."""
    message = from_server(write_line(game.update))
    assert isinstance(message, Update)
    return message


def test_clients_get_the_keys_that_their_library_needs():
    reported = json.loads(json.dumps(hosted(ends=3).setting.announcement))
    assert reported["rule"] == "normal"
    setting = {"max_end", "sheet_width", "five_rock_rule", "thinking_time"}
    assert reported["setting"].keys() == {*setting, "extra_end_thinking_time"}
    assert reported["simulator"].keys() == {"type", "seconds_per_frame"}
    for team in ("team0", "team1"):
        assert len(reported["players"][team]) == 4
        for player in reported["players"][team]:
            numbers = {"max_speed", "stddev_speed", "stddev_angle"}
            assert player.keys() == {*numbers, "type", "seed", "randomize_hand"}


def test_every_position_shows_the_actual_game():
    game = hosted(throwers=(throwers_from("elite"), throwers_from("club")), ends=2)
    while not game.is_over:
        message = update_of(game)
        seen = game_of(message.state, game.setting.rules, game.game.lines)
        assert replace(seen, end=None) == replace(game.game, end=None)
        assert seen.end is not None
        assert game.game.end is not None
        assert seen.end.to_throw is game.to_throw
        for mine, theirs in zip(seen.end.stones, game.game.end.stones, strict=True):
            assert mine[:2] == theirs[:2]
            assert mine[2:] == pytest.approx(theirs[2:], abs=1e-12)
        game.shoot(DRAW if len(game.shots) % 3 else THROUGH, 1.0)
    check_lines(json.loads(json.dumps(game.record())))


def test_each_thrower_has_his_own_error_in_the_order_that_the_team_chose():
    wild_third = (*(SKILLS["none"],) * 2, SKILLS["club"], SKILLS["none"])
    game = hosted(((2, 0, 1, 3), (0, 1, 2, 3)), throwers=(wild_third, EXACT))
    for _ in range(16):
        game.shoot(DRAW, 1.0)
    exact = [
        shot["actual_move"].velocity.y == pytest.approx(DRAW.velocity.y, abs=1e-12)
        for shot in game.shots
    ]
    # The third of the list throws the first two stones of team 0.
    assert exact == [False, True, False, True, *[True] * 12]


def test_intended_throws_have_a_maximum_speed():
    game = hosted(max_speed=3.0)
    game.shoot(ShotMessage(velocity=Point(0.0, 9.0), rotation="cw"), 1.0)
    assert game.shots[0]["actual_move"].velocity.y == pytest.approx(3.0)


def test_a_backward_shot_is_removed_and_reported_unchanged():
    game = hosted()
    game.shoot(DRAW, 1.0)
    before = update_of(game).state.stones
    back = ShotMessage(velocity=Point(0.0, -0.01), rotation="none")
    game.shoot(back, 1.0)
    after = update_of(game)
    assert after.state.stones == before
    assert after.last_move is not None
    assert after.last_move.actual_move == back
    check_lines(json.loads(json.dumps(game.record())))


def test_handles_turn_on_and_stay_where_stones_do():
    game = hosted()
    game.shoot(DRAW, 1.0)
    first = update_of(game).state.stones.team0[0]
    assert first is not None
    assert 30 < first.angle < 45
    game.shoot(THROUGH, 1.0)
    assert update_of(game).state.stones.team0[0] == first


def test_a_tied_game_continues_with_a_new_clock():
    game = hosted(extra_time=33.0)
    for _ in range(16):
        game.shoot(THROUGH, 2.0)
    state = update_of(game).state
    assert (state.end, state.shot, state.hammer) == (1, 0, "team1")
    assert state.thinking_time_remaining == {"team0": 33.0, "team1": 33.0}
    for _ in range(15):
        game.shoot(THROUGH, 1.0)
    game.shoot(DRAW, 1.0)
    state = update_of(game).state
    assert state.extra_end_score is not None
    assert (state.extra_end_score.team0, state.extra_end_score.team1) == (0, 1)
    assert game.result == {"winner": "team1", "reason": "score"}
    assert update_of(game).next_team is None


def test_a_shot_after_the_time_is_no_shot():
    game = hosted(thinking_time=5.0)
    game.shoot(DRAW, 5.0)
    assert game.result == {"winner": "team1", "reason": "time_limit"}
    assert update_of(game).state.thinking_time_remaining["team0"] == 0.0
    assert game.record()[-1]["conceded"] is None
    assert game.record()[-1]["winner"] == "away"


def test_paths_are_sent_on_request():
    game = hosted(send_trajectory=True)
    game.shoot(DRAW, 1.0)
    path = msgspec.to_builtins(game.update)["last_move"]["trajectory"]
    y = [frame[0]["value"]["position"]["y"] for frame in path["frames"] if frame]
    assert y == sorted(y)
    assert y[-1] == pytest.approx(path["finish"]["team0"][0]["position"]["y"], abs=1e-6)
    assert 200 < len(path["frames"]) < 300


def test_ice_may_wear_and_be_swept():
    still, worn = hosted(), hosted(ice_evolution=IceEvolution(wear=-0.02))
    for game in (still, worn):
        for _ in range(3):
            game.shoot(DRAW, 1.0)
    lying = [game.shots[2]["trajectory"]["finish"]["team0"][1] for game in (still, worn)]
    assert lying[0] != lying[1]
    light = ShotMessage(velocity=Point(0.128, 2.33), rotation="ccw")
    shaky = (throwers_from("0.02:0.001"), EXACT)
    swept = hosted(sweeping=True, throwers=shaky, seed=4)
    for _ in range(6):
        swept.shoot(light, 1.0)
    assert any(line["sweep"][1] > line["sweep"][0] for line in swept.record()[1:-1])


@pytest.mark.parametrize(
    ("text", "sigmas"),
    [
        ("none", [0.0] * 4),
        ("0.01:0.002", [0.01] * 4),
        ("none, 0.02:0, club,elite", [0.0, 0.02, 0.03, 0.0076]),
    ],
)
def test_throwers_are_given_once_or_four_times(text, sigmas):
    assert [skill.sigma_speed for skill in throwers_from(text)] == sigmas


@pytest.mark.parametrize("text", ["", "none,none", "fast", "a:b", "1:", "-1:0", "nan:0", "9:9"])
def test_invalid_throwers_are_refused(text):
    with pytest.raises(InputError):
        throwers_from(text)


@pytest.mark.parametrize("change", [{"thinking_time": 0}, {"max_speed": 7}, {"throwers": ((), ())}])
def test_settings_with_which_nothing_can_be_played_are_refused(change):
    with pytest.raises(InputError):
        HostSetting(**{"ice": FCV1, **change})
