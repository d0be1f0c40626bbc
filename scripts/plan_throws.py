"""Plan a draw, a freeze and a takeout for players of every skill: what to throw, what to expect.

python scripts/plan_throws.py --ice ice.json -o runs/plan_throws
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from agents.planning import Plan, plan_task
from agents.planning.plan_figure import draw_plan
from curling_env.commands.cli import say
from curling_env.errors import CurlingError
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.files.storage import make_directory

SHOTS = {"draw": (0.0, 17.3735), "freeze": (0.3, 17.6), "takeout": (0.3, 17.6)}
"""Tasks with their marks: the button, and a stone behind the tee line, sheet frame [m]."""
SKILLS = ("elite", "champion", "club")
CANDIDATES = 30_000


def plans(ice: Ice, candidates: int = CANDIDATES) -> Iterator[tuple[str, str, Plan]]:
    """Plan every shot for every skill; yield task, skill and plan."""
    for task, mark in SHOTS.items():
        for skill in SKILLS:
            yield task, skill, plan_task(ice, task, mark, skill=skill, candidates=candidates)


def main(
    ice: Annotated[str, typer.Option(help="An ice file or a preset.")] = "standard",
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")] = Path(
        "runs/plan_throws"
    ),
    candidates: Annotated[int, typer.Option(min=100, help="Throws in the grid.")] = CANDIDATES,
) -> None:
    """Plan three shots for three players, and draw them."""
    known, folder = load_ice(ice), make_directory(output)
    print(f"{'shot':9}{'skill':10}{'m/s':>7}{'succeeds':>10}{'miss [m]':>10}   call")
    for task, skill, plan in plans(known, candidates):
        best = plan.best
        print(
            f"{task:9}{skill:10}{best.throw.speed:7.3f}{best.trials.success.mean():10.0%}"
            f"{best.expected_miss:10.2f}   {best.description.call}"
        )
        draw_plan(known, plan, folder / f"{task}-{skill}.png")
    say(f"{folder}: a picture of each")


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        print(f"plan_throws: {error}", file=sys.stderr)
        sys.exit(2)
