"""Conversion of version 4 to version 3, and back."""

from __future__ import annotations

import json
import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.digital_curling import (
    ConcedeMessage,
    HostedGame,
    HostSetting,
    Point,
    Reader4,
    Shot4,
    ShotMessage,
    State4,
    game_of,
    move_from,
    shot_of,
    state_of,
)
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.infrastructure import checked

DRAW = ShotMessage(velocity=Point(0.13, 2.39), rotation="ccw")
THROUGH = ShotMessage(velocity=Point(0.4, 3.9), rotation="cw")


def state(**changes) -> State4:
    """Return the first state of a game, as sent by its server."""
    nowhere = [{"x": 0, "y": 0}] * 8
    reported = {
        "winner_team": None,
        "end_number": 0,
        "team_shot_number": 0,
        "total_shot_number": 0,
        "next_shot_team": "team0",
        "first_team_remaining_time": 600,
        "second_team_remaining_time": 599.5,
        "first_team_extra_end_remaining_time": 60,
        "second_team_extra_end_remaining_time": 61,
        "mixed_doubles_settings": None,
        "last_move": None,
        "stone_coordinate": {"data": {"team0": nowhere, "team1": nowhere}},
        "score": {"team0": [0, 0, 0], "team1": [0, 0, 0]},
        **changes,
    }
    return checked(reported, State4)


def shot(speed=2.4, angle=math.pi / 2, spin=math.pi / 2):
    return {"translational_velocity": speed, "shot_angle": angle, "angular_velocity": spin}


def test_the_first_state_is_a_game_that_begins():
    update = Reader4().read(state())
    assert update is not None
    assert (update.next_team, update.last_move) == ("team0", None)
    now = update.state
    assert (now.end, now.shot, now.hammer) == (0, 0, "team1")
    assert now.scores.team0 == [None, None]
    assert now.thinking_time_remaining == {"team0": 600, "team1": 599.5}
    assert now.stones.team0 == [None] * 8


def test_a_stone_at_the_origin_is_absent():
    places = [{"x": 0.1, "y": 38.0}, {"x": 0.0, "y": 0.0}, {"x": 0.0, "y": 36.2}]
    update = Reader4().read(
        state(stone_coordinate={"data": {"team0": places, "team1": []}}, total_shot_number=4)
    )
    assert update is not None
    there = [stone is not None for stone in update.state.stones.team0]
    assert there == [True, False, True, *[False] * 5]


def test_two_states_after_an_end_are_one_update():
    reader = Reader4()
    assert reader.read(state(total_shot_number=15, next_shot_team="team1")) is not None
    after = state(total_shot_number=16, next_shot_team=None, last_move=shot())
    assert reader.read(after) is None
    scored = {"team0": [0, 0, 0], "team1": [2, 0, 0]}
    update = reader.read(state(end_number=1, next_shot_team="team1", score=scored))
    assert update is not None
    assert update.last_move is not None
    assert isinstance(update.last_move.actual_move, ShotMessage)
    assert update.state.scores.team1 == [2, None]
    assert (update.state.end, update.state.hammer, update.next_team) == (1, "team0", "team1")


def test_repeated_states_give_no_update():
    reader = Reader4()
    assert reader.read(state()) is not None
    assert reader.read(state(total_shot_number=1, next_shot_team="team1")) is not None
    assert reader.read(state()) is None
    assert reader.read(state(total_shot_number=1, next_shot_team="team1")) is None


def test_an_extra_end_has_its_own_clock_and_score():
    update = Reader4().read(
        state(end_number=2, score={"team0": [1, 0, 0], "team1": [0, 1, 0]}, next_shot_team="team0")
    )
    assert update is not None
    assert update.state.thinking_time_remaining == {"team0": 60, "team1": 61}
    assert update.state.extra_end_score is not None
    assert not update.state.extra_end_score.scored


@pytest.mark.parametrize(("shot_number", "reason", "ends"), [(16, "score", 2), (7, "concede", 1)])
def test_a_game_that_is_won_is_over(shot_number, reason, ends):
    reader = Reader4()
    reader.read(state(end_number=1, total_shot_number=6))
    update = reader.read(
        state(
            end_number=1,
            winner_team="team0",
            next_shot_team=None,
            total_shot_number=shot_number,
            score={"team0": [1, 1, 0], "team1": [0, 0, 0]},
        )
    )
    assert update is not None
    assert update.state.game_result is not None
    assert (update.state.game_result.winner, update.state.game_result.reason) == ("team0", reason)
    assert update.state.end == ends
    assert isinstance(update.last_move.actual_move, ConcedeMessage) is True


def test_a_shot_too_many_is_refused():
    with pytest.raises(InputError, match="16th"):
        Reader4().read(state(total_shot_number=16, next_shot_team="team1"))


def test_a_positive_angular_velocity_is_cw_and_straight_is_a_right_angle():
    move = move_from(Shot4(2.0, math.pi / 2, math.pi / 2))
    assert move.rotation == "cw"
    assert (move.velocity.x, move.velocity.y) == pytest.approx((0.0, 2.0), abs=1e-12)
    assert move_from(Shot4(2.0, math.pi / 2 + 0.1)).rotation == "ccw"
    assert move_from(Shot4(2.0, math.pi / 2 + 0.1)).velocity.x < 0


@given(st.floats(-3, 3), st.floats(-1, 5), st.sampled_from(["cw", "ccw"]))
def test_a_move_is_the_same_after_its_way_through_version_4(x, y, rotation):
    again = move_from(shot_of(ShotMessage(velocity=Point(x, y), rotation=rotation)))
    assert again.rotation == rotation
    assert (again.velocity.x, again.velocity.y) == pytest.approx((x, y), abs=1e-12)


def test_a_whole_game_reads_in_version_4_as_in_version_3():
    """Every position of a hosted game, sent in version 4 and read back, is the game."""
    game = HostedGame(
        HostSetting(ice=load_ice("fcv1"), ends=2, rule_name="dc4_server", seed=3),
        ("a", "b"),
        ((0, 1, 2, 3), (0, 1, 2, 3)),
    )
    reader = Reader4()
    while not game.is_over:
        last = None if not game.shots else shot_of(DRAW)
        reported = state_of(game.update, game.names, last_move=last, clocks=game.clocks)
        assert reported["shot_number"] == reported["team_shot_number"]
        update = reader.read(checked(json.loads(json.dumps(reported)), State4))
        assert update is not None
        seen = game_of(update.state, game.setting.rules, game.game.lines)
        assert seen.line_score == game.game.line_score
        assert seen.end is not None
        assert game.game.end is not None
        assert seen.end.hammer is game.game.end.hammer
        assert [s[:2] for s in seen.end.stones] == [s[:2] for s in game.game.end.stones]
        game.shoot(DRAW if len(game.shots) % 2 else THROUGH, 1.0)
    reported = state_of(game.update, game.names, last_move=None, clocks=game.clocks)
    assert reported["winner_team"] == game.result["winner"]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-300, 300) | st.floats(allow_nan=False),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)


@given(st.lists(st.tuples(st.sampled_from(sorted(State4.__struct_fields__)), JSON), max_size=3))
def test_a_damaged_state_is_read_or_refused(damage):
    problem, reader = "", Reader4()
    reported = msgspec.to_builtins(state()) | dict(damage)
    try:
        reader.read(checked(reported, State4))
    except InputError as error:
        problem = str(error)
    assert "\n" not in problem
