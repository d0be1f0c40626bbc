"""Kinds of files by their content: a result replaces only a file of the same kind."""

from __future__ import annotations

import os
import re
import stat
from contextlib import suppress
from pathlib import Path

import msgspec

from curling_env.errors import OutputError
from curling_env.infrastructure.files import limits

FILM_SUFFIXES = (".mp4", ".avi")
"""Suffixes of the films that are written."""
FILM_MARK = "made by curling-sheet"
"""Comment in the header of a film of this program; a film from a camera is never replaced."""

_BEGINNINGS = {
    "picture": (b"\x89PNG", b"\xff\xd8\xff", b"BM", b"GIF8", b"RIFF", b"II*\0", b"MM\0*"),
    "file of arrays": (b"PK\x03\x04",),
    "HDF5 file": (b"\x89HDF",),
    "Parquet table": (b"PAR1",),
    "page": (b"<!doctype", b"<!DOCTYPE", b"<html"),
}
_NAMES = {
    "film": "a film of your own",
    "made film": "a film that this program made",
    "stones": "a list of stones",
    "tracks": "a table of tracks",
    "releases": "a table of releases",
    "table": "a table with other columns",
    "other": "another file",
}

_Members = dict[str, msgspec.Raw]


def kind_of(path: str | Path) -> str | None:
    """Return the kind of a file by its content: film, made film, picture, ice, scene, tracks…

    None if there is nothing to lose: no file, an empty one, a pipe or a device. The kind of JSON
    that names a format of this program is that name. An unreadable file is `other`.
    """
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode) or found.st_size == 0:
            return None
        content = _read(path, limits.MAX_JSON_BYTES)
    except (OSError, ValueError):
        return "other" if os.path.lexists(path) else None
    if content[4:8] == b"ftyp" or content[8:12] == b"AVI ":
        return "made film" if FILM_MARK.encode() in content else "film"
    if content.startswith((b"{", b"[")):
        return _kind_of_json(content)
    columns = _columns(content)
    if {"throw", "t", "x", "y"} <= columns:
        return "tracks"
    if {"throw", "x", "y", "vx", "vy"} <= columns:
        return "releases"
    known = [kind for kind, begins in _BEGINNINGS.items() if content.startswith(begins)]
    return known[0] if known else "table" if columns else "other"


def refuse_other_kind(new: Path, old: Path) -> None:
    """Refuse to replace a file by one of another kind.

    Plain tables count as the same kind if the columns of one include those of the other.

    Raises
    ------
    OutputError : the old file is of another kind
    """
    before, now = kind_of(old), kind_of(new)
    if before is None or now is None:
        return
    alike = now.removeprefix("made ") == before.removeprefix("made ")
    if alike and now == "table":
        ours, theirs = _columns(_read(new)), _columns(_read(old))
        alike = ours <= theirs or theirs <= ours
    if not alike:
        raise other_kind(old, before, now)


def other_kind(path: str | Path, *kinds: str) -> OutputError:
    """Return the error for replacing a file of the first kind by one of the others."""
    articles = {kind: "an" if kind[0] in "aeio" else "a" for kind in kinds}
    there, *ours = [_NAMES.get(kind, f"{articles[kind]} {kind}") for kind in kinds]
    return OutputError(
        f"{path}: is {there} and is not replaced by {' or '.join(ours)}; "
        "give the result another name"
    )


def _read(path: str | Path, most: int = 4096) -> bytes:
    with open(path, "rb") as file:
        return file.read(most).removeprefix(b"\xef\xbb\xbf").lstrip()


def _columns(content: bytes) -> frozenset[str]:
    """Return the names in the first row of a table; empty if the file is no table."""
    header = next(iter(content[:4096].decode(errors="replace").splitlines()), "")
    names = frozenset(name.strip(' "') for name in header.split(","))
    is_table = header.isprintable() and (len(names) > 1 or header.strip() == "t")
    return names if is_table else frozenset()


def _kind_of_json(content: bytes) -> str:
    document: _Members | list[_Members] = {}
    for text in (content.partition(b"\n")[0], content):  # one document per line, or one in all
        with suppress(ValueError, RecursionError):
            document = msgspec.json.decode(text, type=_Members | list[_Members])
            break
    else:
        return "other"
    if isinstance(document, list):
        return "stones" if all({"x", "y"} <= item.keys() for item in document) else "other"
    named = re.fullmatch(rb'"curling-(\w+)/\d+"', bytes(document.get("format", b"")))
    if named is not None:
        return named[1].decode()
    if "corners_px" in document or "points" in document:
        return "scene"
    return "camera" if "camera_matrix" in document else "JSON document"
