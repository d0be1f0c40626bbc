"""Unusual environments of a command: closed streams, odd variables, no home, special files."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable
from pathlib import Path


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
    """Open a stdout without a reader, as behind `| head -1`."""
    reading, writing = os.pipe()
    os.close(reading)
    os.dup2(writing, 1)


SURROUNDINGS: dict[str, Callable[[], object]] = {
    "stdin closed": _closed(0),
    "stdout closed": _closed(1),
    "all streams closed": _closed(0, 1, 2),
    "stdout piped away": _piped_away,
    "stdout on a full disk": lambda: os.dup2(os.open("/dev/full", os.O_WRONLY), 1),
    "ASCII": _spoken("ascii"),
    "Latin-1": _spoken("latin-1"),
    "no home": _variables(HOME=None, XDG_CACHE_HOME=None),
    "no temporary folder": _variables(TMPDIR="/nonexistent"),
    "terminal of one column": _variables(COLUMNS="1", LINES="1"),
    "nothing set": os.environ.clear,
}
"""Changes of the process before `curling` starts, by name."""

ODD_VALUES = ("", "0", "-1", "x", "1e9", "99999999999", "/nonexistent", "/dev/full", "é", "none")
VARIABLES = (
    *("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_CACHE_DIR"),
    *("COLUMNS", "LINES", "TERM", "LANG", "LC_ALL", "TZ"),
    *("MPLBACKEND", "MPLCONFIGDIR", "HOME", "XDG_CACHE_HOME", "TMPDIR", "NO_COLOR", "FORCE_COLOR"),
)
"""Variables that the libraries read when they are loaded: such a run starts Python again.

Those of Python itself, such as PYTHONUTF8, end it before it has read a line of the program.
"""


def _socket(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # names of sockets are short
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


def _linked_to(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(2**40)


SPECIAL: dict[str, Callable[[Path], object]] = {
    "nothing": lambda path: None,
    "folder": Path.mkdir,
    "pipe": os.mkfifo,
    "socket": _socket,
    "endless zeros": _linked_to("/dev/zero"),
    "endless noise": _linked_to("/dev/urandom"),
    "full device": _linked_to("/dev/full"),
    "nowhere": _linked_to("/dev/null"),
    "terminal": _linked_to("/dev/tty"),
    "process's own memory": _linked_to("/proc/self/mem"),
    "file of the system": _linked_to("/proc/self/environ"),
    "link to itself": lambda path: path.symlink_to(path.name),
    "link to nothing": _linked_to("missing/file"),
    "forbidden": lambda path: (path.write_bytes(b"secret"), path.chmod(0)),
    "empty": Path.touch,
    "terabyte of zeros": _sparse,
}
"""Makers of special files, by their kind."""


def put(path: Path, content: bytes | str) -> None:
    """Write a file, or a special one in its place."""
    path.unlink(missing_ok=True) if not path.is_dir() else path.rmdir()
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        SPECIAL[content](path)
