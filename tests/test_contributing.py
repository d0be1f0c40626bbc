"""The examples in CONTRIBUTING.md do what the text around them states."""

from __future__ import annotations

import importlib
import re
import sys
import tomllib
from pathlib import Path

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


def test_the_command_reports_the_distance_of_a_slide(modules):
    import stopping
    import typer
    from typer.testing import CliRunner

    app = typer.Typer()
    app.command()(stopping.stopping)
    done = CliRunner().invoke(app, ["--ice", "paper", "--speed", "1.0"])
    assert done.exit_code == 0, done.output
    assert float(done.stdout.split()[0]) == pytest.approx(1.0**2 / (2 * 0.0019 * 9.80665), rel=0.01)
