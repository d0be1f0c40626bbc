"""Where a result comes from: the version, the command, its seed, and the files that went in.

It holds no time and no place: the same inputs and seed give the same bytes, wherever they lie and
whenever they are asked.
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
_NO_MATTER = ("--output", "--report", "--workers")
"""Options that change no result: where it goes, and how many processes work on it."""


@contextmanager
def typed(arguments: Sequence[str]) -> Generator[None]:
    """Remember what was typed after `curling`, for the results of this command."""
    token = _TYPED.set(tuple(arguments))
    try:
        yield
    finally:
        _TYPED.reset(token)


def command_name() -> str:
    """The sub-command that runs; empty where a function was called from Python."""
    return next((word for word in _TYPED.get() if not word.startswith("-")), "")


def provenance(
    inputs: Iterable[str | Path | None] = (), *, seed: int | None = None
) -> dict[str, Any]:
    """Where a result comes from, as ice files and reports hold it.

    Parameters
    ----------
    inputs : files that went in; None, and names that are no files (presets), are passed over
    seed : seed of all randomness, where there is any

    Returns
    -------
    ``version`` of the package; ``command`` as typed, less the options that change no result and the
    folders of absolute paths (absent where Python was used); ``seed``; and
    ``inputs``, each with ``file`` and ``sha256`` (None for what can be read once only, a pipe)

    Raises
    ------
    InputError : a file cannot be read
    """
    record: dict[str, Any] = {"version": importlib.metadata.version("curling-sheet")}
    arguments = _TYPED.get()
    if arguments:
        record["command"] = shlex.join(["curling", *_that_matter(arguments)])
    if seed is not None:
        record["seed"] = seed
    files = [Path(name) for name in inputs if name is not None and Path(name).exists()]
    record["inputs"] = [{"file": path.name, "sha256": sha256_of(path)} for path in files]
    return record


def sha256_of(path: Path) -> str | None:
    """The SHA-256 of a file's bytes; None for a pipe or a device.

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


def _that_matter(arguments: Sequence[str]) -> list[str]:
    """Arguments without the options that change no result, and without absolute folders."""
    kept: list[str] = []
    left_out = False
    for argument in arguments:
        name, sign, value = argument.partition("=")
        if left_out:
            left_out = False
        elif argument == "-o" or argument in _NO_MATTER:
            left_out = True
        elif name in _NO_MATTER or (argument.startswith("-o") and argument[1:2] != "-"):
            continue
        elif sign and name.startswith("--"):
            kept.append(f"{name}={_name_of(value)}")
        else:
            kept.append(_name_of(argument))
    return kept


def _name_of(argument: str) -> str:
    return Path(argument).name if Path(argument).is_absolute() else argument
