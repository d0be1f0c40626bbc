"""Tasks and players of others are found by a declared name or module:Class."""

from __future__ import annotations

import importlib.metadata
import sys
from importlib.metadata import EntryPoint

import gymnasium
import pytest

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs import TASK_GROUP, task_named, task_names
from curling_env.errors import InputError
from curling_env.game import PLAYER_GROUP, player_named, player_names

MODULE = """
from dataclasses import dataclass

from curling_env.envs.sheet.tasks import TakeoutTask
from curling_env.game import Call, Player
from curling_env.throw import Throw


@dataclass(frozen=True, kw_only=True)
class OutTheBack(TakeoutTask):
    name: str = "out_the_back"
    easiest_goal: tuple[float, float] = (0.0, 0.3)


class Cautious(Player):
    name = "cautious"

    def __init__(self, speed=1.9):
        self.speed = speed

    @classmethod
    def with_option(cls, option):
        return cls(float(option))

    def call(self, view):
        return Call(throw=Throw(speed=self.speed))


nothing = 7
"""


@pytest.fixture
def club(tmp_path, monkeypatch):
    """Put a club's module, which is not installed, into the current folder."""
    (tmp_path / "our_club.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    yield tmp_path
    sys.modules.pop("our_club", None)


@pytest.fixture
def installed(club, monkeypatch):
    """Install the club's module as a package that declares a task and a player."""
    entries = {
        TASK_GROUP: [EntryPoint("out_the_back", "our_club:OutTheBack", TASK_GROUP)],
        PLAYER_GROUP: [EntryPoint("cautious", "our_club:Cautious", PLAYER_GROUP)],
    }
    sys.path.append(str(club))
    others = importlib.metadata.entry_points

    def declared(**asked):
        group = asked.get("group")
        return entries[group] if group in entries else others(**asked)

    monkeypatch.setattr("importlib.metadata.entry_points", declared)


@pytest.mark.parametrize("name", ["out_the_back", "our_club:OutTheBack"])
def test_an_environment_takes_a_task_of_others_by_name(installed, name):
    env = gymnasium.make("CurlingSheet-v0", task=name).unwrapped
    assert env.task.name == "out_the_back"
    _, info = env.reset(seed=0)
    assert info["target"] == pytest.approx((0.0, 17.3735 + 0.3))


def test_a_task_in_the_current_folder_needs_no_installation(club):
    assert task_named("our_club:OutTheBack").name == "out_the_back"
    assert "out_the_back" not in task_names()


def test_declared_names_are_listed_with_the_projects_own(installed):
    assert task_names()[-1] == "out_the_back"
    assert player_names() == ["cautious", "draw", "rulebased"]


def test_players_of_others_are_found_and_take_their_option(installed):
    assert player_named("cautious").speed == 1.9
    assert player_named("cautious:2.2").speed == 2.2
    assert player_named("our_club:Cautious").speed == 1.9
    assert player_named("our_club:Cautious:2.2").speed == 2.2


@pytest.mark.parametrize(
    ("find", "name", "complaint"),
    [
        (task_named, "wiggle", "unknown task 'wiggle'; expected one of draw, freeze, guard"),
        (task_named, "wiggle", "or module:Class"),
        (task_named, "no_such_module:Wiggle", "No module named 'no_such_module'"),
        (task_named, "no_such_module:Wiggle", "known names: draw, freeze, guard"),
        (task_named, "our_club:Wiggle", "no attribute 'Wiggle'"),
        (task_named, "our_club:nothing", "is not a task (it has no name)"),
        (player_named, "absent", "unknown player 'absent'; expected one of draw, greedy"),
        (player_named, "absent:500", "known names: draw, greedy"),
        (player_named, "our_club:nothing", "is not a player"),
        (player_named, "draw:500", "takes no option"),
    ],
)
def test_unknown_names_are_refused_with_the_known_ones(club, find, name, complaint):
    with pytest.raises(InputError) as refused:
        find(name)
    assert complaint in str(refused.value)
