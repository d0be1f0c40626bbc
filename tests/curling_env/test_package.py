"""Contents of the package on import, and optional packages."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import entry_points

import numpy as np
import pytest

import curling_env
from curling_env import Ice, InputError, Release, Throw, load_ice, simulate
from curling_env.ice import ActiveEffect

WITHOUT_GYMNASIUM = """
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("gymnasium", "pettingzoo"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Refuse())
"""


def run(program: str) -> str:
    """Return the output of a program in a fresh interpreter; it must end well without
    complaints.
    """
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.mark.parametrize(
    "modules",
    ["curling_env", "friction_estimation, agents", "curling, curling_env.commands.cli"],
)
def test_importing_a_package_loads_nothing_heavy(modules):
    printed = run(
        f"import sys, {modules}\n"
        "heavy = {'PIL', 'av', 'cv2', 'jinja2', 'matplotlib', 'numba', 'pygame', 'pymunk', 'ray',\n"
        "         'scipy', 'stable_baselines3', 'starlette', 'torch'}\n"
        "print(*sorted(heavy & set(sys.modules)))\n"
    )
    assert printed == "\n"


@pytest.mark.parametrize("imports", ["import curling_env, gymnasium", "import gymnasium"])
def test_gymnasium_makes_the_environments_by_name(imports):
    prefix = "" if "curling_env" in imports else "curling_env:"
    printed = run(
        f"{imports}\n"
        "for name in ('CurlingSheet-v0', 'CurlingEnd-v0'):\n"
        f"    env = gymnasium.make('{prefix}' + name)\n"
        f"    many = gymnasium.make_vec('{prefix}' + name, num_envs=2)\n"
        "    print(env.spec.id, env.reset(seed=1)[0].shape == many.reset(seed=1)[0].shape[1:])\n"
    )
    assert printed == "CurlingSheet-v0 True\nCurlingEnd-v0 True\n"


def test_the_entry_point_registers_the_environments():
    (point,) = entry_points(group="gymnasium.envs", name="__root__")
    printed = run(
        "import gymnasium\n"
        f"import {point.module} as module\n"
        f"module.{point.attr}()\n"
        "print(*(name for name in gymnasium.registry if name.startswith('Curling')))\n"
    )
    assert printed == "CurlingSheet-v0 CurlingEnd-v0\n"


def test_physics_and_measuring_need_no_gymnasium():
    printed = run(
        f"{WITHOUT_GYMNASIUM}\n"
        "import curling_env\n"
        "import curling_env.game\n"
        "from curling_env.physics import Engine, compile_law, play_batch\n"
        "from friction_estimation import discover, estimate_ice, track_film\n"
        "print(len(curling_env.simulate('paper', [curling_env.Throw(speed=1.0)])))\n"
    )
    assert printed == "1\n"


def test_every_public_name_is_found():
    assert {name for name in curling_env.__all__ if getattr(curling_env, name) is None} == set()
    assert set(curling_env.__all__) <= set(dir(curling_env))
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = curling_env.no_such_name


def test_a_throw_is_simulated_in_one_call():
    (path,) = simulate("standard", [Throw(speed=2.1, angle=-0.05, spin=1.0)], fps=10)
    assert np.allclose(np.diff(path.t[:-1]), 0.1)
    assert path.xy[0] == pytest.approx([0, -10.9725])
    assert path.xy[-1, 1] > 10


def test_throws_and_releases_are_played_in_turn_on_ice_that_remembers():
    effect = ActiveEffect(name="pebble_wear", parameters={"rate": -0.05})
    ice, throw = load_ice("paper").with_effect(effect), Throw(speed=1.0)
    first, second, third = simulate(ice, [throw, throw.release(order=1), throw])
    assert first.xy[-1, 1] < second.xy[-1, 1] < third.xy[-1, 1]
    assert [path.throw for path in (first, third)] == [0, 2]


def test_a_throw_that_cannot_be_made_is_named():
    good, off_the_ice = Throw(speed=1.0).release(), Release(x=9.0, y=0.0, vx=0.0, vy=1.0, throw=7)
    with pytest.raises(InputError, match="throw 7"):
        simulate(Ice.uniform(0.008), [good, off_the_ice])


def test_progress_counts_the_throws():
    seen: list[tuple[float, float]] = []
    simulate(
        "paper",
        [Throw(speed=1.0)] * 3,
        progress=lambda what, done, total=1.0: seen.append((done, total)),
    )
    assert seen == [(0, 3), (1, 3), (2, 3), (3, 3)]


def test_without_pettingzoo_the_two_team_game_reports_the_missing_package():
    printed = run(
        "import sys\n"
        "sys.modules['pettingzoo'] = None\n"
        "import curling_env\n"
        "try:\n"
        "    curling_env.curling_v0\n"
        "except ModuleNotFoundError as error:\n"
        "    print(error)\n"
    )
    assert printed == "the two-team game needs PettingZoo: pip install 'curling-sheet[game]'\n"
