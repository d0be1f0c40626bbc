"""Which kind of file lies under a name, by its content: a result replaces only its own kind."""

from __future__ import annotations

import csv
import json
import os
import stat
from pathlib import Path
from typing import Any, cast

_HEAD = 4096
_WHOLE = 32 * 2**20
"""Larger files are known by their beginning alone."""

FILM_SUFFIXES = (".mp4", ".avi")
"""How the names of films that are written end."""

FILM_MARK = "made by curling-sheet"
"""What a film of this program says in its header: a film that a camera took is never replaced."""

KIND_NAMES = {
    "film": "a film of your own",
    "made film": "a film that this program made",
    "picture": "a picture",
    "page": "a page",
    "ice": "an ice",
    "scene": "a scene",
    "camera": "a camera file",
    "stones": "a list of stones",
    "tracks": "a table of tracks",
    "releases": "a table of releases",
    "table": "a table of other columns",
    "game": "a recorded game",
    "skill": "a skill file",
    "session": "a donated session",
    "archive": "a file of arrays",
    "posterior": "a file of HDF5",
    "parquet": "a Parquet table",
    "document": "another JSON document",
    "other": "another file",
}
"""What each kind is called in a message."""

_MAGIC: tuple[tuple[int, bytes, str], ...] = (
    (4, b"ftyp", "film"),
    (8, b"AVI ", "film"),
    (0, b"\x1a\x45\xdf\xa3", "film"),
    (0, b"OggS", "film"),
    (0, b"FLV", "film"),
    (0, b"\x00\x00\x01\xba", "film"),
    (0, b"\x00\x00\x01\xb3", "film"),
    (0, b"\x89PNG", "picture"),
    (0, b"\xff\xd8\xff", "picture"),
    (0, b"BM", "picture"),
    (0, b"GIF8", "picture"),
    (8, b"WEBP", "picture"),
    (0, b"II*\x00", "picture"),
    (0, b"MM\x00*", "picture"),
    (0, b"PK\x03\x04", "archive"),
    (0, b"\x89HDF", "posterior"),
    (0, b"PAR1", "parquet"),
)
_FORMATS = {
    "curling-ice": "ice",
    "curling-game": "game",
    "curling-skill": "skill",
    "curling-session": "session",
}


def kind_of(path: str | Path) -> str | None:
    """The kind of a file; None where nothing lies that could be lost.

    A missing file, an empty one, a pipe and a device have no kind. What cannot be read is of
    another kind than any result.
    """
    path = Path(path)
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode) or found.st_size == 0:
            return None
        with path.open("rb") as file:
            head = file.read(_HEAD)
            for at, magic, kind in _MAGIC:
                if head[at : at + len(magic)] == magic:
                    made = kind == "film" and FILM_MARK.encode() in head + file.read(_WHOLE)
                    return "made film" if made else kind
            start = head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]
            if start in (b"{", b"["):
                rest = file.read(_WHOLE) if found.st_size <= _WHOLE else b""
                return _kind_of_json(head + rest)
    except (OSError, ValueError):
        return "other" if os.path.lexists(path) else None
    return _kind_of_text(head)


def table_columns(path: str | Path) -> frozenset[str]:
    """The names in the first row of a table; empty where it cannot be read."""
    try:
        with Path(path).open("rb") as file:
            return frozenset(_header(file.read(_HEAD)))
    except OSError:
        return frozenset()


def document_keys(path: str | Path) -> frozenset[str]:
    """The keys of a JSON object; empty where it is none."""
    try:
        with Path(path).open("rb") as file:
            document: Any = json.loads(file.read(_WHOLE))
    except (OSError, ValueError, RecursionError):
        return frozenset()
    return (
        frozenset(cast("dict[str, Any]", document)) if isinstance(document, dict) else frozenset()
    )


def is_same_kind(new: str | Path, old: str | Path) -> bool:
    """Whether a new file is of the same kind as the one whose name it is going to take.

    Tables and JSON documents without a kind of their own are alike where the columns or keys of one
    are among those of the other. Whose films may be replaced says who writes them (`kind_of`).
    """
    before, now = kind_of(old), kind_of(new)
    if before is None or now is None:
        return True
    if before == now == "table":
        ours, theirs = table_columns(new), table_columns(old)
        return ours <= theirs or theirs <= ours
    if before == now == "document":
        ours, theirs = document_keys(new), document_keys(old)
        return bool(ours & theirs) or ours == theirs
    return before.removeprefix("made ") == now.removeprefix("made ")


def _kind_of_json(content: bytes) -> str:
    try:
        document: Any = json.loads(content)
    except (ValueError, RecursionError):
        first = content.split(b"\n", 1)[0]
        try:  # JSON lines
            document = json.loads(first)
        except (ValueError, RecursionError):
            return next((k for name, k in _FORMATS.items() if name.encode() in first), "other")
    if isinstance(document, list):
        items = cast("list[Any]", document)
        stones = all(isinstance(item, dict) and {"x", "y"} <= item.keys() for item in items)
        return "stones" if stones else "document"
    if not isinstance(document, dict):
        return "document"
    keys = cast("dict[str, Any]", document)
    name = str(keys.get("format", "")).partition("/")[0]
    if name in _FORMATS:
        return _FORMATS[name]
    if "corners_px" in keys or "points" in keys:
        return "scene"
    return "camera" if "camera_matrix" in keys else "document"


def _kind_of_text(head: bytes) -> str:
    text = head.decode("utf-8", errors="replace").lstrip("\ufeff").lstrip()
    if text[:9].lower() == "<!doctype" or text[:5].lower() == "<html":
        return "page"
    names = set(_header(head))
    if {"throw", "t", "x", "y"} <= names:
        return "tracks"
    if {"throw", "x", "y", "vx", "vy"} <= names:
        return "releases"
    return "table" if len(names) > 1 or names == {"t"} else "other"


def _header(head: bytes) -> list[str]:
    lines = head.decode("utf-8", errors="replace").lstrip("\ufeff").splitlines()
    if not lines or not lines[0].isprintable():
        return []
    try:
        return [name.strip() for name in next(csv.reader(lines[:1]), list[str]())]
    except csv.Error:
        return []
