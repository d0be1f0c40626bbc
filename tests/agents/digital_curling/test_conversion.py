"""Positions, moves and players: each way and back."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.digital_curling import (
    PlayerMessage,
    Point,
    SettingMessage,
    ShotMessage,
    StateMessage,
    game_of,
    move_of,
    rules_of,
    skill_of,
    throw_of,
)
from agents.digital_curling.conversion import state_of
from curling_env.errors import InputError
from curling_env.game import Game, RestingStone, Team, begin_end, concede, hammer_after, new_game
from curling_env.infrastructure import checked
from curling_env.throw import Throw

PLACES = st.tuples(st.floats(-2.2, 2.2), st.floats(-6.2, 1.9))


def as_message(state) -> StateMessage:
    """Return a state after conversion to the protocol."""
    return checked(json.loads(json.dumps(state)), StateMessage)


@st.composite
def games(draw) -> Game:
    """A game with an end in play: ends that were played, and stones of those delivered."""
    ends = draw(st.integers(1, 10))
    rules = rules_of(SettingMessage(max_end=ends, five_rock_rule=draw(st.booleans())))
    game = new_game(rules)
    for _ in range(draw(st.integers(0, ends + 2))):
        points = draw(st.integers(-8, 8))
        if len(game.line_score) >= ends - 1:  # it goes on only while it is level
            points = -game.lead(Team.HOME)
            if len(game.line_score) == ends - 1 and abs(points) > 8:
                break
        score = max(points, 0), max(-points, 0)
        if len(game.line_score) >= ends and points:
            break
        game = replace(
            game,
            line_score=(*game.line_score, score),
            hammers=(*game.hammers, game.last_stone),
            last_stone=hammer_after(rules, game.last_stone, score),
        )
    game = begin_end(game)
    assert game.end is not None
    delivered = draw(st.integers(0, 15))
    stones = []
    for k in range(delivered):
        team = game.end.hammer if k % 2 else game.end.hammer.other
        if draw(st.booleans()):
            stones.append(RestingStone(team, k // 2, *draw(PLACES)))
    end = replace(game.end, stones=tuple(stones), delivered=delivered)
    return replace(game, end=end, last_stone=game.end.hammer)


@given(games())
def test_a_game_is_the_same_after_its_way_over_the_wire(game):
    message = as_message(state_of(game, clock=(10.0, 20)))
    again = game_of(message, game.rules, game.lines)
    assert replace(again, end=None) == replace(game, end=None)
    assert again.end is not None
    assert game.end is not None
    assert replace(again.end, stones=()) == replace(game.end, stones=())
    for mine, theirs in zip(again.end.stones, game.end.stones, strict=True):
        assert mine[:2] == theirs[:2]
        assert mine[2:] == pytest.approx(theirs[2:], abs=1e-13)
    assert message.thinking_time_remaining == {"team0": 10.0, "team1": 20.0}


@given(games(), st.booleans())
def test_a_game_that_was_conceded_is_over(game, away):
    given_up = replace(concede(game, game.end.to_throw), end=None)
    state = state_of(given_up, reason="time_limit" if away else "concede")
    assert state["hammer"] is None
    again = game_of(as_message(state), game.rules, game.lines)
    assert (again.end, again.conceded, again.winner) == (None, given_up.conceded, given_up.winner)
    assert again.line_score == given_up.line_score


def test_an_extra_end_is_separate_in_the_protocol():
    rules = rules_of(SettingMessage(max_end=2))
    game = replace(
        new_game(rules),
        line_score=((1, 0), (0, 1), (0, 0), (0, 2)),
        hammers=(Team.AWAY, Team.AWAY, Team.HOME, Team.HOME),
        last_stone=Team.HOME,
    )
    state = state_of(game)
    assert state["scores"] == {"team0": [1, 0], "team1": [0, 1]}
    assert state.get("extra_end_score") == {"team0": 0, "team1": 2}
    assert state.get("game_result") == {"winner": "team1", "reason": "score"}
    assert state["end"] == 4
    assert game_of(as_message(state), rules, game.lines) == game


def test_a_state_without_its_scores_is_refused():
    state = state_of(begin_end(new_game(rules_of(SettingMessage(max_end=3)))))
    message = as_message({**state, "end": 2, "scores": {"team0": [0], "team1": [0]}})
    with pytest.raises(InputError, match="the scores of 2 ends"):
        game_of(
            message, rules_of(SettingMessage(max_end=3)), new_game(rules_of(SettingMessage())).lines
        )


@given(st.floats(1e-3, 6.0), st.floats(-1.5, 1.5), st.sampled_from([1, -1]))
def test_a_throw_is_the_same_after_its_way_over_the_wire(speed, angle, side):
    throw = Throw(speed=speed, angle=angle, spin=side * math.pi / 2)
    again = throw_of(move_of(throw))
    assert again is not None
    assert (again.speed, again.angle) == pytest.approx((speed, angle), rel=1e-12, abs=1e-12)
    assert again.spin == throw.spin


@given(st.floats(1e-3, 6.0), st.floats(-1.5, 1.5), st.floats(0.1, 5))
def test_the_mirrored_throw_is_the_mirrored_move(speed, angle, spin):
    move = move_of(Throw(speed=speed, angle=angle, spin=spin))
    mirrored = move_of(Throw(speed=speed, angle=-angle, spin=-spin))
    assert (move.rotation, mirrored.rotation) == ("ccw", "cw")
    assert (mirrored.velocity.x, mirrored.velocity.y) == (-move.velocity.x, move.velocity.y)


@given(st.floats(-20, 20), st.floats(-20, 20), st.text(max_size=4))
def test_any_move_is_a_throw_or_none(x, y, rotation):
    throw = throw_of(ShotMessage(velocity=Point(x, y), rotation=rotation))
    if y <= 0:
        assert throw is None
    elif throw is not None:
        assert throw.speed == pytest.approx(min(math.hypot(x, y), 6.0))
        assert (throw.spin > 0) is (rotation != "cw")


def test_a_positive_angle_goes_left_and_ccw_is_positive():
    throw = throw_of(ShotMessage(velocity=Point(-0.2, 2.3), rotation="ccw"))
    assert throw is not None
    assert throw.angle > 0
    assert throw.spin == pytest.approx(math.pi / 2)


def test_players_have_the_given_scatter():
    reported = PlayerMessage(stddev_speed=0.01, stddev_angle=0.002)
    skill = skill_of(reported)
    assert (skill.sigma_speed, skill.sigma_angle, skill.sigma_spin) == (0.01, 0.002, 0.0)
    assert skill_of(None).is_exact
    assert skill_of(PlayerMessage(type="identical", stddev_speed=1.0)).is_exact


def test_rules_follow_the_setting():
    rules = rules_of(SettingMessage(max_end=3, five_rock_rule=False))
    assert (rules.ends, rules.free_guard_until, rules.max_extra_ends) == (3, 4, 252)
    with pytest.raises(InputError, match="1 to 20 ends"):
        rules_of(SettingMessage(max_end=21))
