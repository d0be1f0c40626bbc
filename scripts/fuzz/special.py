"""What may lie under a file's name and is none: folders, pipes, devices, links in a circle."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Special:
    """What stands in the place of a file.

    Parameters
    ----------
    kind : one of `KINDS`
    """

    kind: str

    def put(self, path: Path) -> None:
        """Put it there."""
        _WAYS[self.kind](path)


def put(path: Path, content: bytes | Special) -> None:
    """Write a file, or what stands in its place."""
    if isinstance(content, Special):
        content.put(path)
    else:
        path.write_bytes(content)


def _linked_to(target: str) -> Callable[[Path], None]:
    return lambda path: os.symlink(target, path)


def _socket(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # names of sockets are short
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(2**40)


_WAYS: dict[str, Callable[[Path], object]] = {
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
    "link to itself": lambda path: os.symlink(path.name, path),
    "link to nothing": _linked_to("missing/file"),
    "forbidden": lambda path: (path.write_bytes(b"secret"), path.chmod(0)),
    "empty": Path.touch,
    "terabyte of zeros": _sparse,
}
KINDS = tuple(_WAYS)
