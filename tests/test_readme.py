"""The examples of the README run unchanged."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from curling_env import Direction, Throw, load_ice
from curling_env.physics import slide
from friction_estimation.synthetic import FilmSpec, render_films

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def films(tmp_path):
    """Make two short throws, filmed from above, under the names in the README."""
    ice = load_ice("standard")
    throws = [
        (Throw(speed=1.5, angle=0.02, spin=1.2), Direction.AWAY),
        (Throw(speed=1.6, angle=-0.01, spin=-1.0), Direction.HOME),
    ]
    paths = [slide(ice, throw.release(way), fps=60).trajectory for throw, way in throws]
    spec = FilmSpec(camera="gantry", size=(800, 450), fps=5.0, people=False)
    rendered = render_films(tmp_path / "films", paths, spec)
    for film, name in zip(rendered, ("first", "second"), strict=True):
        shutil.move(film, tmp_path / f"{name}.mp4")
    shutil.copy(tmp_path / "films" / "gantry.scene.json", tmp_path / "scene.json")


def test_from_film_to_throw(films, tmp_path, monkeypatch, capsys):
    code = re.search(r"```python\n(from agents.*?)```", README, re.DOTALL).group(1)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    output = capsys.readouterr().out
    x, y = map(float, re.search(r"rest at \[\s*(\S+)\s+(\S+)\s*\]", output).groups())
    assert np.hypot(x, y - 17.37) < 0.05, output


def test_every_command_it_names_exists(curling):
    listed = curling("--help").out
    for command in set(re.findall(r"`curling ([a-z][a-z-]*)", README)):
        assert re.search(rf"^\s+{command}\s", listed, re.MULTILINE), command
