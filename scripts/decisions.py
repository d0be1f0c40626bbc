"""Calls of teams in real positions compared with those of `search`, and their outcomes.

python scripts/decisions.py Stones.csv                                 150 positions of a table
python scripts/decisions.py Stones.csv --hands hands/all.skill.json --shots 1000 --json

docs/championships.md explains the columns.
"""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.shots.decisions import (
    BUDGET,
    decisions_of,
    power_plays_of,
    summary_of,
    summary_of_power_plays,
)
from agents.shots.table import read_shots
from curling_env.commands.cli import print_json
from curling_env.errors import CurlingError
from curling_env.game.skill_file import load_skill


def main(
    table: Annotated[Path, typer.Argument(metavar="Stones.csv", help="Table of shots.")],
    hands: Annotated[
        str, typer.Option(metavar="SKILL", help="Hands, from `curling hands` on that table.")
    ] = "championship",
    shots: Annotated[int, typer.Option(min=1, help="Number of positions.")] = 150,
    search: Annotated[int, typer.Option(min=50, help="Simulated throws a call.")] = BUDGET,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of positions.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="JSON with every decision.")] = False,
) -> None:
    """Print agreement, cost and pay of calls by situation."""
    shots_table = read_shots(table)
    found = decisions_of(shots_table, load_skill(hands), shots=shots, budget=search, seed=seed)
    summary = {
        "calls": summary_of(found),
        "power_plays": summary_of_power_plays(power_plays_of(shots_table)),
    }
    if as_json:
        print_json({**summary, "decisions": [asdict(one) for one in found]})
        return
    for title, rows in summary.items():
        names = list(next(iter(rows.values())))
        print(f"{title.replace('_', ' '):28}" + "".join(f"{name:>24}" for name in names))
        for situation, row in rows.items():
            print(f"{situation:28}" + "".join(f"{_in_words(row[name]):>24}" for name in names))


def _in_words(value: Any) -> str:
    """Return a count, a share, or a share with its interval."""
    if isinstance(value, dict):
        value, low, high = (100 * value[name] for name in ("value", "low", "high"))
        return f"{value:.1f} % ({low:.1f} to {high:.1f})"
    if value is None:
        return "–"
    return f"{100 * value:.0f} %" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        sys.exit(f"decisions: {error}")
