"""Positions placed by hand."""

from __future__ import annotations

import pytest

from agents.playing import LaidStone, Position, set_up
from curling_env.errors import InputError
from curling_env.game import GameSimulator, Team, count, direction_of, rule_set
from curling_env.sheet import TEE_Y, Direction

FOURS = rule_set("world_curling_2024")


def laid(*stones: tuple[float, float, str]) -> tuple[LaidStone, ...]:
    return tuple(LaidStone(x=x, y=y, team=Team[team.upper()]) for x, y, team in stones)


def game_of(position: Position):
    simulator = GameSimulator(rules=position.rules(FOURS))
    return set_up(simulator, position).game, simulator


@pytest.mark.parametrize("direction", list(Direction))
def test_a_position_continues_unchanged(direction):
    d = int(direction)
    stones = laid((d * 0.3, d * TEE_Y, "home"), (0.0, d * (TEE_Y - 3), "away"))
    position = Position(stones=stones, direction=direction, delivered=9, ends_left=3, score=(2, 4))
    game, _ = game_of(position)
    assert direction_of(game.end.number) is direction
    assert game.score == (2, 4)
    assert game.ends_left == 3
    assert not game.is_over
    assert game.end.to_throw is Team.HOME  # the team with the hammer throws the odd ones
    assert count(game.lines, game.end.stones) == (Team.HOME, 1)
    assert game.end.stones[0].x == pytest.approx(0.3)  # as the thrower sees it
    assert game.end.stones[0].y == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("position", "complaint"),
    [
        (Position(stones=laid((0.0, 5.0, "home")), delivered=8), "stone 1 .* is out of play"),
        (Position(stones=laid((3.0, 17.0, "home")), delivered=8), "stone 1 .* off the ice"),
        (
            Position(stones=laid((0.0, 17.0, "home"), (0.1, 17.0, "away")), delivered=8),
            "stone 2 .* overlaps stone 1",
        ),
        (Position(stones=laid((0.0, 17.0, "home")), delivered=1), "1 stones of the home team"),
        (Position(delivered=16), "expected 0 to 15 delivered stones, got 16"),
    ],
)
def test_impossible_positions_are_refused(position, complaint):
    with pytest.raises(InputError, match=complaint):
        game_of(position)


def test_impossible_games_are_refused():
    with pytest.raises(InputError, match="ends left"):
        Position(ends_left=0)
    with pytest.raises(InputError, match="0 to 99 points"):
        Position(score=(0, -1))
    doubles = GameSimulator(rules="mixed_doubles_2024")
    with pytest.raises(InputError, match="places stones itself"):
        set_up(doubles, Position())
