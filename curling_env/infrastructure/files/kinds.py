"""Kinds of files by their content: a result replaces only a file of its own kind."""

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
"""How the names of films that are written end."""
FILM_MARK = "made by curling-sheet"
"""Comment in the header of a film of this program: a film that a camera took is never replaced."""

_BEGINNINGS = {
    "picture": (b"\x89PNG", b"\xff\xd8\xff", b"BM", b"GIF8", b"RIFF", b"II*\0", b"MM\0*"),
    "file of arrays": (b"PK\x03\x04",),
    "HDF5 file": (b"\x89HDF",),
    "Parquet table": (b"PAR1",),
}
_KIND_NAMES = {
    "film": "a film of your own",
    "made film": "a film that this program made",
    "stones": "a list of stones",
    "tracks": "a table of tracks",
    "releases": "a table of releases",
    "table": "a table of other columns",
    "document": "another JSON document",
    "other": "another file",
}


def kind_of(path: str | Path) -> str | None:
    """The kind of a file by its content, such as film, made film, picture, ice, scene or tracks.

    None where nothing lies that could be lost: no file, an empty one, a pipe or a device. JSON that
    names a format of this program is of the kind of that name. What cannot be read is `other`.
    """
    return _described(path)[0]


def _described(path: str | Path) -> tuple[str | None, frozenset[str]]:
    """The kind of a file, and the names of its columns or members."""
    nothing: frozenset[str] = frozenset()
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode) or found.st_size == 0:
            return None, nothing
        with open(path, "rb") as file:
            content = file.read(limits.MAX_JSON_BYTES).removeprefix(b"\xef\xbb\xbf")
    except (OSError, ValueError):
        return "other" if os.path.lexists(path) else None, nothing
    if content[4:8] == b"ftyp" or content[8:12] == b"AVI ":
        return "made film" if FILM_MARK.encode() in content else "film", nothing
    for kind, beginnings in _BEGINNINGS.items():
        if content.startswith(beginnings):
            return kind, nothing
    if content.lstrip().startswith((b"{", b"[")):
        return _described_json(content)
    header = next(iter(content[:4096].decode(errors="replace").splitlines()), "")
    if header.lstrip().lower().startswith(("<!doctype", "<html")):
        return "page", nothing
    columns = frozenset(name.strip(' "') for name in header.split(","))
    if not header.isprintable() or (len(columns) < 2 and columns != frozenset({"t"})):
        return "other", nothing
    if {"throw", "t", "x", "y"} <= columns:
        return "tracks", columns
    return "releases" if {"throw", "x", "y", "vx", "vy"} <= columns else "table", columns


def _described_json(content: bytes) -> tuple[str, frozenset[str]]:
    form = dict[str, msgspec.Raw] | list[dict[str, msgspec.Raw]]
    document: dict[str, msgspec.Raw] | list[dict[str, msgspec.Raw]] | None = None
    for text in (content.partition(b"\n")[0], content):  # a document on each line, or one in all
        with suppress(ValueError, RecursionError):
            document = msgspec.json.decode(text, type=form)
            break
    if not isinstance(document, dict):
        stones = document is not None and all({"x", "y"} <= item.keys() for item in document)
        return "stones" if stones else "other", frozenset()
    named = re.fullmatch(rb'"curling-(\w+)/\d+"', bytes(document.get("format", b"")))
    if named is not None:
        return named[1].decode(), frozenset(document)
    if "corners_px" in document or "points" in document:
        return "scene", frozenset(document)
    return "camera" if "camera_matrix" in document else "document", frozenset(document)


def refuse_other_kind(draft: Path, target: Path) -> None:
    """Refuse to replace a file by one of another kind.

    Tables and JSON documents without a kind of their own are alike where the columns of one are
    among those of the other, and where they share a member.
    """
    before, theirs = _described(target)
    if before is None:
        return
    now, ours = _described(draft)
    if now is None or now.removeprefix("made ") != before.removeprefix("made "):
        alike = now is None
    elif now == "table":
        alike = ours <= theirs or theirs <= ours
    else:
        alike = now != "document" or not ours.isdisjoint(theirs)
    if not alike:
        raise other_kind(target, before, str(now))


def other_kind(path: str | Path, *kinds: str) -> OutputError:
    """The refusal to replace a file of the first kind by one of the others."""
    articles = {kind: "an" if kind[0] in "aeio" else "a" for kind in kinds}
    there, *ours = [_KIND_NAMES.get(kind, f"{articles[kind]} {kind}") for kind in kinds]
    return OutputError(
        f"{path}: is {there} and is not replaced by {' or '.join(ours)}; "
        "give the result another name"
    )
