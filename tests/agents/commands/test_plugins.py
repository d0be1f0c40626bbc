"""Commands find tasks and players in the current folder without installation."""

from __future__ import annotations

import sys

import pytest

MODULE = """
from dataclasses import dataclass

from curling_env.envs.sheet.tasks import GuardTask
from curling_env.game import Call, Player
from curling_env.throw import Throw


@dataclass(frozen=True, kw_only=True)
class LongGuard(GuardTask):
    name: str = "long_guard"
    easiest_goal: tuple[float, float] = (0.0, -4.4)


class Blaster(Player):
    name = "blaster"

    def call(self, view):
        return Call(throw=Throw(speed=3.4), shot="through the house")
"""


@pytest.fixture(autouse=True)
def club(tmp_path, monkeypatch):
    (tmp_path / "our_club.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    yield
    sys.modules.pop("our_club", None)


def test_plan_finds_the_throw_for_a_task_of_ones_own(curling):
    found = curling("plan", "--ice", "standard", "--task", "our_club:LongGuard", "--json").json()
    assert found["task"] == "long guard"
    assert found["rest"]["y"] == pytest.approx(17.3735 - 4.4, abs=1.0)


def test_a_player_of_ones_own_plays_a_game(curling):
    game = curling(
        "play", "--home", "our_club:Blaster", "--away", "draw", "--ends", "1", "--json"
    ).json()
    assert game["score"][0] == 0
    assert game["score"][1] > 0


def test_a_training_configuration_names_a_task_of_ones_own():
    pytest.importorskip("stable_baselines3")
    from agents.learning import settings_from
    from curling_env.envs import CurlingSheetEnv
    from curling_env.errors import InputError

    settings = settings_from({"env_kwargs": {"task": "our_club:LongGuard"}})
    assert CurlingSheetEnv(**settings.environment()).task.name == "long_guard"
    assert settings_from(settings.as_dict()) == settings
    missing = settings_from({"env_kwargs": {"task": "our_club:ShortGuard"}})
    with pytest.raises(InputError, match="no attribute 'ShortGuard'"):
        CurlingSheetEnv(**missing.environment())
