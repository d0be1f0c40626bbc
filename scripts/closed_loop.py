"""The closed loop, measured: hidden ice, practice throws, and what planning gains from them.

python scripts/closed_loop.py
python scripts/closed_loop.py --seed 1 --ices 6
python scripts/closed_loop.py --no-effects
python scripts/closed_loop.py --film
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from agents.closed_loop.experiment import ClosedLoopResult, as_table, run_experiment
from agents.closed_loop.experiment_figure import draw_experiment
from agents.closed_loop.practice import film_camera, noisy_camera
from curling_env.commands.cli import progress_bar, say
from curling_env.errors import CurlingError
from curling_env.infrastructure.files.storage import make_directory, write_json


def main(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")] = Path(
        "runs/closed_loop"
    ),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first hidden ice.")] = 1,
    ices: Annotated[int, typer.Option(min=1, help="Number of hidden ices, each its own seed.")] = 1,
    effects: Annotated[bool, typer.Option(help="Whether the hidden ice has effects.")] = True,
    skill: Annotated[str, typer.Option(help="Skill of the player who throws.")] = "elite",
    from_film: Annotated[
        bool, typer.Option("--film", help="Film the practice and track the films (slow).")
    ] = False,
    workers: Annotated[int, typer.Option(min=1, help="Processes for the films.")] = 2,
    practice: Annotated[int, typer.Option(min=8, help="Number of practice throws.")] = 20,
    draws: Annotated[int, typer.Option(min=1)] = 10,
    guards: Annotated[int, typer.Option(min=1)] = 5,
    takeouts: Annotated[int, typer.Option(min=1)] = 5,
    trials: Annotated[
        int, typer.Option(min=2, help="Executions with error of each planned throw.")
    ] = 24,
) -> None:
    """Practise on hidden ice, estimate it, plan on the estimate, and throw on the hidden ice."""
    folder = make_directory(output)
    results: list[ClosedLoopResult] = []
    for number in range(seed, seed + ices):
        camera = noisy_camera
        if from_film:
            films = make_directory(folder / f"films-{number}")
            camera = partial(film_camera, folder=films, workers=workers)
        with progress_bar() as progress:
            result = run_experiment(
                number,
                effects=effects,
                skill=skill,
                practice=practice,
                draws=draws,
                guards=guards,
                takeouts=takeouts,
                trials=trials,
                camera=camera,
                progress=progress,
            )
        draw_experiment(result, folder / f"ice-{number}.png")
        results.append(result)
        write_json(folder / "report.json", [r.as_dict() for r in results])
    print(as_table(results))
    say(f"{folder}: report.json and a figure of each ice")


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        print(f"closed_loop: {error}", file=sys.stderr)
        sys.exit(2)
