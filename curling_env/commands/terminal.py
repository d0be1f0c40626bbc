"""Results, remarks and progress on the terminal."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

from curling_env.infrastructure.files.storage import format_json
from curling_env.typing import Progress

if TYPE_CHECKING:
    from curling_env.ice import Ice

MAX_LINE = 300
"""Maximum length of an error message [characters]."""
SHARE_BAR = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}"

_HELD: ContextVar[list[str] | None] = ContextVar("_HELD", default=None)


def print_remark(text: str, *, now: bool = False) -> None:
    """Print a remark for the person at the terminal on stderr; stdout is for results.

    If stderr is no terminal, remarks are held until the command has succeeded; a command that fails
    reports only the error.

    Parameters
    ----------
    now : print it immediately in any case, because someone is waiting for it
    """
    held = _HELD.get()
    if held is not None and not now and not sys.stderr.isatty():
        held.append(text)
        return
    tqdm = sys.modules.get("tqdm")  # moves a progress bar out of the way
    (print if tqdm is None else tqdm.tqdm.write)(text, file=sys.stderr)


def conclude(document: Any, *sentences: str, as_json: bool = False) -> None:
    """Print the result of a command: its sentences on a terminal, and JSON for programs.

    If stdout is no terminal it gets the JSON, and the sentences go to stderr.

    Parameters
    ----------
    document : the result as plain numbers, lists and dictionaries
    sentences : the result for people, in one or two sentences
    as_json : print the JSON on a terminal too, and no sentence
    """
    terminal = sys.stdout.isatty()
    for sentence in () if as_json else sentences:
        (print if terminal else print_remark)(sentence)
    if as_json or not terminal:
        print_json(document)


def print_json(document: Any) -> None:
    """Print JSON on stdout, in ASCII if its encoding lacks a character."""
    text = format_json(document)
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:  # only strings contain other characters, which JSON can escape
        text = re.sub(r"[^\x00-\x7f]", lambda letter: json.dumps(letter[0])[1:-1], text)
    print(text)


def warn_about(*ices: Ice) -> None:
    """Warn on stderr, once for all ices, about effects that their tracks show and they lack."""
    from curling_env.analysis.ice_remarks import missing_effect_remarks

    for remark in dict.fromkeys(remark for ice in ices for remark in missing_effect_remarks(ice)):
        print_remark(remark)


@contextmanager
def progress_bar(unit: str = "") -> Generator[Progress]:
    """Provide a `Progress` that draws a bar on a terminal (stderr), which vanishes when done.

    Parameters
    ----------
    unit : unit of the count, such as ``frame``; a total of 1 is drawn in per cent
    """
    from tqdm import tqdm

    # Delayed, so that work that is refused or finishes at once prints only that.
    with tqdm(unit=unit, leave=False, delay=0.5, miniters=0, disable=None) as bar:

        def show(what: str, done: float, total: float = 1.0, /) -> None:
            if bar.total != (total or None):
                bar.n = bar.last_print_n = 0
                bar.total = total or None
                bar.bar_format = SHARE_BAR if total == 1.0 else None
            bar.set_description_str(what, refresh=False)
            bar.update(done - bar.n)

        yield show


@contextmanager
def remarks_at_the_end() -> Generator[None]:
    """Hold remarks back until the block has succeeded; drop them if it fails."""
    held: list[str] = []
    token = _HELD.set(held)
    try:
        yield
    finally:
        _HELD.reset(token)
    for text in held:
        print_remark(text)


def shortened(text: str) -> str:
    """Return a text as one line of at most 300 characters that any terminal can show."""
    words = " ".join(text.split())
    if len(words) > MAX_LINE:
        words = f"{words[: MAX_LINE - 70]} ... {words[-60:]}"
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in words)
