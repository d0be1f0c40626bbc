"""Drafts: hidden files in the folder of a result, and what killed processes left of them.

A draft's name tells who writes it. So what ended processes left can be cleared, and nothing that
another one is still writing.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import secrets
import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

_MACHINE = hashlib.sha256(platform.node().encode()).hexdigest()[:4]
_DRAFT = re.compile(r"\..*~([0-9a-f]{4})-(\d+)-[0-9a-f]{8}(\.[^.~]*)?")
"""A hidden name with the machine and the process that writes, and something random."""
NAMES_SUFFIX = ".names"
"""Of the list of names that the drafts of a complete result are going to take."""
FOLDER_SUFFIX = ".drafts"
"""Of a hidden folder in which a whole result is made."""

_SETTLED: set[Path] = set()
"""Folders in which this process has looked for what a killed one left."""


def draft_in(directory: Path, stem: str, suffix: str) -> Path:
    """A new name for a draft of this process.

    Parameters
    ----------
    stem, suffix : of the file that it will be
    """
    # Forty characters of four bytes each leave room for the rest within a name's 255.
    own = f"{_MACHINE}-{os.getpid()}-{secrets.token_hex(4)}"
    return directory / f".{stem[:40]}~{own}{suffix if len(suffix) < 16 else ''}"


def finish_interrupted(directory: Path) -> None:
    """Clear what killed processes left in a folder, and give complete results their names.

    Only files that this user made on this machine, in that folder itself, are touched.
    """
    if directory in _SETTLED:
        return
    _SETTLED.add(directory)
    with suppress(OSError):
        with os.scandir(directory) as entries:
            found = [Path(entry.path) for entry in entries if _is_left_over(entry)]
        for names in [path for path in found if path.suffix == NAMES_SUFFIX]:
            _give_remaining_names(names)
        for path in found:
            with suppress(OSError):
                if path.suffix == FOLDER_SUFFIX:
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink(missing_ok=True)


def _give_remaining_names(listed: Path) -> None:
    """Complete a result whose process was killed while its drafts took their names."""
    try:
        chosen: Any = json.loads(listed.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return
    if not isinstance(chosen, dict):
        return
    for draft, name in cast("dict[str, Any]", chosen).items():
        # Names only: such a list never reaches beyond its own folder.
        plain = isinstance(name, str) and name not in ("", ".", "..") and Path(name).name == name
        if plain and _DRAFT.fullmatch(draft) and Path(draft).name == draft:
            with suppress(OSError):
                (listed.parent / draft).replace(listed.parent / name)


def _is_left_over(entry: os.DirEntry[str]) -> bool:
    """Whether a file is a draft of a process of this user that has ended."""
    found = _DRAFT.fullmatch(entry.name)
    if found is None or found[1] != _MACHINE or _is_running(int(found[2])):
        return False
    if entry.stat(follow_symlinks=False).st_uid != os.getuid():
        return False
    if found[3] == FOLDER_SUFFIX:
        return entry.is_dir(follow_symlinks=False)
    return entry.is_file(follow_symlinks=False)


def _is_running(process: int) -> bool:
    if process == os.getpid():
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # another user's
        return True
    return True
