"""The examples in CONTRIBUTING.md do what the text around them states."""

from __future__ import annotations

import importlib
import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

TEXT = (Path(__file__).parent.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The examples as modules that can be imported, in the current folder."""
    names = []
    for source in re.findall(r"^```python\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL):
        names.append(re.match(r'"""(\w+)\.py: ', source)[1])
        (tmp_path / f"{names[-1]}.py").write_text(source, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    yield names
    for name in names:
        sys.modules.pop(name, None)


def test_every_example_is_declared_and_every_declared_one_exists(modules):
    declared = tomllib.loads(re.search(r"^```toml\n(.*?)^```$", TEXT, re.M | re.S)[1])
    points = [point for group in declared["project"]["entry-points"].values() for point in group]
    values = [
        value for group in declared["project"]["entry-points"].values() for value in group.values()
    ]
    assert len(points) == len(modules)
    assert {value.split(":")[0] for value in values} == set(modules)
    for value in values:
        module, name = value.split(":")
        assert hasattr(importlib.import_module(module), name)


def test_the_effect_brakes(modules):
    import eddy_brake

    from curling_env import Throw, load_ice, simulate
    from curling_env.ice import ActiveEffect
    from curling_env.physics import effects

    effects.register(eddy_brake.card())
    try:
        ice = load_ice("standard")
        brake = ActiveEffect(name="eddy_brake", parameters={"rate": 0.1})
        braked = replace(ice, effects=(*ice.effects, brake))
        far, near = (simulate(i, [Throw(speed=2.0)])[0].xy[-1, 1] for i in (ice, braked))
        assert near < far - 1
    finally:
        effects._cards().pop("eddy_brake")


def test_the_task_is_played(modules):
    import gymnasium
    from button_task import ButtonTask

    env = gymnasium.make("curling_env:CurlingSheet-v0", task=ButtonTask())
    env.reset(seed=1)
    *_, info = env.step(env.action_space.sample())
    assert "distance_m" in info


def test_the_player_plays(modules, curling):
    done = curling("play", "--home", "lead_player:LeadPlayer", "--away", "draw", "--ends", 1,
                   "--seed", 1, "--json")  # fmt: skip
    assert done.status == 0, done.err


def test_the_tracker_tracks(modules, tmp_path):
    from friction_estimation.tracking import load_tracker

    rows = np.column_stack([np.arange(5) / 30, np.zeros(5), np.linspace(-10, -9.5, 5)])
    np.savetxt(tmp_path / "film.txt", rows)
    track = load_tracker("club_tracker:track")(
        tmp_path / "film.mp4", None, progress=lambda *_: None
    )
    assert track.xy[-1].tolist() == [0.0, -9.5]


def test_the_command_reports_the_distance_of_a_slide(modules):
    import stopping
    import typer
    from typer.testing import CliRunner

    app = typer.Typer()
    app.command()(stopping.stopping)
    done = CliRunner().invoke(app, ["--ice", "paper", "--speed", "1.0"])
    assert done.exit_code == 0, done.output
    assert float(done.stdout.split()[0]) == pytest.approx(1.0**2 / (2 * 0.0019 * 9.80665), rel=0.01)
