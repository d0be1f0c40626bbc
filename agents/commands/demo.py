"""`curling demo`: the whole loop on films it makes itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import OutputDirectory, SeedOption, say


def demo(
    output: OutputDirectory = Path("runs/demo"),
    seed: SeedOption = 0,
    throws: Annotated[
        int, typer.Option(min=2, max=40, help="Practice throws to film; more show more of the ice.")
    ] = 8,
    workers: Annotated[
        int, typer.Option(min=1, max=64, help="Processes that film and track side by side.")
    ] = 2,
) -> None:
    """From film to throw, once through, in about a minute.

    Makes ice with hidden heavy and keen areas, films practice throws on it, tracks the stone,
    estimates the friction map from the tracks, plans a draw on the map, and throws it on the
    estimated and on the hidden ice. Then a curl is hidden from the model: its draw misses,
    discovery names what is missing, and the draw planned again lands. Nothing is canned: another
    --seed is another ice.

    Leaves the films, an overlay film, tracks.csv, ice.json and one page of pictures (index.html,
    page.png) in the folder, and says on stdout what it found.

    \b
    Examples:
        curling demo
        curling demo -o runs/my-demo --seed 7 --throws 12
    """
    import sys

    from tqdm import tqdm

    from agents.closed_loop.demo import run_demo
    from curling_env.storage import make_directory

    make_directory(output)  # refused before the bar begins
    layout = "{desc:38.38} {percentage:3.0f}% |{bar}| {elapsed}"
    with tqdm(total=100, leave=False, file=sys.stderr, bar_format=layout) as bar:

        def tell(what: str, part: float) -> None:
            bar.set_description_str(what, refresh=False)
            bar.update(100 * part - bar.n)

        found = run_demo(output, seed=seed, throws=throws, workers=workers, tell=tell)
    for sentence in found.sentences():
        print(sentence)
    say(f"{found.seconds:.0f} s; the page: {output / 'index.html'}")
