"""How long a newcomer needs from the clone to a first map: the commands of docs/start.md, timed.

python scripts/newcomer.py /tmp/newcomer

Nothing is known but the page: its blocks are run in order in a new folder, up to the first that is
not a shell's. The repository is cloned from where this script stands, as it was last committed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from website.examples import examples

ROOT = Path(__file__).parents[1]
CLONE = "curling-sheet"
CURLING = 'curling() { .venv/bin/curling "$@"; }\n'
"""What the page says that `curling` stands for."""


@dataclass(frozen=True, kw_only=True)
class Timed:
    """A block of the page that was run.

    Parameters
    ----------
    line : line of the page that it begins at
    text : its commands
    seconds : time by the clock [s]
    """

    line: int
    text: str
    seconds: float


def run_page(folder: Path) -> Iterator[Timed]:
    """Run the commands of the page in a new folder, block by block.

    Raises
    ------
    SystemExit : a block failed
    """
    folder.mkdir(parents=True)
    page = (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
    for example in examples(page):
        if example.language != "sh":
            break
        cloned = folder / CLONE
        text = example.text.replace("<this repository>", str(ROOT))
        before = time.monotonic()
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", CURLING + text],
            cwd=cloned if cloned.exists() else folder,
            env={k: v for k, v in os.environ.items() if k != "VIRTUAL_ENV"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            check=False,
        )
        if done.returncode:
            sys.exit(f"line {example.line} failed")
        yield Timed(line=example.line, text=text.strip(), seconds=time.monotonic() - before)


def main(folder: Path) -> None:
    """Print the time of each block, and the size of the map."""
    since = 0.0
    for block in run_page(folder):
        since += block.seconds
        print(
            f"line {block.line}: {block.seconds:.0f} s, {since:.0f} s since the clone", flush=True
        )
        print("    " + block.text.replace("\n", "\n    "), flush=True)
    friction = json.loads((folder / CLONE / "ice.json").read_text(encoding="utf-8"))["friction"]
    observed = sum(map(sum, friction["observed"]))
    print(f"a map of {len(friction['mu'])} rows, {observed} cells of it observed")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
