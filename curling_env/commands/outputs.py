"""Every output of a command is checked before its work begins.

An option that names an output is marked with `Writes` among its annotations. Every other file on
the command line is an input, and no output may be one of those.
"""

from __future__ import annotations

import functools
import inspect
import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast, get_type_hints

from curling_env.commands.terminal import say
from curling_env.errors import InputError, OutputError
from curling_env.infrastructure.files.kinds import kind_of
from curling_env.infrastructure.files.writing import (
    check_writable,
    fitted,
    identity_of,
    make_directory,
    note_input,
    note_rewritten,
)

Command = Callable[..., Any]

MAX_WHOLE = 2**53
MAX_REAL = 1e12
"""Largest numbers that an option takes, whatever it means; infinity is left to the command."""


@dataclass(frozen=True, kw_only=True)
class Writes:
    """Marks an option as the place of a result.

    Parameters
    ----------
    kinds : kinds that the result may replace (`kind_of`); empty for those of its own kind, which is
        then found out when it is written
    suffixes : how its name may end, such as .mp4; empty for any
    folder : whether it is a folder, which is made before the work
    or_folder : whether it may also be a folder, depending on the input
    rewrites : options whose file this may be on purpose, such as the ice that is updated
    beside : suffixes of files that are written beside it, and then rewritten with it
    added_by : option with which the result is added to the file instead of replacing it
    """

    kinds: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    folder: bool = False
    or_folder: bool = False
    rewrites: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    added_by: str | None = None


def guarded(command: Command) -> Command:
    """A command that refuses an impossible or harmful output before it does anything."""
    try:
        hints = get_type_hints(command, include_extras=True)
    except (NameError, TypeError):  # a command of someone else, which Typer may yet understand
        hints = {}
    outputs = {
        name: mark
        for name, hint in hints.items()
        for mark in getattr(hint, "__metadata__", ())
        if isinstance(mark, Writes)
    }

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> Any:
        given = inspect.signature(command).bind(*args, **options).arguments
        earlier = _admit(given, outputs)
        try:
            result = command(*args, **options)
        except EOFError as error:  # Typer would take it for an interrupt
            raise InputError("a file ends before it is complete") from error
        for path in earlier:
            say(f"{path}: the earlier file of this name was replaced")
        return result

    return run


def _admit(given: dict[str, Any], outputs: dict[str, Writes]) -> list[Path]:
    """Refuse what must not be written; the files that are going to be replaced."""
    inputs: dict[str, list[Path]] = {}
    for name, value in given.items():
        values = [*_each(value)]
        if any(_is_beyond_measure(one) for one in values):
            raise InputError("is a number beyond all measure", source=f"--{name.replace('_', '-')}")
        if name not in outputs:
            paths = [Path(one) for one in values if isinstance(one, str | Path) and str(one)]
            inputs[name] = [path for path in paths if identity_of(path) and not path.is_dir()]
    chosen = {name: Path(given[name]) for name in outputs if given.get(name) is not None}
    files = {
        name: path
        for name, path in chosen.items()
        if not (outputs[name].folder or (outputs[name].or_folder and path.is_dir()))
    }
    earlier: list[Path] = []
    for name, path in files.items():
        how = outputs[name]
        on_purpose = [identity_of(other) for key in how.rewrites for other in inputs.get(key, ())]
        if identity_of(path) in on_purpose:
            for one in (path, *(path.with_name(fitted(path.stem, end)) for end in how.beside)):
                note_rewritten(one)
        elif kind_of(path) is not None and not given.get(how.added_by or ""):
            earlier.append(path)
    for path in (path for paths in inputs.values() for path in paths):
        note_input(path)
    for name, path in files.items():
        how = outputs[name]
        if how.suffixes and path.suffix.lower() not in how.suffixes:
            expected = " or ".join(how.suffixes)
            raise OutputError(f"{path}: cannot be written: expected a name that ends in {expected}")
        check_writable(path, kinds=how.kinds)
    places = [os.path.realpath(path) for path in files.values()]
    for place in places:
        if places.count(place) > 1:
            raise InputError("is named for two results of one command", source=place)
    for name, path in chosen.items():
        if outputs[name].folder:
            make_directory(path)
    return earlier


def _is_beyond_measure(value: Any) -> bool:
    """Whether something is a number that nothing here can be; the command knows its own bounds."""
    if isinstance(value, float):
        return MAX_REAL < abs(value) < math.inf
    return isinstance(value, int) and abs(value) > MAX_WHOLE


def _each(value: Any) -> Iterator[Any]:
    """All values that were given for an option."""
    if isinstance(value, list | tuple):
        for item in cast("list[Any]", value):
            yield from _each(item)
    else:
        yield value
