"""Reading bytes, text, JSON, YAML and arrays from untrusted files.

Only ordinary files and pipes are read, within `limits`. Every error is an `InputError` that names
its place.
"""

from __future__ import annotations

import io
import json
import math
import os
import select
import stat
import zipfile
from collections.abc import Collection, Generator
from pathlib import Path
from typing import Any, NoReturn, cast

from numpy.lib import format as npy_format
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.writing import note_input, reason_of

_CHUNK = 2**20


def read_bytes(path: str | Path, *, most: int = limits.MAX_TEXT_BYTES) -> bytes:
    """Return all bytes of a file or pipe.

    Parameters
    ----------
    most : maximum number of bytes

    Raises
    ------
    InputError : missing, a directory or device, unreadable, or too large
    """
    path = Path(path)
    mode = _mode_of(path, "file")
    if not stat.S_ISREG(mode) and not stat.S_ISFIFO(mode):
        raise InputError("is a device; expected an ordinary file", source=path)
    try:
        # A pipe without a writer must not block the program.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            size, parts = os.fstat(handle).st_size, list[bytes]()
            while size <= most and (part := _next_part(handle, path)):
                parts.append(part)
                # the file may grow meanwhile, or report no size
                size = max(size, sum(map(len, parts)))
        finally:
            os.close(handle)
    except OSError as error:
        raise InputError(f"cannot be read: {reason_of(error)}", source=path) from error
    if size > most:
        raise InputError(f"is too large; expected at most {most / 2**20:.0f} MB", source=path)
    if stat.S_ISREG(mode):
        note_input(path)
    return b"".join(parts)


def ordinary_file(path: str | Path, what: str = "file") -> Path:
    """Return the path of a file that a library will open.

    Parameters
    ----------
    what : expected kind of file, for the message

    Raises
    ------
    InputError : missing, or a directory, pipe or device
    """
    path = Path(path)
    if not stat.S_ISREG(_mode_of(path, what)):
        raise InputError(f"is not an ordinary file; expected a {what}", source=path)
    if not os.access(path, os.R_OK):
        raise InputError("cannot be read: permission denied", source=path)
    note_input(path)
    return path


def confined(name: str | Path, folder: Path, *, source: str | Path) -> Path:
    """Return the path of a file that another file names; it must be in the same folder or below.

    Parameters
    ----------
    name : path as written in the file
    folder : folder of that file
    source : that file, for the message

    Raises
    ------
    InputError : the path leads elsewhere, or is not an ordinary file
    """
    if "\0" in str(name):
        raise InputError(
            "names a file with a zero byte in its name; expected a plain path", source=source
        )
    place = Path(os.path.realpath(folder / name))
    if not place.is_relative_to(os.path.realpath(folder)):
        raise InputError(
            f"names a file outside its own folder: {str(name)[:80]!r}; give it on the command line",
            source=source,
        )
    return ordinary_file(place)


def read_text(path: str | Path, *, most: int = limits.MAX_TEXT_BYTES) -> str:
    """Return the text of a UTF-8 file.

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
        raise InputError("not a text file (it contains a zero byte)", source=path)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_json(path: str | Path) -> Any:
    """Return the document of a JSON file.

    Raises
    ------
    InputError : unreadable, not JSON (with row and column), a number that is not finite or has too
        many digits, or nested too deep
    """
    return parse_json(read_text(path, most=limits.MAX_JSON_BYTES), source=path)


def parse_json(text: str | bytes, *, source: str | Path, where: str | None = None) -> Any:
    """Parse a JSON text; see `read_json`.

    Parameters
    ----------
    where : place of the text in its file; by default the row and column of the error
    """
    place = None

    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is not a JSON number")

    try:
        return _within_limits(json.loads(text, parse_constant=refuse))
    except json.JSONDecodeError as error:
        problem, place = f"not JSON: {error.msg}", f"row {error.lineno}, column {error.colno}"
    except InputError as error:
        problem = error.problem
    except RecursionError:
        problem = "nested too deeply"
    except ValueError as error:  # not UTF-8, or thousands of digits
        problem = f"not JSON: {str(error).partition(';')[0]}"
    raise InputError(problem, source=source, where=where or place)


def read_yaml(path: str | Path) -> Any:
    """Return the document of a YAML file; needs PyYAML (the extra `train`).

    Raises
    ------
    InputError : unreadable, not YAML, too large with its aliases expanded, or a number that is
        not finite
    """
    import yaml

    text = read_text(path, most=limits.MAX_YAML_BYTES)
    try:
        return _within_limits(yaml.safe_load(text), limits.MAX_YAML_NODES)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = None if mark is None else f"line {mark.line + 1}"
        raise InputError("not YAML", source=path, where=place) from error
    except InputError as error:
        raise InputError(error.problem, source=path) from error
    except RecursionError as error:
        raise InputError("nested too deeply", source=path) from error
    except (ValueError, TypeError, AttributeError, OverflowError) as error:
        # PyYAML passes on errors of the constructors that it calls.
        raise InputError(f"not readable YAML: {error}", source=path) from error


def read_arrays(
    path: str | Path, *, what: str = "a file of arrays", only: Collection[str] | None = None
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a NumPy archive (.npz) by name: numbers and text, nothing that runs
    code.

    The declared sizes are summed before anything is unpacked, and checksums are verified.

    Parameters
    ----------
    what : expected kind of file, for the message
    only : names of the arrays to read; None for all

    Raises
    ------
    InputError : unreadable, damaged, too large, or with anything but numbers and text
    """
    content = read_bytes(path, most=limits.MAX_ARCHIVE_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            if len(members) > limits.MAX_MEMBERS:
                raise InputError(
                    f"has {len(members)} arrays; expected at most {limits.MAX_MEMBERS}"
                )
            size, most = sum(member.file_size for member in members), limits.MAX_ARRAY_BYTES
            if size > most:
                problem = (
                    f"has {size / 2**20:.0f} MB unpacked; expected at most {most / 2**20:.0f} MB"
                )
                raise InputError(problem)
            named = {member.filename.removesuffix(".npy"): member for member in members}
            wanted = named.keys() if only is None else named.keys() & set(only)
            return {name: _array(archive, named[name]) for name in named if name in wanted}
    except Exception as error:  # a damaged zip may make zipfile and NumPy raise anything
        reason = str(error) or type(error).__name__
        raise InputError(f"cannot be read as {what}: {reason[:120]}", source=path) from error


# --- details -----------------------------------------------------------------------------------


def _mode_of(path: Path, what: str) -> int:
    """Return the kind and permissions of a file that is not a directory."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        missing = isinstance(error, FileNotFoundError)
        problem = f"no such {what}" if missing else f"cannot be read: {reason_of(error)}"
        raise InputError(problem, source=path) from error
    if stat.S_ISDIR(mode):
        raise InputError(f"is a directory; expected a {what}", source=path)
    return mode


def _next_part(handle: int, path: Path) -> bytes:
    """Return the next bytes of a file or pipe; empty at its end."""
    waiting = select.poll()
    waiting.register(handle, select.POLLIN)
    for patience in (limits.ORPHAN_PIPE_TIMEOUT, limits.PIPE_TIMEOUT - limits.ORPHAN_PIPE_TIMEOUT):
        events = waiting.poll(1000 * patience)
        try:
            part = os.read(handle, _CHUNK)
        except BlockingIOError:  # a writer holds the pipe open and sends nothing
            continue
        if part or events:
            return part
        break  # no writer
    raise InputError("this pipe sends nothing", source=path)


def _within_limits(document: Any, most: float = math.inf) -> Any:
    """Return a document if its depth, length and numbers are within the limits.

    Parameters
    ----------
    most : maximum number of entries, counting aliased ones each time
    """
    for count, value in enumerate(_entries(document, 0), 1):
        if count > most:
            raise InputError(
                f"has too many entries with its aliases expanded; expected at most {most}"
            )
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError("contains a number that is too large or not finite")
        if isinstance(value, int) and abs(value) > 10**limits.MAX_DIGITS:
            raise InputError(f"contains a whole number of more than {limits.MAX_DIGITS} digits")
        if isinstance(value, set):
            raise InputError("contains a set; expected lists and mappings")
    return document


def _entries(value: Any, depth: int) -> Generator[Any]:
    """Yield all entries of nested lists and mappings."""
    yield value
    if isinstance(value, list | dict):
        if depth == limits.MAX_JSON_DEPTH:
            raise InputError("nested too deeply")
        members = cast("list[Any]", value if isinstance(value, list) else [*value, *value.values()])
        for member in members:
            yield from _entries(member, depth + 1)


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    """Read one array to the end of its bytes, where the checksum is verified."""
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InputError("an array has an unsupported compression")
    with archive.open(member) as packed:
        array: NDArray[Any] = npy_format.read_array(packed, allow_pickle=False)
        if packed.read(1):
            raise InputError("the size of an array differs from its header")
    if array.dtype.kind not in "biufU":  # booleans, numbers, text; no complex numbers, no objects
        raise InputError(f"an array has type {array.dtype}; expected numbers or text")
    return array
