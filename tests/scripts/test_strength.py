"""Games against the player of an earlier commit: its process, what is kept, and what is told."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest
import strength

from curling_env.errors import InputError

PLAYER = """
from curling_env.game import Call, Player
from curling_env.throw import Throw

class Lead(Player):
    name = "lead"

    def call(self, view):
        return Call(throw=Throw(speed={speed}, angle=-0.0543, spin=1.571), shot="through {place}")
"""


@pytest.fixture
def earlier(tmp_path, monkeypatch):
    """A player of this checkout, and one of the same name with the code of "commit" abc."""
    monkeypatch.setattr(strength, "CHECKOUTS", tmp_path / "checkouts")
    monkeypatch.syspath_prepend(str(tmp_path))
    folder = tmp_path / "checkouts" / "abc"
    folder.mkdir(parents=True)
    for place, speed in ((tmp_path, 2.3935), (folder, 3.5)):
        (place / "lead_of_test.py").write_text(PLAYER.format(speed=speed, place=place.name))
    yield "lead_of_test:Lead"
    sys.modules.pop("lead_of_test", None)


def test_a_player_of_a_commit_plays_with_that_code(earlier):
    simulator = strength.simulator_of("digital_curling", 1)
    view = simulator.view(simulator.begin_end(simulator.new_game(0)))
    own, other = strength.player_of(earlier), strength.player_of(f"{earlier}@abc")
    assert own.call(view).throw.speed == 2.3935
    call = other.call(view)
    assert (call.throw.speed, call.shot) == (3.5, "through abc")
    assert not other.concedes(view)
    assert [player.calls for player in (own, other)] == [1, 1]
    assert other.seconds > 0.0


def test_games_are_kept_and_gone_on_from(earlier, tmp_path, monkeypatch, capsys):
    kept = tmp_path / "games.jsonl"
    words = ["strength.py", earlier, f"{earlier}@abc", "--ends", "1", "--keep", str(kept)]
    monkeypatch.setattr(sys, "argv", [*words, "--games", "1"])
    strength.main()
    (first,) = kept.read_text().splitlines()
    monkeypatch.setattr(sys, "argv", [*words, "--games", "3"])
    strength.main()
    rows = kept.read_text().splitlines()
    assert rows[0] == first
    games = [json.loads(row) for row in rows]
    # Who throws all stones through the house scores nothing.
    assert [game["won"] for game in games] == [1.0, 1.0, 1.0]
    assert all(game["calls"][0] >= 8 and game["points"][1] == 0 for game in games)
    assert f"{earlier} won 3 of 3 against {earlier}@abc" in capsys.readouterr().out


def test_a_commit_is_unpacked_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(name)
    who = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    (tmp_path / "code.py").write_text("one")
    for words in (["init", "-q"], ["add", "code.py"], [*who, "commit", "-q", "-m", "one"]):
        subprocess.run(["git", *words], check=True)
    folder = strength.unpacked("HEAD")
    assert (folder / "code.py").read_text() == "one"
    (folder / "code.py").write_text("kept")
    assert (strength.unpacked("HEAD") / "code.py").read_text() == "kept"
    with pytest.raises(InputError, match="no commit 'abc'"):
        strength.unpacked("abc")
