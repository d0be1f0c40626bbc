"""Files of arrays (NumPy's .npz), read without trusting what they say about themselves.

Such a file is a zip, whose checksum notices a single flipped bit. What it claims to hold is added
up before anything is unpacked, and nothing in it can run code.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.reading import read_bytes
from curling_env.infrastructure.files.writing import atomic_path

_METHODS = frozenset({zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED})
_ENCRYPTED = 0x1
_CHUNK = 2**20
_LONGEST_HEADER = 2**17
"""NumPy itself reads no longer ones."""
_KINDS = "biufU"
"""Yes and no, numbers, text: neither complex numbers nor Python objects."""


def read_arrays(
    path: str | Path, *, what: str = "a file of arrays", only: Collection[str] | None = None
) -> dict[str, NDArray[Any]]:
    """The arrays of a file by name.

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
            _check(members, path)
            found: dict[str, NDArray[Any]] = {}
            for member in members:
                name = member.filename.removesuffix(".npy")
                if only is None or name in only:
                    found[name] = _array(_unpacked(archive, member))
            return found
    except InputError as error:
        if error.source is not None:
            raise
        raise InputError(f"cannot be read as {what}: {error.problem}", source=path) from error
    except Exception as error:  # whatever a damaged zip may lead zipfile and NumPy to
        said = str(error) or type(error).__name__
        raise InputError(f"cannot be read as {what}: {said[:120]}", source=path) from error


def write_arrays(path: str | Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays of numbers and text by name, complete or not at all.

    Raises
    ------
    OutputError : see `atomic_path`
    """
    with atomic_path(path) as draft, draft.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def _check(members: list[zipfile.ZipInfo], path: str | Path) -> None:
    if len(members) > limits.MAX_MEMBERS:
        raise InputError(f"holds {len(members)} arrays; {limits.MAX_MEMBERS} are read", source=path)
    size = sum(member.file_size for member in members)
    if size > limits.MAX_ARRAY_BYTES:
        raise InputError(
            f"holds {size / 2**20:.0f} MB unpacked; {limits.MAX_ARRAY_BYTES / 2**20:.0f} MB are "
            "read",
            source=path,
        )
    for member in members:
        if member.flag_bits & _ENCRYPTED or member.compress_type not in _METHODS:
            raise InputError("is encrypted or compressed in a way that is not read", source=path)


def _unpacked(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytearray:
    """The bytes of a member, which are held once; its checksum is right."""
    content = bytearray(member.file_size)
    at, place = 0, memoryview(content)
    with archive.open(member) as packed:
        while part := packed.read(min(_CHUNK, len(content) - at) or 1):
            if at + len(part) > len(content):
                raise InputError("an array is longer than it claims")
            place[at : at + len(part)] = part
            at += len(part)
    if at != len(content):
        raise InputError("an array is shorter than it claims")
    return content


def _array(content: bytearray) -> NDArray[Any]:
    """One array in its bytes, after comparing what its header claims with what there is."""
    file = io.BytesIO(memoryview(content)[:_LONGEST_HEADER])
    version = npy_format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise InputError(f"an array is of NumPy's format {version}")
    read = (
        npy_format.read_array_header_1_0
        if version == (1, 0)
        else (npy_format.read_array_header_2_0)
    )
    shape, by_column, dtype = read(file)
    if dtype.kind not in _KINDS:
        raise InputError(f"an array holds {dtype}, neither numbers nor text")
    begin, count = file.tell(), math.prod(shape)
    if any(length < 0 for length in shape) or count * dtype.itemsize != len(content) - begin:
        raise InputError("an array is not of the size that it claims")
    if not count or not dtype.itemsize:
        return np.zeros(shape, dtype)
    found = np.frombuffer(content, dtype, count=count, offset=begin)
    found = found if found.flags.aligned else found.copy()
    return found.reshape(shape, order="F" if by_column else "C")
