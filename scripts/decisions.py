"""Calls of teams in real positions compared with those of `search`, and their outcomes.

python scripts/decisions.py Stones.csv                                 150 positions of a table
python scripts/decisions.py Stones.csv --hands hands/all.skill.json --shots 1000 --json

docs/championships.md explains the columns.
"""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from agents.shots.decisions import BUDGET, decisions_of, summary_of
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
    found = decisions_of(
        read_shots(table), load_skill(hands), shots=shots, budget=search, seed=seed
    )
    summary = summary_of(found)
    if as_json:
        print_json({"summary": summary, "decisions": [asdict(one) for one in found]})
        return
    print(f"{'':28} {'calls':>6} {'agree':>7} {'cost':>7} {'others paid':>12} {'same paid':>10}")
    for situation, row in summary.items():
        cells = [
            "–" if row[name] is None else f"{100 * row[name]:.1f} %"
            for name in ("agree", "cost_of_others", "others_paid", "same_paid")
        ]
        print(
            f"{situation:28} {row['calls']:6} {cells[0]:>7} {cells[1]:>7} "
            f"{cells[2]:>12} {cells[3]:>10}"
        )


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        sys.exit(f"decisions: {error}")
