"""Hidden ice, twenty tracked practice throws, and what planning gains from reading the ice.

python scripts/closed_loop.py
python scripts/closed_loop.py --seed 1 --ices 6
python scripts/closed_loop.py --no-effects
python scripts/closed_loop.py --film
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from tqdm import tqdm

from agents.closed_loop.experiment import Proof, as_table, prove
from agents.closed_loop.experiment_figure import draw_proof
from agents.closed_loop.practice import film
from curling_env.commands.cli import say
from curling_env.errors import CurlingError
from curling_env.storage import make_directory, write_json


def main(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")] = Path(
        "runs/closed_loop"
    ),
    seed: Annotated[int, typer.Option(min=0, help="Of the first hidden ice.")] = 1,
    ices: Annotated[int, typer.Option(min=1, help="Hidden ices, one seed after the other.")] = 1,
    effects: Annotated[bool, typer.Option(help="Whether the hidden ice has effects.")] = True,
    skill: Annotated[str, typer.Option(help="Of the hand that throws.")] = "elite",
    from_film: Annotated[
        bool, typer.Option("--film", help="Film the practice and track the films (slow).")
    ] = False,
    workers: Annotated[int, typer.Option(min=1, help="Processes for the films.")] = 2,
    practice: Annotated[int, typer.Option(min=8, help="Practice throws.")] = 20,
    draws: Annotated[int, typer.Option(min=1)] = 10,
    guards: Annotated[int, typer.Option(min=1)] = 5,
    takeouts: Annotated[int, typer.Option(min=1)] = 5,
    trials: Annotated[int, typer.Option(min=2, help="Of each throw with execution error.")] = 24,
) -> None:
    """Practise on hidden ice, learn it, plan on what was learnt, and throw on the hidden ice."""
    folder = make_directory(output)
    proofs: list[Proof] = []
    for number in range(seed, seed + ices):
        with tqdm(
            total=100, leave=False, delay=0.5, bar_format="{desc}: {percentage:3.0f}%|{bar}|"
        ) as bar:

            def tell(what: str, part: float, bar: Any = bar, number: int = number) -> None:
                bar.set_description(f"ice {number}: {what}", refresh=False)
                bar.update(max(0, round(100 * part) - bar.n))

            films = make_directory(folder / f"films-{number}") if from_film else None
            proof = prove(
                number, effects=effects, skill=skill, practice=practice, draws=draws,
                guards=guards, takeouts=takeouts, trials=trials,
                camera=partial(film, folder=films, workers=workers) if films else None, tell=tell,
            )  # fmt: skip
        draw_proof(proof, folder / f"ice-{number}.png")
        proofs.append(proof)
        write_json(folder / "report.json", [p.as_dict() for p in proofs])
    print(as_table(proofs))
    say(f"{folder}: report.json and a figure of each ice")


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        print(f"closed_loop: {error}", file=sys.stderr)
        sys.exit(2)
