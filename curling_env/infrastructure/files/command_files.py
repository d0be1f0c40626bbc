"""What a running command has read, written and made: nothing of the user's is ever destroyed.

`command_files` surrounds a command. Readers note what they read; `refuse_to_write` then decides
where may be written: never onto something that was read, and never onto a file of another kind.
Used from Python, without a command around it, only the second holds.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Generator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from curling_env.errors import OutputError
from curling_env.infrastructure.files.kinds import KIND_NAMES, kind_of

Identity = tuple[int, int]
"""Device and number of a file, the same under all its names."""


@dataclass
class CommandFiles:
    """The files and folders of a running command.

    Parameters
    ----------
    inputs : what was read, or was named to be read
    rewritten : files that are input and output by intention, such as an updated ice
    written : files that have taken their names
    made : folders that did not exist before
    kept : what is said when the command is interrupted; empty if nothing is kept
    """

    inputs: dict[Identity, Path] = field(default_factory=dict[Identity, Path])
    rewritten: set[Identity] = field(default_factory=set[Identity])
    written: list[Path] = field(default_factory=list[Path])
    made: list[Path] = field(default_factory=list[Path])
    kept: str = ""


_RUNNING: ContextVar[CommandFiles | None] = ContextVar("_RUNNING", default=None)


@contextmanager
def command_files(files: CommandFiles | None = None) -> Generator[CommandFiles]:
    """Watch over the files of one command; folders that it made and left empty vanish again."""
    files = CommandFiles() if files is None else files
    token = _RUNNING.set(files)
    try:
        yield files
    except BaseException:
        for folder in reversed(files.made):
            with suppress(OSError):
                folder.rmdir()  # refuses a folder that holds anything
        raise
    finally:
        _RUNNING.reset(token)


def note_input(path: Path) -> None:
    """Remember that the running command reads this file."""
    files = _RUNNING.get()
    known = None if files is None else identity_of(path)
    if files is not None and known is not None:
        files.inputs.setdefault(known, path)


def note_output(path: Path) -> None:
    """Remember that the running command has written this file; reading it back is no input."""
    files = _RUNNING.get()
    known = None if files is None else identity_of(path)
    if files is not None:
        files.written.append(path)
        if known is not None:
            files.inputs.pop(known, None)
            files.rewritten.add(known)


def note_rewritten(path: Path) -> None:
    """Remember that this file is input and output of the running command on purpose."""
    files = _RUNNING.get()
    known = None if files is None else identity_of(path)
    if files is not None and known is not None:
        files.rewritten.add(known)


def note_directory(path: Path) -> None:
    """Remember that the running command has made this folder."""
    files = _RUNNING.get()
    if files is not None:
        files.made.append(path)


def keep(what: str) -> None:
    """Say what an interruption of the running command leaves, and how to go on from there.

    Parameters
    ----------
    what : such as ``3 films are tracked; repeat the command to go on``
    """
    files = _RUNNING.get()
    if files is not None:
        files.kept = what


def identity_of(path: str | Path) -> Identity | None:
    """What identifies a file under all its names and links; None where there is none."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return (found.st_dev, found.st_ino)


def refuse_to_write(
    path: str | Path, *, inputs: Collection[str | Path] = (), kinds: Collection[str] = ()
) -> None:
    """Decide whether a file may be written here; returns where it may.

    Parameters
    ----------
    path : the file that is going to be written
    inputs : files that are going to be read, besides those that were
    kinds : names of `kinds` that may be replaced; empty for any

    Raises
    ------
    OutputError : it is one of the inputs, by any name or link, or a file of another kind
    """
    known = identity_of(path)
    if known is None:
        return
    files = _RUNNING.get()
    if files is not None and known in files.rewritten:
        return
    if any(identity_of(other) == known for other in inputs) or (
        files is not None and known in files.inputs
    ):
        raise OutputError(
            f"{path}: is read by this command and is not written over; give the result another name"
        )
    there = kind_of(path) if kinds else None
    if there is not None and there not in kinds:
        expected = " or ".join(KIND_NAMES.get(kind, kind) for kind in kinds)
        raise OutputError(
            f"{path}: is {KIND_NAMES.get(there, 'another file')} and is not replaced by "
            f"{expected}; give the result another name"
        )
