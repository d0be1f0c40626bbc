"""`curling plan`: a throw that reaches its target, in words and numbers."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, load_ice, save_ice
from curling_env.physics import slide
from curling_env.throw import Throw


def test_command_prints_a_throw_that_gets_there(curling, tmp_path) -> None:
    save_ice(load_ice("standard"), tmp_path / "ice.json")
    (tmp_path / "stones.json").write_text(json.dumps([{"x": 0.3, "y": 14.4}]))
    result = curling(
        "plan", "--ice", tmp_path / "ice.json", "--target", "0.2,17.1", "--skill", "club",
        "--stones", tmp_path / "stones.json", "--picture", tmp_path / "plan.png",
    )  # fmt: skip
    assert result.status == 0
    found = result.json()
    throw = Throw(speed=found["speed"], angle=found["angle"], spin=found["spin"])
    rest = slide(load_ice("standard"), throw.release())
    assert np.hypot(rest.x - 0.2, rest.y - 17.1) < 5e-3
    assert found["expected_miss_m"] > 0.3
    assert "hog to hog" in result.err
    assert (tmp_path / "plan.png").stat().st_size > 20_000


def test_the_command_reports_assumed_and_missing_effects(curling, tmp_path) -> None:
    ice = load_ice("standard")
    believed = tuple(
        replace(e, believed=("strength",) if e.name == "curl" else ()) for e in ice.effects
    )
    marked = replace(ice, effects=(*believed, ActiveEffect(name="unknown")))
    save_ice(marked, tmp_path / "ice.json")
    call = ("plan", "--ice", tmp_path / "ice.json", "--target", "0,17.37", "--skill", "none")
    result = curling(*call)
    assert "curl is assumed, not measured" in result.err
    assert "lacks an effect" in result.err
    quiet = curling(*call, "--json")
    assert quiet.err == ""
    assert len(quiet.json()["remarks"]) == 2


def test_command_takes_a_spin_and_plays_home(curling) -> None:
    found = curling(
        "plan", "--ice", "standard", "--target=-0.5,-17", "--spin=-0.9", "--skill", "none", "--json"
    )
    assert found.json()["spin"] == -0.9
    assert found.json()["direction"] == "home"
    assert found.err == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--target", "0"], "--target: expected X,Y"),
        (["--target", "0,here"], "--target: expected X,Y"),
        (["--target", "0,40"], "off the ice"),
        ([], "nothing to plan"),
        (["--task", "spin"], "unknown task 'spin'"),
        (["--task", "takeout"], "needs a stone"),
        (["--task", "freeze", "--target", "0,25"], "off the ice"),
        (["--target", "0,17", "--skill", "god"], "unknown skill 'god'"),
        (["--target", "0,17", "--spin", "fast"], "--spin"),
        (["--target", "0,17", "--stones", "nowhere.json"], "nowhere.json"),
        (["--target", "0,17", "--picture", "nowhere/plan.png"], "nowhere"),
    ],
)
def test_command_refuses_in_one_line(curling, arguments: list[str], words: str) -> None:
    assert words in curling("plan", "--ice", "standard", *arguments).complaint


def test_score_refuses_stones_without_a_team(curling, tmp_path) -> None:
    stones = tmp_path / "stones.json"
    stones.write_text(json.dumps([{"x": 0.3, "y": 17.6, "team": "own"}, {"x": 0.9, "y": 17.6}]))
    run = curling("plan", "--ice", "standard", "--task", "score", "--stones", stones)
    assert "stone 2: no team" in run.complaint
    assert "curling stones --own" in run.complaint


def test_command_plans_a_task_and_refuses_overlapping_stones(curling, tmp_path) -> None:
    stones = tmp_path / "stones.json"
    stones.write_text(json.dumps([{"x": 0.3, "y": 17.6}, {"x": -0.4, "y": 17.0, "team": "own"}]))
    picture = tmp_path / "hit.png"
    run = curling("plan", "--ice", "standard", "--task", "hit-and-stay", "--stones", stones,
                  "--picture", picture)  # fmt: skip
    assert run.json()["task"] == "hit and stay"
    assert run.json()["stones_after"][0] is None  # the opponents', not one's own
    assert run.json()["stones_after"][1] is not None
    assert run.json()["expected_miss_m"] > 0
    assert "% succeed" in run.err
    assert picture.stat().st_size > 20_000
    stones.write_text(json.dumps([{"x": 0.3, "y": 17.6}, {"x": 0.35, "y": 17.6}]))
    overlapping = curling("plan", "--ice", "standard", "--task", "score", "--stones", stones)
    assert "stone 2 at (0.35, 17.6) m overlaps stone 1" in overlapping.complaint


@pytest.mark.parametrize(
    "text",
    [
        '[{"x": 1, "y": 1, "team": "red"}]',
        '{"x": 1}',
        '[{"x": 1}]',
        '[{"x": 1, "y": "far"}]',
        "[3]",
        "[",
    ],
)
def test_command_refuses_bad_stones(curling, tmp_path, text: str) -> None:
    (tmp_path / "s.json").write_text(text)
    result = curling("plan", "--ice", "paper", "--target", "0,17", "--stones", tmp_path / "s.json")
    assert "s.json" in result.complaint
