"""Repeat the paper's tables 3 and 4 and draw its figures 9 and 10 (and 6, on a film).

python scripts/paper
python scripts/paper --figure6
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from tables import (
    as_text,
    draw_figure,
    repeat_table,
    save_table,
)

from curling_env.commands.cli import progress_bar, say
from curling_env.errors import CurlingError
from curling_env.infrastructure.files.storage import make_directory


def main(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")] = Path("runs/paper"),
    seed: Annotated[int, typer.Option(min=0)] = 2019,
    figure6: Annotated[bool, typer.Option(help="Also plain against pyramidal flow.")] = False,
) -> None:
    """Repeat the paper's tables 3 and 4, beside what it printed."""
    folder = make_directory(output)
    rng = np.random.default_rng(seed)
    for pitches, number, figure in ((1, 3, 9), (5, 4, 10)):
        with progress_bar("ice") as progress:
            table = repeat_table(pitches, rng, progress=progress)
        print(as_text(table), end="\n\n")
        save_table(table, folder / f"table{number}.csv")
        draw_figure(table, folder / f"figure{figure}.png")
    if figure6:
        from figure6 import draw_flow_figure

        print(draw_flow_figure(folder / "figure6.png", np.random.default_rng(seed))[0])
    say(f"tables and figures in {folder}")


if __name__ == "__main__":
    try:
        typer.run(main)
    except CurlingError as error:
        sys.exit(f"paper: {error}")
