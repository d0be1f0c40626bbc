"""What is told of many games, held against games made by hand."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from agents.playing import (
    Conditions,
    EndRecord,
    GameRecord,
    ShotRecord,
    WinProbability,
    calibration,
    conditions_document,
    draw_ends,
    games_in,
    kept_document,
    played_games,
    summary,
    summary_text,
)
from agents.playing.ends.summary import (
    calls_calibration,
    course,
    end_comparison,
    grades,
    shares_won,
    table_calibration,
)
from curling_env.errors import InputError
from curling_env.game import rule_set


def game(seed, scores=(1, 0, -2), *, won=True, points=(4, 3, 0), predicted=0.7):
    return GameRecord(
        seed=seed,
        ends=tuple(
            EndRecord(lead=0, ends_left=10 - k, score=score, won=won)
            for k, score in enumerate(scores)
        ),
        shots=tuple(
            ShotRecord(
                type=kind,
                grade=grade,
                left=16 - k,
                hammer=False,
                expected=0.1 * k,
                blank=0.5,
                predicted=predicted,
                won=won,
            )
            for k, (kind, grade) in enumerate(
                [("draw", points[0]), ("takeout", points[1]), ("draw", points[2]), ("", None)]
            )
        ),
    )


def test_ends_and_grades_of_all_games_are_counted():
    games = [game(k) for k in range(20)]
    assert end_comparison(games).counts.tolist() == [0, 20, 0, 20, 20, 0, 0]
    told = {one.type: one for one in grades(games)}
    assert set(told) == {"all", "slow", "hits", "lead", "first draw", "draw", "takeout"}
    assert told["hits"].shots == 20
    assert told["first draw"].mean == 100.0
    assert told["draw"].perfect == 0.5
    assert (told["draw"].mean, told["takeout"].mean, told["draw"].missed) == (50.0, 75.0, 0.5)
    assert told["all"].shots == 60
    assert told["draw"].low == told["draw"].high == 50.0  # all games are alike


def test_the_course_of_an_end_is_what_was_expected_before_each_stone_and_then_what_came():
    games = [replace(game(k, scores=(2,)), shots=game(k).shots[:3]) for k in range(4)]
    told = course(games)
    assert [one["left"] for one in told] == [16, 15, 14, 0]
    assert [one["points"] for one in told] == pytest.approx([0.0, 0.1, 0.2, 2.0])
    assert [one["blank"] for one in told] == [0.5, 0.5, 0.5, 0.0]


def test_chances_that_come_true_as_often_as_they_say_lie_on_the_diagonal():
    rng = np.random.default_rng(0)
    games = [
        game(k, won=bool(rng.random() < p), predicted=p)
        for k, p in enumerate(rng.choice([0.15, 0.55, 0.85], 600))
    ]
    found = calls_calibration(games)
    assert [one.number for one in found.bins] == [
        4 * sum(g.shots[0].predicted == p for g in games) for p in (0.15, 0.55, 0.85)
    ]
    for one in found.bins:
        assert one.low <= one.predicted <= one.high
        # Four shots of one game came true together, so the interval is that of games.
        assert one.high - one.low > 3 * 0.5 / np.sqrt(one.number)
    assert found.brier == pytest.approx(
        np.mean([p * (1 - p) for p in (0.15, 0.55, 0.85)]), abs=0.02
    )


def test_a_win_table_is_held_against_the_games():
    table = WinProbability(rule_set("world_curling_2024"))
    found = table_calibration([game(1, scores=(1,)), game(2, scores=(1,), won=False)], table)
    (one,) = found.bins
    assert (one.predicted, one.number, one.share) == (table.with_hammer(0, 10), 2, 0.5)
    level = shares_won([game(1), game(2), game(3, won=False)])[0]
    assert (level["number"], level["share"]) == (3, pytest.approx(2 / 3))
    assert shares_won([game(1)])[4]["share"] is None


def test_played_games_are_kept_and_go_on_where_they_stopped(tmp_path, monkeypatch):
    conditions, path = Conditions(ends=1, budget=10), tmp_path / "games" / "one.jsonl"
    played = []

    def fake(_conditions, seeds, **_others):
        for seed in seeds:
            played.append(seed)
            yield game(seed)

    monkeypatch.setattr("agents.playing.ends.records.play_games", fake)
    assert [g.seed for g in played_games(path, conditions, [1, 2])] == [1, 2]
    with path.open("a", encoding="utf-8") as file:
        file.write('{"seed": 3, "en')  # cut off by an interruption
    assert [g.seed for g in played_games(path, conditions, [2, 3, 4])] == [2, 3, 4]
    assert played == [1, 2, 3, 4]
    assert [g.seed for g in games_in(path)] == [1, 2, 3, 4]
    assert games_in(path)[0].ends == game(1).ends
    with pytest.raises(InputError, match="other conditions"):
        played_games(path, Conditions(ends=2, budget=10), [5])
    with pytest.raises(InputError, match="no games"):
        games_in(tmp_path / "none.jsonl")


def test_results_are_told_kept_and_drawn(tmp_path):
    path, conditions = tmp_path / "games.jsonl", Conditions()
    lines = [
        {"conditions": conditions_document(conditions)},
        *(game(k).as_dict() for k in range(5)),
    ]
    path.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    found = {"championship": summary(path, conditions)}
    assert found["championship"]["ends"] == 15
    assert found["championship"]["net"] == pytest.approx(-1 / 3)
    told = calibration([path, path])
    assert told["games"] == 10
    kept = kept_document(json.loads(json.dumps(found, allow_nan=False)), told)
    assert kept["found"]["championship"]["counts"] == [0, 5, 0, 5, 5, 0, 0]
    assert 0.5 < kept["win_table_of_search"]["level, ten ends left"] < 0.7
    draw_ends(found, told, tmp_path / "ends.png")
    assert (tmp_path / "ends.png").stat().st_size > 5_000
    text = summary_text(games_in(path))
    assert "15 ends" in text
    assert "takeout" in text
