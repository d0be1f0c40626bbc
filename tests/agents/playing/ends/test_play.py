"""Games that are played to see how their ends are scored."""

from __future__ import annotations

import json

import pytest

from agents.playing import (
    SHOT_TYPES,
    CallingStyle,
    Conditions,
    GameRecord,
    expected_before_an_end,
    play_games,
)
from curling_env.game import TeamJudgement
from curling_env.throw import SKILLS


@pytest.fixture(scope="module")
def records():
    conditions = Conditions(
        ends=2,
        budget=30,
        judgement=TeamJudgement(weight=0.01, curl=0.05, sweep=0.5),
        calls=CallingStyle(opening_guards=1),
    )
    return list(play_games(conditions, [4, 5])), conditions


def test_a_game_keeps_its_ends_from_the_hammers_view_and_every_delivery(records):
    for game in records[0]:
        assert len(game.ends) >= 2
        # The last end stops when it is decided.
        assert 16 * (len(game.ends) - 1) < len(game.shots) <= 16 * len(game.ends)
        assert game.ends[0].lead == 0
        assert [end.ends_left for end in game.ends[:3]] == [2, 1, 0][: len(game.ends)]
        assert abs(game.ends[1].lead) == abs(game.ends[0].score)
        assert [shot.left for shot in game.shots[:3]] == [16, 15, 14]
        assert [shot.hammer for shot in game.shots[:3]] == [False, True, False]
        assert {shot.type for shot in game.shots} <= {*SHOT_TYPES, ""}
        assert all(0 <= shot.predicted <= 1 for shot in game.shots)
        assert [shot.type for shot in game.shots[:2]] == ["front", "front"]
        assert all(-6 <= shot.expected <= 6 and 0 <= shot.blank <= 1 for shot in game.shots)
        # Before the first stone the network expects what it does of any such end.
        share = expected_before_an_end(SKILLS["champion"].sigma_angle, ends_left=2)[3]
        assert game.shots[0].blank == pytest.approx(share)
        last = game.ends[-1]
        assert last.won == (last.lead + last.score > 0)


def test_a_game_follows_from_its_seed_and_comes_back_from_json(records):
    games, conditions = records
    (again,) = play_games(conditions, [5])
    assert again == games[1] != games[0]
    back = GameRecord.from_line(json.dumps(again.as_dict()))
    assert back.ends == again.ends
    assert back.as_dict() == again.as_dict()
