"""Reading: bytes, text, JSON, YAML and arrays of files that strangers may have made.

Only ordinary files and pipes are read, never more of them than `limits` allow. Every fault is an
`InputError` that names its place.
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
    """All bytes of a file or pipe.

    Parameters
    ----------
    most : more bytes than this are refused

    Raises
    ------
    InputError : missing, a directory or device, unreadable, or too large
    """
    path = Path(path)
    mode = _mode_of(path, "file")
    if not stat.S_ISREG(mode) and not stat.S_ISFIFO(mode):
        raise InputError("is a device; expected an ordinary file", source=path)
    try:
        # A pipe without a writer must not stop everything here.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            size, parts = os.fstat(handle).st_size, list[bytes]()
            while size <= most and (part := _next_part(handle, path)):
                parts.append(part)
                size = max(size, sum(map(len, parts)))  # it may grow meanwhile, or claim none
        finally:
            os.close(handle)
    except OSError as error:
        raise InputError(f"cannot be read: {reason_of(error)}", source=path) from error
    if size > most:
        raise InputError(f"is larger than the {most / 2**20:.0f} MB that are read", source=path)
    if stat.S_ISREG(mode):
        note_input(path)
    return b"".join(parts)


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
    if not stat.S_ISREG(_mode_of(path, what)):
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
    if "\0" in str(name):
        raise InputError("names a file with a zero byte in its name", source=source)
    place = Path(os.path.realpath(folder / name))
    if not place.is_relative_to(os.path.realpath(folder)):
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
        problem = "nested too deep"
    except ValueError as error:  # not UTF-8, or thousands of digits
        problem = f"not JSON: {str(error).partition(';')[0]}"
    raise InputError(problem, source=source, where=where or place)


def read_yaml(path: str | Path) -> Any:
    """The document of a YAML file; needs PyYAML (the extra `train`).

    Raises
    ------
    InputError : unreadable, not YAML, too large with its aliases written out, or a number that is
        not finite
    """
    import yaml

    text = read_text(path, most=limits.MAX_YAML_BYTES)
    try:
        return _within_limits(yaml.safe_load(text), limits.MAX_YAML_NODES)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = None if mark is None else f"line {mark.line + 1}"
        raise InputError("is not YAML", source=path, where=place) from error
    except InputError as error:
        raise InputError(error.problem, source=path) from error
    except RecursionError as error:
        raise InputError("nested too deep", source=path) from error
    except (ValueError, TypeError, AttributeError, OverflowError) as error:
        # PyYAML lets the faults of what it makes out of text through.
        raise InputError(f"is not YAML that can be read: {error}", source=path) from error


def read_arrays(
    path: str | Path, *, what: str = "a file of arrays", only: Collection[str] | None = None
) -> dict[str, NDArray[Any]]:
    """The arrays of a NumPy archive (.npz) by name: numbers and text, and nothing that runs code.

    What it claims to hold is added up before anything is unpacked; its checksums are right.

    Parameters
    ----------
    what : what the file should be, for the message
    only : names of the arrays that are wanted; None for all

    Raises
    ------
    InputError : unreadable, damaged, too large, or holding anything but numbers and text
    """
    content = read_bytes(path, most=limits.MAX_ARCHIVE_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            if len(members) > limits.MAX_MEMBERS:
                raise InputError(f"holds {len(members)} arrays; {limits.MAX_MEMBERS} are read")
            size, most = sum(member.file_size for member in members), limits.MAX_ARRAY_BYTES
            if size > most:
                problem = f"holds {size / 2**20:.0f} MB unpacked; {most / 2**20:.0f} MB are read"
                raise InputError(problem)
            named = {member.filename.removesuffix(".npy"): member for member in members}
            wanted = named.keys() if only is None else named.keys() & set(only)
            return {name: _array(archive, named[name]) for name in named if name in wanted}
    except Exception as error:  # whatever a damaged zip may lead zipfile and NumPy to
        reason = str(error) or type(error).__name__
        raise InputError(f"cannot be read as {what}: {reason[:120]}", source=path) from error


# --- details -----------------------------------------------------------------------------------


def _mode_of(path: Path, what: str) -> int:
    """The kind and permissions of a file that is not a directory."""
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
    """The next bytes of a file or pipe; none at its end."""
    waiting = select.poll()
    waiting.register(handle, select.POLLIN)
    for patience in (limits.PIPE_ALONE, limits.PIPE_PATIENCE - limits.PIPE_ALONE):
        events = waiting.poll(1000 * patience)
        try:
            part = os.read(handle, _CHUNK)
        except BlockingIOError:  # someone holds the other end, and is silent
            continue
        if part or events:
            return part
        break  # no one holds it
    raise InputError("nothing comes from this pipe", source=path)


def _within_limits(document: Any, most: float = math.inf) -> Any:
    """A document that is not too deep or long, with numbers that can be used.

    Parameters
    ----------
    most : number of its entries, where one with aliases counts each time
    """
    for count, value in enumerate(_entries(document, 0), 1):
        if count > most:
            raise InputError(f"has more than {most} entries with its aliases written out")
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError("holds a number that is too large or not finite")
        if isinstance(value, int) and abs(value) > 10**limits.MAX_DIGITS:
            raise InputError(f"holds a whole number of more than {limits.MAX_DIGITS} digits")
        if isinstance(value, set):
            raise InputError("holds a set; expected lists and mappings")
    return document


def _entries(value: Any, depth: int) -> Generator[Any]:
    """All entries of lists and mappings inside one another."""
    yield value
    if isinstance(value, list | dict):
        if depth == limits.MAX_JSON_DEPTH:
            raise InputError("nested too deep")
        members = cast("list[Any]", value if isinstance(value, list) else [*value, *value.values()])
        for member in members:
            yield from _entries(member, depth + 1)


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    """One array; the end of its bytes is read, where their checksum is compared."""
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InputError("an array is compressed in a way that is not read")
    with archive.open(member) as packed:
        array: NDArray[Any] = npy_format.read_array(packed, allow_pickle=False)
        if packed.read(1):
            raise InputError("an array is not of the size that it claims")
    if array.dtype.kind not in "biufU":  # yes and no, numbers, text; no complex numbers, no objects
        raise InputError(f"an array holds {array.dtype}, neither numbers nor text")
    return array
