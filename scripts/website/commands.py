"""Page for every command, from its own help."""

from __future__ import annotations

import contextlib
import importlib.metadata
import io
import os
from unittest import mock

from curling_env.commands.cli import COMMAND_GROUP, main

GROUPS = {
    "Films and cameras": ("corners", "locate", "place-camera", "calibrate", "stones", "track",
                          "live", "join-cameras", "convert"),
    "Ice": ("estimate", "design", "compare", "discover"),
    "Coaching": ("app", "throws", "hand-or-ice", "athletes", "match-stones"),
    "Throws": ("plan", "throw", "simulate", "sweep", "film"),
    "Agents and games": ("train", "benchmark", "play", "tournament", "replay", "record-games",
                         "join", "host", "hands"),
    "The project": ("demo", "bench"),
}  # fmt: skip
"""Commands by purpose; commands of other packages are in the last group."""


def pages() -> dict[str, str]:
    """Return a page for each declared command, and their list."""
    declared = sorted(entry.name for entry in importlib.metadata.entry_points(group=COMMAND_GROUP))
    helps = {name: help_of(name) for name in declared}
    texts = {
        f"reference/commands/{name}.md": f"# curling {name}\n\n```text\n{text}\n```\n"
        for name, text in helps.items()
    }
    texts["reference/commands/index.md"] = _contents(helps)
    return texts


def help_of(*words: str) -> str:
    """Return the output of `curling WORDS --help`."""
    shown = io.StringIO()
    with mock.patch.dict(os.environ, COLUMNS="80"), contextlib.redirect_stdout(shown):
        assert main([*words, "--help"]) == 0
    return shown.getvalue().rstrip()


def _contents(helps: dict[str, str]) -> str:
    known = {name for names in GROUPS.values() for name in names}
    groups = {title: [name for name in names if name in helps] for title, names in GROUPS.items()}
    groups["The project"] += [name for name in helps if name not in known]
    lines = ["# Commands", "", "```text", help_of(), "```", ""]
    for title, names in groups.items():
        lines += [f"## {title}", ""]
        lines += [f"- [`curling {name}`]({name}.md): {_summary(helps[name])}" for name in names]
        lines += [""]
    order = [name for names in groups.values() for name in names]
    return "\n".join([*lines, "```{toctree}", ":hidden:", "", *order, "```", ""])


def _summary(text: str) -> str:
    """Return the first sentence below the usage."""
    summary = text.split("\n\n", 2)[1]
    sentence = " ".join(line.strip() for line in summary.splitlines())
    return sentence.split(". ")[0].rstrip(".") + "."
