"""Commands that play games: output, files and refusals."""

from __future__ import annotations

import pytest

from agents.playing import read_record


def test_the_command_prints_the_score_and_writes_record_and_page(curling, tmp_path, must_fit):
    common = ("play", "--home", "rulebased", "--away", "draw", "--ends", "2", "--seed", "3")
    shown = curling(*common, "-o", tmp_path / "game")
    assert shown.status == 0
    assert "Total" in shown.out
    lines = read_record(tmp_path / "game" / "game.jsonl")
    must_fit(tmp_path / "game" / "game.jsonl", "game-1")
    assert (tmp_path / "game" / "game.html").read_text().startswith("<!doctype html>")
    reported = curling(*common, "--json").json()
    assert reported["line_score"] == lines[-1]["line_score"]
    assert reported["winner"] == lines[-1]["winner"]
    assert sum(end[0] for end in reported["line_score"]) == reported["score"][0]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--home", "absent", "--away", "draw"), "absent"),
        (("--home", "missing.npz", "--away", "draw"), "missing.npz"),
        (("--home", "draw", "--away", "draw", "--rules", "backyard"), "backyard"),
        (("--home", "draw", "--away", "draw", "--hammer", "ours"), "hammer"),
        (("--home", "draw", "--away", "draw", "--ice", "none.json"), "none.json"),
        (("--home", "draw", "--away", "draw", "--ends", "0"), "ends"),
    ],
)
def test_the_command_refuses_invalid_options(curling, arguments, word):
    assert word in curling("play", *arguments).complaint


def test_the_tournament_command(curling):
    reported = curling(
        "tournament", "draw", "rulebased", "--games", "4", "--ends", "1", "--json"
    ).json()
    assert {s["name"] for s in reported["standings"]} == {"draw", "rulebased"}
    for standing in reported["standings"]:
        assert standing["share_low"] <= standing["share"] <= standing["share_high"]
        assert standing["elo_low"] <= standing["elo_high"]
    shown = curling("tournament", "draw", "rulebased", "--games", "2", "--ends", "1")
    assert "Elo" in shown.out
    assert "two or more players" in curling("tournament", "draw").complaint
    assert "workers" in curling("tournament", "draw", "rulebased", "--workers", "0").complaint


def test_each_player_of_a_team_may_have_its_own_hand(tmp_path, curling):
    players = (
        "--home",
        "draw",
        "--away",
        "draw",
        "--ends",
        1,
        "--seed",
        2,
        "--still",
        "--no-sweep",
    )
    folder = tmp_path / "game"
    options = ("--rules", "mixed_doubles_2024", "--skill", "none,club", "-o", folder)
    assert curling("play", *players, *options).status == 0
    lines = read_record(folder / "game.jsonl")[1:11]
    exact = [line["meant"]["angle"] == line["thrown"]["angle"] for line in lines]
    assert exact == [True] * 2 + [False] * 6 + [True] * 2  # 1 2 2 2 1 of both teams
    problem = "expected one skill, or one for each of 2 players, got 3"
    three = ("--rules", "mixed_doubles_2024", "--skill", "none,club,elite")
    assert problem in curling("play", *players, *three).complaint
