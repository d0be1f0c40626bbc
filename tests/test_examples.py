"""Every example of every page works, on files that the pages make themselves.

`make test` reads all examples and runs those that are done in a moment; `make docs-test` runs all.
"""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import subprocess
import sys
import tomllib
import types
from pathlib import Path

import pytest
from website import desk
from website.examples import Example, examples, pages

from curling_env.physics import catalogue
from curling_env.physics.effects import unregister

ROOT = Path(__file__).parents[1]
PAGES = pages(ROOT)
ALL = os.environ.get("CURLING_EXAMPLES") == "all"
AT_ONCE = {
    *("benchmark.md", "environments.md", "for-rl.md", "science/model.md"),
    *("environments/curling-end.md", "environments/curling-game.md"),
    "environments/curling-sheet.md",
    *("how-to/own-effect.md", "how-to/own-player.md", "how-to/own-task.md"),
    *("how-to/own-tracker.md", "how-to/benchmark-row.md", "effects.md"),
}
"""Pages whose examples take a moment each; `make docs-test` also runs those of the others."""
TESTED_ELSEWHERE = {"README.md": "test_readme.py", "CONTRIBUTING.md": "test_contributing.py"}
READ = {
    "json": json.loads,
    "toml": tomllib.loads,
    "csv": lambda text: list(csv.DictReader(io.StringIO(text), strict=True)),
}
RUN = ("python", "sh")
NO_EXAMPLE = ("text", "console", "bibtex")


def of(name: str) -> list[Example]:
    return list(examples(PAGES[name].read_text(encoding="utf-8")))


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the input files that no example makes; quick examples need none."""
    folder = tmp_path_factory.mktemp("desk")
    return desk.lay_out(folder) if ALL else folder


@pytest.mark.parametrize("name", PAGES)
def test_every_block_declares_its_language_and_is_readable(name: str) -> None:
    for example in of(name):
        where = f"{name}:{example.line}"
        assert example.language in (*RUN, *READ, *NO_EXAMPLE), f"{where}: no language"
        if example.language in READ:
            assert READ[example.language](example.text), where
        elif example.language == "python":
            compile(example.text, where, "exec")


@pytest.mark.parametrize(
    "name",
    [
        name
        for name in PAGES
        if name not in TESTED_ELSEWHERE and (ALL or name in AT_ONCE) and any(
            example.language in RUN and not example.not_run for example in of(name)
        )
    ],
)  # fmt: skip
def test_the_examples_of_a_page_run_one_after_the_other(
    name: str, files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They share a folder, and those in Python their names, as a reader's would."""
    folder = shutil.copytree(files, tmp_path / "desk")
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    imported = set(sys.modules)
    page = sys.modules["page"] = types.ModuleType("page")
    effects = set(catalogue())
    try:
        for example in of(name):
            if example.not_run:
                continue
            if example.file:
                Path(example.file).write_text(example.text, encoding="utf-8")
            if example.language == "python":
                exec(compile(example.text, f"{name}:{example.line}", "exec"), page.__dict__)
            elif example.language == "sh":
                _shell(example.text, f"{name}:{example.line}")
    finally:
        for effect in set(catalogue()) - effects:
            unregister(effect)
        for module in set(sys.modules) - imported:
            if module == "page" or (folder / f"{module}.py").exists():
                del sys.modules[module]


def _shell(text: str, where: str) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", text],
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, f"{where}: {done.stderr[-2000:]}"
