"""Smoke test of an installed copy, with the standard library and the copy alone.

`python smoke.py core VERSION` in an empty folder checks packages, licence, stubs, entry points, and
the steps from releases to tracks to an ice to a throw on it. `python smoke.py NAME` tries the extra
NAME. Prints nothing but errors.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from importlib import metadata, resources
from pathlib import Path

PACKAGES = ("curling_env", "friction_estimation", "agents")
RELEASES = """throw,x,y,vx,vy,theta,omega
0,-0.3,-10.9725,0.00,1.9,0,-1.2
1,-0.1,-10.9725,0.01,2.0,0,1.2
2,0.1,-10.9725,0.02,2.1,0,-1.2
3,0.3,-10.9725,0.03,2.2,0,1.2
"""
SMALL = ("--camera", "gantry", "--size", "480x270", "--fps", "6", "--noise", "0.5")
"""Options of a film with few and small frames."""


def core(version: str) -> None:
    """Check the copy itself, and the steps from throws to ice and back."""
    about = metadata.distribution("curling-sheet")
    assert about.version == version, about.version
    assert about.metadata["License-Expression"] == "MIT"
    assert any(str(path).endswith("licenses/LICENSE") for path in about.files or ())
    for name in PACKAGES:
        package = importlib.import_module(name)
        assert "site-packages" in str(package.__file__), package.__file__
        assert (resources.files(name) / "py.typed").is_file(), f"{name} has no py.typed"
    assert importlib.import_module("curling_env").__version__ == version
    for point in about.entry_points:
        if point.group.startswith(("curling.", "gymnasium.", "console_")):
            point.load()
    light = "import sys, curling_env\nassert not {'cv2', 'av', 'torch'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", light], check=True)
    _from_throws_to_a_throw()
    import gymnasium

    env = gymnasium.make("CurlingSheet-v0")
    env.reset(seed=1)
    assert env.step(env.action_space.sample())[0].shape == env.observation_space.shape


def _from_throws_to_a_throw() -> None:
    Path("r.csv").write_text(RELEASES)
    curling("simulate", "--ice", "standard", "--releases", "r.csv", "-o", "t.csv")
    curling("estimate", "t.csv", "-o", "ice.json", "--uniform", "--effects", "none")
    rest = curling("throw", "--ice", "ice.json", "--speed", "2.1", "--spin", "1.5", "--angle", "0")
    assert 5 < rest["y"] < 30, rest


def curling(*words: str) -> dict:
    """Return the JSON result of a command."""
    program = Path(sys.executable).with_name("curling")
    done = subprocess.run([program, *words], capture_output=True, text=True)
    assert done.returncode == 0, f"curling {' '.join(words)}: {done.stderr}"
    return json.loads(done.stdout) if done.stdout.strip() else {}


def film() -> None:
    """Render a film, track it, write its report, and play a game: everything beyond `core`."""
    Path("one.csv").write_text("throw,x,y,vx,vy,theta,omega\n0,0.2,-2.0,0.0,1.7,0.0,1.2\n")
    curling("film", "--ice", "standard", "--releases", "one.csv", "-o", "films", *SMALL)
    curling("track", "films/gantry-0.mp4", "--scene", "films/gantry.scene.json", "-o", "f.csv")
    curling("estimate", "f.csv", "--uniform", "-o", "f.json", "--report", "report")
    assert Path("report/report.html").is_file()
    curling("play", "--home", "draw", "--away", "rulebased", "--ends", "1", "--json")


def train() -> None:
    from curling_env.envs.stable_baselines import CurlingVecEnv

    ppo = importlib.import_module("stable_baselines3").PPO
    env = CurlingVecEnv("CurlingSheet-v0", n_envs=2)
    ppo("MlpPolicy", env, n_steps=2, batch_size=4, n_epochs=1, device="cpu").learn(4)


def viewer() -> None:
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    import gymnasium

    import curling_env  # noqa: F401

    env = gymnasium.make("CurlingSheet-v0", render_mode="human")
    env.reset(seed=1)
    env.step(env.action_space.sample())
    env.close()


def game() -> None:
    import curling_env

    curling_env.curling_v0.env().reset(seed=1)


def parquet() -> None:
    from curling_env.infrastructure.files.storage import write_table

    write_table("t.parquet", {"a": [1, 2, 3]})
    assert importlib.import_module("pyarrow.parquet").read_table("t.parquet").num_rows == 3


IMPORTED = {
    "ray": ("curling_env.infrastructure.ray_cluster",),
    "rllib": ("ray.rllib.algorithms.ppo", "agents.learning.rllib"),
    "digital-curling": ("agents.digital_curling.dc4.application",
                        "agents.digital_curling.dc4.web_host"),
    "app": ("agents.app.application", "agents.app.serve"),
    "science": ("h5netcdf", "h5py", "friction_estimation.discovery.posterior_file"),
    "offline": ("minari", "agents.playing.offline_data"),
}  # fmt: skip
"""Modules that need each extra."""
TRIED = {"core": core, "film": film, "train": train, "viewer": viewer, "game": game,
         "parquet": parquet}  # fmt: skip


if __name__ == "__main__":
    what, *given = sys.argv[1:]
    for module in IMPORTED.get(what, ()):
        importlib.import_module(module)
    if what not in IMPORTED:
        TRIED[what](*given)
