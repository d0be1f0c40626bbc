"""The file of an athlete's execution error."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from curling_env.errors import InputError
from curling_env.game import load_skill, save_skill
from curling_env.throw import SKILLS, Skill

ADA = Skill(name="Ada", sigma_speed=0.02, sigma_angle=0.004, sigma_spin=0.1, source="40 throws")


def test_written_files_are_read_back(tmp_path, must_fit):
    save_skill(ADA, tmp_path / "ada.json")
    must_fit(tmp_path / "ada.json", "skill-1")
    assert load_skill(tmp_path / "ada.json") == ADA
    tailed = replace(ADA, tails=3.5, correlation=-0.2)
    save_skill(tailed, tmp_path / "tailed.json")
    assert load_skill(tmp_path / "tailed.json") == tailed
    assert load_skill("club") is SKILLS["club"]
    assert load_skill(ADA) is ADA


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "curling-ice/1"}, "curling-skill/1"),
        ({"sigma_speed": -1}, "sigma_speed"),
        ({"sigma_speed": None}, "sigma_speed"),
        ({"bias": 1}, "bias"),
        ({"tails": 1.5}, "tails"),
        ({"tails": 2.0}, "tails"),
        ({"correlation": 1.5}, "correlation"),
    ],
)
def test_a_file_that_describes_no_skill(tmp_path, change, message):
    path = tmp_path / "ada.json"
    save_skill(ADA, path)
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | change))
    with pytest.raises(InputError, match=message):
        load_skill(path)


def test_an_unknown_name_is_refused():
    with pytest.raises(
        InputError, match="unknown skill 'clubb'; expected a skill file or one of none"
    ):
        load_skill("clubb")


def test_a_throw_is_planned_for_an_athlete(tmp_path, curling):
    save_skill(ADA, tmp_path / "ada.json")
    found = curling(
        "plan", "--ice", "standard", "--target", "0,17.3735", "--skill", tmp_path / "ada.json",
        "--spin", "1.3",
    ).json()  # fmt: skip
    elite = curling("plan", "--ice", "standard", "--target", "0,17.3735", "--spin", "1.3").json()
    assert found["expected_miss_m"] > 1.5 * elite["expected_miss_m"]
    assert (
        "unknown skill"
        in curling("plan", "--ice", "paper", "--target", "0,17", "--skill", "x").complaint
    )
