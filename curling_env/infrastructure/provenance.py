"""Provenance of a result: version, command, seed and input files.

It has no time and no location: the same inputs and seed give the same bytes anywhere and at any
time.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import shlex
from collections.abc import Generator, Iterable, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from curling_env.errors import InputError

_TYPED: ContextVar[tuple[str, ...]] = ContextVar("_TYPED", default=())
_IRRELEVANT_OPTIONS = ("--output", "--report", "--workers")
"""Options that do not change a result: its destination and the number of processes."""


@contextmanager
def typed(arguments: Sequence[str]) -> Generator[None]:
    """Record the words after `curling` for the results of this command."""
    token = _TYPED.set(tuple(arguments))
    try:
        yield
    finally:
        _TYPED.reset(token)


def command_name() -> str:
    """Return the name of the running sub-command; empty if a function was called from Python."""
    return next((word for word in _TYPED.get() if not word.startswith("-")), "")


def provenance(
    inputs: Iterable[str | Path | None] = (), *, seed: int | None = None
) -> dict[str, Any]:
    """Return the provenance of a result, as ice files and reports have it.

    Parameters
    ----------
    inputs : input files; None, and names that are not files (presets), are skipped
    seed : seed of all randomness, if any

    Returns
    -------
    ``version`` of the package; ``command`` as typed, without options that do not change the result
    and without folders of absolute paths (absent if called from Python); ``seed``; and ``inputs``,
    each with ``file`` and ``sha256`` (None for a pipe, which can be read only once)

    Raises
    ------
    InputError : a file cannot be read
    """
    record: dict[str, Any] = {"version": importlib.metadata.version("curling-sheet")}
    arguments = _TYPED.get()
    if arguments:
        record["command"] = shlex.join(["curling", *_relevant(arguments)])
    if seed is not None:
        record["seed"] = seed
    files = [Path(name) for name in inputs if name is not None and Path(name).exists()]
    record["inputs"] = [{"file": path.name, "sha256": sha256_of(path)} for path in files]
    return record


def sha256_of(path: Path) -> str | None:
    """Return the SHA-256 of a file's bytes; None for a pipe or a device.

    Raises
    ------
    InputError : it cannot be read
    """
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", source=path) from error


def _relevant(arguments: Sequence[str]) -> list[str]:
    """Return the arguments without options that do not change a result, and without absolute
    folders.
    """
    kept: list[str] = []
    left_out = False
    for argument in arguments:
        name, sign, value = argument.partition("=")
        if left_out:
            left_out = False
        elif argument == "-o" or argument in _IRRELEVANT_OPTIONS:
            left_out = True
        elif name in _IRRELEVANT_OPTIONS or (argument.startswith("-o") and argument[1:2] != "-"):
            continue
        elif sign and name.startswith("--"):
            kept.append(f"{name}={_name_of(value)}")
        else:
            kept.append(_name_of(argument))
    return kept


def _name_of(argument: str) -> str:
    return Path(argument).name if Path(argument).is_absolute() else argument
