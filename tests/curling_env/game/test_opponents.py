"""The built-in opponents need nothing but `curling_env`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import curling_env

ROOT = Path(curling_env.__file__).parents[1]


@pytest.mark.parametrize("theirs", ["agents/__init__.py", "agents.py"])
def test_a_users_own_agents_do_not_disturb_the_environments(tmp_path, theirs):
    """Many projects have a package `agents`; commands that need this project's report it."""
    mine = tmp_path / theirs
    mine.parent.mkdir(exist_ok=True)
    mine.write_text("MINE = True\n")
    script = tmp_path / "run.py"
    script.write_text(
        "import sys\n"
        # As installed from a wheel: the packages lie in a folder at the end of the path.
        "sys.meta_path = [f for f in sys.meta_path if 'editable' not in str(f).lower()]\n"
        f"sys.path.append({str(ROOT)!r})\n"
        "import agents, gymnasium as gym, curling_env\n"
        "from curling_env.errors import InputError\n"
        "assert agents.MINE\n"
        "for opponent in ('draw', 'rulebased'):\n"
        "    env = gym.make('CurlingEnd-v0', opponent=opponent, disable_env_checker=True)\n"
        "    print(env.unwrapped.opponent.name)\n"
        "try:\n"
        "    gym.make('CurlingEnd-v0', opponent='greedy')\n"
        "except InputError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    *names, complaint = done.stdout.splitlines()
    assert names == ["draw", "rulebased"]
    assert str(mine) in complaint
    assert "hides this project's package 'agents'; rename it" in complaint
