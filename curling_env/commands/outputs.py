"""Check of every output of a command before its work begins.

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

from curling_env.commands.terminal import print_remark
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
"""Largest absolute value of a numeric option; infinity is checked by the command."""


@dataclass(frozen=True, kw_only=True)
class Writes:
    """Mark of an option whose value is the path of a result.

    Parameters
    ----------
    kinds : kinds of files that the result may replace (`kind_of`); empty for its own kind, which is
        then checked when it is written
    suffixes : allowed suffixes of its name, such as .mp4; empty for any
    folder : true for a folder, which is made before the work
    or_folder : true if it may also be a folder, depending on the input
    rewrites : options whose file the result may overwrite on purpose, such as the ice that is
        updated
    beside : suffixes of files that are written next to it, and overwritten with it
    added_by : option that appends the result to the file instead of replacing it
    """

    kinds: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    folder: bool = False
    or_folder: bool = False
    rewrites: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    added_by: str | None = None


def guarded(command: Command) -> Command:
    """Wrap a command so that it refuses an impossible or harmful output before it does anything."""
    try:
        hints = get_type_hints(command, include_extras=True)
    except (NameError, TypeError):  # a third party's command, which Typer may still understand
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
        earlier = _checked_outputs(given, outputs)
        try:
            result = command(*args, **options)
        except EOFError as error:  # Typer would take it for an interrupt
            raise InputError("a file ends before it is complete") from error
        for path in earlier:
            print_remark(f"{path}: the earlier file of this name was replaced")
        return result

    return run


def _checked_outputs(given: dict[str, Any], outputs: dict[str, Writes]) -> list[Path]:
    """Refuse forbidden outputs, and return the files that will be replaced."""
    inputs: dict[str, list[Path]] = {}
    for name, value in given.items():
        values = [*_each(value)]
        if any(_is_out_of_range(one) for one in values):
            raise InputError(
                f"the number is out of range; expected at most {MAX_REAL:g}",
                source=f"--{name.replace('_', '-')}",
            )
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
            raise OutputError(f"{path}: cannot be written; expected a name ending in {expected}")
        check_writable(path, kinds=how.kinds)
    places = [os.path.realpath(path) for path in files.values()]
    for place in places:
        if places.count(place) > 1:
            raise InputError(
                "is given for two results of one command; expected different files", source=place
            )
    for name, path in chosen.items():
        if outputs[name].folder:
            make_directory(path)
    return earlier


def _is_out_of_range(value: Any) -> bool:
    """Return whether a value is a number beyond any option's range; the command checks its own
    bounds.
    """
    if isinstance(value, float):
        return MAX_REAL < abs(value) < math.inf
    return isinstance(value, int) and abs(value) > MAX_WHOLE


def _each(value: Any) -> Iterator[Any]:
    """Yield all values that were given for an option."""
    if isinstance(value, list | tuple):
        for item in cast("list[Any]", value):
            yield from _each(item)
    else:
        yield value
