"""Command lines that nobody means: words replaced, and every option there is with odd values."""

from __future__ import annotations

import importlib.metadata
import random
from collections.abc import Sequence
from functools import cache
from typing import Any

from fuzz.mutations import NASTY_NUMBERS, NASTY_TEXTS

ODD_WORDS = (".", "/", "/dev/full", "f.mp4", "ice.json", "-o", "--", "-", "~", "o.csv", "s.json")
"""Names where something else is meant."""
MEANT = (
    *("0", "1", "2", "0.5", "-1", "3.7", "100", "1000", "0,17.4", "21.3,21.9", "44.5x4.5"),
    *("standard", "ice.json", "full.json", "t.csv", "s.json", "cam.json", "f.mp4", "e.png"),
    *("draw", "club", "feet", "none", "all", "away_tee=30,30", "curl", "found", "new.html"),
)
"""Values that some option takes."""


def odd_command_line(words: Sequence[str], rng: random.Random) -> list[str]:
    """A good command line with one to three faults.

    Parameters
    ----------
    words : the command and its good arguments
    """
    words = list(words)
    for _ in range(rng.choice((1, 1, 2, 3))):
        if rng.random() < 0.5:
            words += [rng.choice(options_of(words[0]))] * (1 + (rng.random() < 0.1))
            words += [_value(rng)] * (rng.random() < 0.9)
        elif len(words) > 1:
            k = rng.randrange(1, len(words))
            words[k] = _value(rng) if rng.random() < 0.9 else words[k] + _value(rng)
    return words


@cache
def options_of(command: str) -> list[str]:
    """The names of all options of a command, as the command itself declares them."""
    import typer.main

    from curling_env.commands.cli import COMMAND_GROUP

    declared: Any = importlib.metadata.entry_points(group=COMMAND_GROUP)
    app = typer.Typer()
    app.command()(declared[command].load())
    known: Any = typer.main.get_command(app)
    return sorted({name for option in known.params for name in option.opts if name[:1] == "-"})


def _value(rng: random.Random) -> str:
    """A value without a zero byte, which no command line can hold."""
    return rng.choice((*NASTY_NUMBERS, *NASTY_TEXTS, *ODD_WORDS, *MEANT)).replace("\0", "")
