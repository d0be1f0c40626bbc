"""In what surroundings a command may find itself: closed streams, another language, no home."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable


def surround(kind: str) -> None:
    """Change the surroundings of this process, which is about to be `curling`."""
    SURROUNDINGS[kind]()


def _closed(*streams: int) -> Callable[[], None]:
    def close() -> None:
        for number in streams:
            os.close(number)
            setattr(sys, ("stdin", "stdout", "stderr")[number], None)

    return close


def _variables(**changed: str | None) -> Callable[[], None]:
    def change() -> None:
        for name, value in changed.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value

    return change


def _spoken(encoding: str) -> Callable[[], None]:
    def change() -> None:
        for stream in (sys.stdout, sys.stderr):
            stream.reconfigure(encoding=encoding)  # pyright: ignore[reportAttributeAccessIssue]

    return change


def _piped_away() -> None:
    """A stdout that nobody reads any more, as behind `| head -1`."""
    reading, writing = os.pipe()
    os.close(reading)
    os.dup2(writing, 1)


def _full() -> None:
    """A stdout on a full disk."""
    os.dup2(os.open("/dev/full", os.O_WRONLY), 1)


SURROUNDINGS: dict[str, Callable[[], object]] = {
    "stdin closed": _closed(0),
    "stdout closed": _closed(1),
    "all streams closed": _closed(0, 1, 2),
    "stdout piped away": _piped_away,
    "stdout on a full disk": _full,
    "ASCII": _spoken("ascii"),
    "Latin-1": _spoken("latin-1"),
    "no home": _variables(HOME=None, XDG_CACHE_HOME=None),
    "no temporary folder": _variables(TMPDIR="/nonexistent"),
    "terminal of one column": _variables(COLUMNS="1", LINES="1"),
    "nothing set": os.environ.clear,
}
"""By a name that says what is odd about them."""
