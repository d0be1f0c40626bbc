"""Every output of a command is checked before its work begins.

An option that names an output says so with `Writes` among its annotations. Whatever else on the
command line names a file is an input, and no output may be one of those.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast, get_type_hints

from curling_env.commands.terminal import say
from curling_env.errors import InputError, OutputError
from curling_env.infrastructure.files.command_files import (
    identity_of,
    note_rewritten,
    refuse_to_write,
)
from curling_env.infrastructure.files.kinds import kind_of
from curling_env.infrastructure.files.storage import check_writable, make_directory

Command = Callable[..., Any]


MAX_WHOLE = 2**53
MAX_REAL = 1e12
"""Largest numbers that an option takes, whatever it means; infinity is left to the command."""


@dataclass(frozen=True, kw_only=True)
class Writes:
    """Marks an option as the place of a result.

    Parameters
    ----------
    kinds : names of `infrastructure.kinds` that the result may replace; empty for those of its own
        kind, which is then found out when it is written
    suffixes : how its name may end, such as .mp4; empty for any
    folder : whether it is a folder, which is made before the work
    rewrites : options whose file this may be on purpose, such as the ice that is updated
    beside : suffixes of files that are written beside it, and then rewritten with it
    added_by : option with which the result is added to the file instead of replacing it
    """

    kinds: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    folder: bool = False
    rewrites: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    added_by: str | None = None


def guarded(command: Command) -> Command:
    """A command that refuses an impossible or harmful output before it does anything."""
    outputs = _outputs_of(command)

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> Any:
        given = inspect.signature(command).bind(*args, **options).arguments
        for name, value in given.items():
            _refuse_beyond_measure(name, value)
        earlier = _admit(given, outputs)
        try:
            result = command(*args, **options)
        except EOFError as error:  # Typer would take it for an interrupt
            raise InputError("a file ends before it is complete") from error
        _say_what_was_replaced(earlier)
        return result

    return run


def _refuse_beyond_measure(name: str, value: Any) -> None:
    """Refuse a number that nothing here can be; what it may be exactly, the command knows."""
    for number in cast("list[Any]", value) if isinstance(value, list | tuple) else (value,):
        whole = isinstance(number, int) and not isinstance(number, bool)
        real = isinstance(number, float) and MAX_REAL < abs(number) < math.inf
        if real or (whole and abs(number) > MAX_WHOLE):
            raise InputError("is a number beyond all measure", source=f"--{name.replace('_', '-')}")


def _outputs_of(command: Command) -> dict[str, Writes]:
    try:
        hints = get_type_hints(command, include_extras=True)
    except (NameError, TypeError):  # a command of someone else, which Typer may yet understand
        return {}
    marks = {name: getattr(hint, "__metadata__", ()) for name, hint in hints.items()}
    return {
        name: mark for name, extras in marks.items() for mark in extras if isinstance(mark, Writes)
    }


def _admit(given: dict[str, Any], outputs: dict[str, Writes]) -> list[Path]:
    """Refuse what must not be written; the files that are going to be replaced."""
    inputs = {name: list(_files_in(value)) for name, value in given.items() if name not in outputs}
    chosen = {name: Path(given[name]) for name in outputs if given.get(name) is not None}
    earlier: list[Path] = []
    for name, path in chosen.items():
        how = outputs[name]
        if how.folder:
            continue
        on_purpose = {identity_of(other) for key in how.rewrites for other in inputs.get(key, ())}
        others = [
            other
            for files in inputs.values()
            for other in files
            if identity_of(other) not in on_purpose
        ]
        refuse_to_write(path, inputs=others)
        if how.suffixes and path.suffix.lower() not in how.suffixes:
            expected = " or ".join(how.suffixes)
            raise OutputError(f"{path}: cannot be written: expected a name that ends in {expected}")
        check_writable(path, kinds=how.kinds)
        if identity_of(path) in on_purpose:
            note_rewritten(path)
            for suffix in how.beside:
                note_rewritten(path.with_suffix(suffix))
        elif kind_of(path) is not None and not given.get(how.added_by or ""):
            earlier.append(path)
    names = [path.resolve() for name, path in chosen.items() if not outputs[name].folder]
    twice = next((path for path in names if names.count(path) > 1), None)
    if twice is not None:
        raise InputError("is named for two results of one command", source=twice)
    for name, path in chosen.items():
        if outputs[name].folder:
            make_directory(path)
    return earlier


def _files_in(value: Any) -> Iterator[Path]:
    """The files that exist among what was given for an option."""
    if isinstance(value, list | tuple):
        for item in cast("list[Any]", value):
            yield from _files_in(item)
    elif isinstance(value, str | Path) and 0 < len(str(value)) < 4096:
        path = Path(value)
        if identity_of(path) is not None and not path.is_dir():
            yield path


def _say_what_was_replaced(earlier: list[Path]) -> None:
    for path in earlier:
        say(f"{path}: the earlier file of this name was replaced")
