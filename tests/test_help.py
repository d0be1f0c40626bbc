"""The help of every command fits one screen and begins with an example."""

from __future__ import annotations

import importlib.metadata

import pytest

from curling_env.commands.cli import COMMAND_GROUP

PACKAGES = ("curling_env", "friction_estimation", "agents")
COMMANDS = sorted(
    entry.name
    for entry in importlib.metadata.entry_points(group=COMMAND_GROUP)
    if entry.module.partition(".")[0] in PACKAGES
)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_fits_one_screen_and_begins_with_an_example(
    curling, monkeypatch, name
):
    monkeypatch.setenv("COLUMNS", "100")
    lines = curling(name, "--help").out.splitlines()
    assert len(lines) <= 48
    assert max(map(len, lines)) <= 100
    usage, blank, summary, after, example, first = lines[:6]
    assert usage.startswith(f"Usage: curling {name}")
    assert (blank, after) == ("", "")
    assert summary.endswith(".")
    assert example.startswith("  Example")
    assert first.startswith(f"      curling {name}") or name in ("hand-or-ice", "stones")
