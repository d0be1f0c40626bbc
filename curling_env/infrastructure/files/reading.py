"""Reading: bytes, text and JSON of files that strangers may have made.

Only ordinary files and pipes are read, never more of them than `limits` allow. Every fault is an
`InputError` that names its place.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import select
import stat
import time
from pathlib import Path
from typing import Any, NoReturn, cast

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.command_files import note_input

_CHUNK = 2**20
_PIPE_GLANCE = 0.25
"""How often a pipe without a writer is looked at [s]."""


def read_bytes(path: str | Path, *, most: int = limits.MAX_TEXT_BYTES) -> bytes:
    """All bytes of a file or pipe.

    Parameters
    ----------
    most : more bytes than this are refused

    Raises
    ------
    InputError : missing, a directory or device, unreadable, or too large
    """
    path = Path(path)
    try:
        # A pipe without a writer must not stop everything here.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    except FileNotFoundError as error:
        raise InputError("no such file", source=path) from error
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise InputError(f"cannot be read: {reason_of(error)}", source=path) from error
    try:
        found = os.fstat(handle)
        if stat.S_ISDIR(found.st_mode):
            raise InputError("is a directory; expected a file", source=path)
        if stat.S_ISREG(found.st_mode):
            note_input(path)
            if found.st_size > most:
                _too_large(path, most)
            return _all_of(handle, path, most)
        if stat.S_ISFIFO(found.st_mode):
            return _all_of_pipe(handle, path, most)
        raise InputError("is a device; expected an ordinary file", source=path)
    except OSError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"cannot be read: {reason_of(error)}", source=path) from error
    finally:
        os.close(handle)


def ordinary_file(path: str | Path, what: str = "file") -> Path:
    """The path of a file that a library is going to open by itself.

    Parameters
    ----------
    what : what it should be, for the message

    Raises
    ------
    InputError : missing, or a directory, pipe or device
    """
    path = Path(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError as error:
        raise InputError(f"no such {what}", source=path) from error
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {reason_of(error)}", source=path) from error
    if stat.S_ISDIR(mode):
        raise InputError(f"is a directory; expected a {what}", source=path)
    if not stat.S_ISREG(mode):
        raise InputError(f"is no ordinary file; expected a {what}", source=path)
    if not os.access(path, os.R_OK):
        raise InputError("cannot be read: permission denied", source=path)
    note_input(path)
    return path


def confined(name: str | Path, folder: Path, *, source: str | Path) -> Path:
    """A file that is named inside another file, which must lie below the same folder.

    Parameters
    ----------
    name : as the file names it
    folder : the folder of that file
    source : that file, for the message

    Raises
    ------
    InputError : it lies elsewhere, or is no ordinary file
    """
    try:
        place = (folder / name).resolve()
        inside = place.is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"names a file that cannot be found: {error}", source=source) from error
    if not inside:
        raise InputError(
            f"names a file outside its own folder: {str(name)[:80]!r}; give it on the command line",
            source=source,
        )
    return ordinary_file(place)


def read_text(path: str | Path, *, most: int = limits.MAX_TEXT_BYTES) -> str:
    """The text of a UTF-8 file.

    Raises
    ------
    InputError : see `read_bytes`, or not text
    """
    content = read_bytes(path, most=most)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("not a text file (expected UTF-8)", source=path) from error
    if "\0" in text:
        raise InputError("not a text file (it holds a zero byte)", source=path)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def file_digest(path: str | Path) -> str:
    """A short digest of the content of a text file, the same wherever the file lies.

    Raises
    ------
    InputError : see `read_text`
    """
    return hashlib.sha256(read_text(path).encode()).hexdigest()[:16]


def read_json(path: str | Path) -> Any:
    """The document of a JSON file.

    Raises
    ------
    InputError : unreadable, not JSON (with row and column), a number that is not finite or has too
        many digits, or nested too deep
    """
    return parse_json(read_text(path, most=limits.MAX_JSON_BYTES), source=path)


def parse_json(text: str | bytes, *, source: str | Path, where: str | None = None) -> Any:
    """The document that a text holds; see `read_json`.

    Parameters
    ----------
    where : the place of the text in its file; by default row and column of the fault are named
    """

    def refuse(problem: str, place: str | None = None) -> NoReturn:
        raise InputError(problem, source=source, where=where or place)

    def whole(digits: str) -> int:
        if len(digits) > limits.MAX_DIGITS:
            refuse(f"a whole number has {len(digits)} digits; {limits.MAX_DIGITS} are allowed")
        return int(digits)

    def real(digits: str) -> float:
        value = float(digits)
        if not math.isfinite(value):
            refuse(f"{digits[:20]} is too large for a number")
        return value

    try:
        document = json.loads(
            text,
            parse_constant=lambda constant: refuse(f"{constant} is not a JSON number"),
            parse_int=whole,
            parse_float=real,
        )
    except json.JSONDecodeError as error:
        refuse(f"not JSON: {error.msg}", f"row {error.lineno}, column {error.colno}")
    except UnicodeDecodeError:
        refuse("not JSON: not UTF-8")
    except RecursionError:
        refuse("not a usable JSON file: nested too deep")
    if not _is_shallow(document, limits.MAX_JSON_DEPTH):
        refuse("not a usable JSON file: nested too deep")
    return document


def reason_of(error: BaseException) -> str:
    """What the system says about a fault, in small letters."""
    said = error.strerror if isinstance(error, OSError) else None
    return (said or str(error) or type(error).__name__).lower()


def _all_of(handle: int, path: Path, most: int) -> bytes:
    parts: list[bytes] = []
    size = 0
    while part := os.read(handle, _CHUNK):
        parts.append(part)
        size += len(part)
        if size > most:  # it grew meanwhile, or its size is a lie, as in /proc
            _too_large(path, most)
    return b"".join(parts)


def _all_of_pipe(handle: int, path: Path, most: int) -> bytes:
    parts: list[bytes] = []
    size, heard = 0, time.monotonic()
    waiting = select.poll()
    waiting.register(handle, select.POLLIN)
    while True:
        events = waiting.poll(1000 * _PIPE_GLANCE)
        try:
            part = os.read(handle, _CHUNK)
        except BlockingIOError:  # somebody holds the other end, and is silent
            patience = limits.PIPE_PATIENCE
        else:
            # Nothing to read: the writer has ended, or none has come yet.
            if not part and (parts or any(event & select.POLLHUP for _, event in events)):
                return b"".join(parts)
            patience = limits.PIPE_ALONE
            if part:
                heard = time.monotonic()
                parts.append(part)
                size += len(part)
                if size > most:
                    _too_large(path, most)
        if time.monotonic() - heard > patience:
            raise InputError("nothing comes from this pipe", source=path)


def _too_large(path: Path, most: int) -> NoReturn:
    raise InputError(f"is larger than the {most / 2**20:.0f} MB that are read", source=path)


def _is_shallow(document: Any, levels: int) -> bool:
    if not isinstance(document, list | dict):
        return True
    if levels == 0:
        return False
    inner = cast("list[Any]", document if isinstance(document, list) else [*document.values()])
    return all(_is_shallow(item, levels - 1) for item in inner if isinstance(item, list | dict))
