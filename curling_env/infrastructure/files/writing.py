"""Writing: a file appears under its name when it is complete, several of one result together.

Every file is first written as a draft in the folder where it will lie. Drafts that a killed process
left are removed the next time anything is read or written in that folder, and a result that was
complete, but did not get all its names, gets them then. A result of many files made by several
processes is made in a folder of drafts.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

from curling_env.errors import OutputError
from curling_env.infrastructure.files.command_files import (
    note_directory,
    note_output,
    refuse_to_write,
)
from curling_env.infrastructure.files.drafts import (
    FOLDER_SUFFIX,
    NAMES_SUFFIX,
    draft_in,
    finish_interrupted,
)
from curling_env.infrastructure.files.kinds import KIND_NAMES, is_same_kind, kind_of

_DISK_TROUBLE = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO})


@dataclass
class _Result:
    """Files of one result: drafts, and the names they will take."""

    names: dict[Path, Path] = field(default_factory=dict[Path, Path])


_RESULT: ContextVar[_Result | None] = ContextVar("_RESULT", default=None)


@contextmanager
def atomic_path(path: str | Path) -> Generator[Path]:
    """A temporary path to write to, which becomes `path` only if the block succeeds.

    It lies in the same directory and keeps the suffix, for writers that choose a format by suffix
    (video, pictures). A device or pipe is written to, never replaced.

    Raises
    ------
    OutputError : the directory is missing or not writable, the disk is full, the file is an input
        of the running command, or a file of another kind lies there
    """
    path = Path(path)
    target, stream = _target_of(path)
    refuse_to_write(target)
    directory = Path(tempfile.gettempdir()) if stream else target.parent
    finish_interrupted(directory)
    draft = draft_in(directory, target.stem, target.suffix)
    handed_over = False
    try:
        # Created at once: an unwritable directory is found before the long work, not after it.
        draft.touch(exist_ok=False)
        yield draft
        _settle(draft)
        if stream:
            with draft.open("rb") as source, path.open("ab") as sink:
                shutil.copyfileobj(source, sink)
            return
        refuse_to_write(target)
        refuse_other_kind(draft, target)
        result = _RESULT.get()
        if result is None:
            draft.replace(target)
            note_output(target)
        else:
            earlier = [old for old, name in result.names.items() if name == target]
            for old in earlier:
                del result.names[old]
                old.unlink(missing_ok=True)
            result.names[draft] = target
            handed_over = True
    except OutputError:
        raise
    except OSError as error:
        if _is_about(error, draft) or _is_about(error, path):
            raise OutputError(f"{path}: cannot be written: {_reason(error)}") from error
        raise
    finally:
        if not handed_over:
            with suppress(OSError):
                draft.unlink(missing_ok=True)


@contextmanager
def together() -> Generator[None]:
    """Files written within it get their names at its end, all of them or none.

    Their folders get a list of the names first. So if the process is killed while it gives the
    names, whoever reads or writes there next gives the rest. Blocks within one another are one.

    Raises
    ------
    OutputError : see `atomic_path`; the files that were there before are then as they were
    """
    if _RESULT.get() is not None:
        yield
        return
    result = _Result()
    token = _RESULT.set(result)
    try:
        try:
            yield
        finally:
            _RESULT.reset(token)
        _give_names(result.names)
    finally:
        for draft in result.names:
            with suppress(OSError):
                draft.unlink(missing_ok=True)


@contextmanager
def at_once() -> Generator[None]:
    """Files written within it get their names at once, also within `together`.

    For what an interrupted command keeps, so that the next one goes on from there.
    """
    token = _RESULT.set(None)
    try:
        yield
    finally:
        _RESULT.reset(token)


@contextmanager
def folder_of_drafts(directory: str | Path) -> Generator[Path]:
    """A hidden folder to make a result in.

    If the block succeeds, its files take their places `together`. Any number of processes may write
    into it meanwhile.

    Parameters
    ----------
    directory : the folder of the result, in which the hidden one lies; it is made if it is missing

    Raises
    ------
    OutputError : see `atomic_path`
    """
    directory = make_directory(directory)
    finish_interrupted(directory)
    drafts = draft_in(directory, "result", FOLDER_SUFFIX)
    try:
        with _without_the_name_of(drafts, directory):
            make_directory(drafts)
            yield drafts
        with together():
            for made in sorted(path for path in drafts.rglob("*") if path.is_file()):
                target = directory / made.relative_to(drafts)
                make_directory(target.parent)
                with atomic_path(target) as draft:
                    made.replace(draft)
    finally:
        shutil.rmtree(drafts, ignore_errors=True)


def written_so_far(path: str | Path) -> Path:
    """Where the content of a file lies that was written within `together`."""
    result, path = _RESULT.get(), Path(path)
    if result is not None:
        for draft, name in result.names.items():
            if name == _target_of(path)[0]:
                return draft
    return path


def check_writable(path: str | Path, *, kinds: tuple[str, ...] = ()) -> None:
    """Refuse an output before the work: what `atomic_path` would refuse after it.

    Parameters
    ----------
    kinds : names of `kinds` that it may replace; empty for any

    Raises
    ------
    OutputError : see `atomic_path`
    """
    path = Path(path)
    target, stream = _target_of(path)
    refuse_to_write(target, kinds=kinds)
    if stream:
        return
    finish_interrupted(target.parent)
    draft = draft_in(target.parent, target.stem, target.suffix)
    try:
        draft.touch(exist_ok=False)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {_reason(error)}") from error
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def make_directory(path: str | Path) -> Path:
    """A directory for results, made with its parents if it does not exist.

    Raises
    ------
    OutputError : it cannot be made, or a file is in its place
    """
    path = Path(path)
    try:
        missing = [folder for folder in (path, *path.parents) if not folder.exists()]
        for folder in reversed(missing):
            folder.mkdir(exist_ok=True)
            note_directory(folder)
        path.mkdir(exist_ok=True)
    except (OSError, RuntimeError, ValueError) as error:
        reason = "a file is in its place" if _is_file(path) else _reason(error)
        raise OutputError(f"{path}: cannot make this directory: {reason}") from error
    return path


def refuse_other_kind(draft: Path, target: Path) -> None:
    """Refuse to replace a file by one of another kind.

    Raises
    ------
    OutputError : the file that lies there is of another kind
    """
    if not is_same_kind(draft, target):
        there = KIND_NAMES.get(kind_of(target) or "other", "another file")
        ours = KIND_NAMES.get(kind_of(draft) or "other", "another file")
        raise OutputError(
            f"{target}: is {there} and is not replaced by {ours}; give the result another name"
        )


# --- details -----------------------------------------------------------------------------------


def _target_of(path: Path) -> tuple[Path, bool]:
    """The file that is going to be replaced, and whether it is a stream that is written to."""
    try:
        # /dev/stdout may stand for a regular file, but one that the shell holds open.
        stream = path.exists() and (not path.is_file() or str(path.parent) in ("/dev", "/dev/fd"))
        if path.is_dir():
            raise OutputError(f"{path}: is a directory; expected the name of a file to write")
        # A link keeps pointing where it did: what it points at is replaced.
        target = path.resolve() if path.is_symlink() and not stream else path
        if not stream and not target.parent.is_dir():
            raise OutputError(f"{path}: cannot be written: no directory {target.parent}")
    except OutputError:
        raise
    except RuntimeError as error:
        raise OutputError(f"{path}: cannot be written: a link that leads to itself") from error
    except (OSError, ValueError) as error:
        raise OutputError(f"{path}: cannot be written: {_reason(error)}") from error
    return target, stream


def _give_names(names: dict[Path, Path]) -> None:
    """Let every draft take its name, and undo all if one cannot."""
    lists: list[Path] = []
    before: dict[Path, Path | None] = {}
    try:
        for folder in {target.parent for target in names.values()} if len(names) > 1 else ():
            chosen = {d.name: t.name for d, t in names.items() if t.parent == folder}
            listed = draft_in(folder, "result", NAMES_SUFFIX)
            lists.append(listed)
            listed.write_text(json.dumps(chosen), encoding="utf-8")
            _settle(listed)
        for draft, target in names.items():
            refuse_to_write(target)
            before[target] = _kept_aside(target)
            draft.replace(target)
    except BaseException as error:
        for target, kept in before.items():
            with suppress(OSError):
                if kept is not None:
                    kept.replace(target)
                elif target not in names.values() or _has_taken(names, target):
                    target.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, OutputError):
            place = next(iter(reversed(before)), next(iter(names.values())))
            raise OutputError(f"{place}: cannot be written: {_reason(error)}") from error
        raise
    finally:
        for path in (*lists, *(kept for kept in before.values() if kept is not None)):
            with suppress(OSError):
                path.unlink(missing_ok=True)
    for target in names.values():
        note_output(target)


def _has_taken(names: dict[Path, Path], target: Path) -> bool:
    """Whether the draft of a target is no longer there, because it became the target."""
    return any(name == target and not draft.exists() for draft, name in names.items())


def _kept_aside(target: Path) -> Path | None:
    """A second name of the file that is going to be replaced, to put it back; None for none."""
    if not target.exists():
        return None
    aside = draft_in(target.parent, target.stem, ".before")
    try:
        os.link(target, aside)
    except OSError:  # a disk without hard links
        shutil.copy2(target, aside)
    return aside


@contextmanager
def _without_the_name_of(drafts: Path, directory: Path) -> Generator[None]:
    """Let an error name the place where a file will lie, and not where its draft lies."""
    try:
        yield
    except OutputError as error:
        raise OutputError(str(error).replace(str(drafts), str(directory))) from error


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _settle(draft: Path) -> None:
    """Force the bytes to the disk, where a full disk may only now be noticed."""
    with draft.open("rb+") as file:
        os.fsync(file.fileno())


def _is_about(error: OSError, path: Path) -> bool:
    return (
        error.errno in _DISK_TROUBLE
        or error.filename is None
        or str(cast("object", error.filename)) == str(path)
    )


def _reason(error: BaseException) -> str:
    said = error.strerror if isinstance(error, OSError) else None
    return (said or str(error) or type(error).__name__).lower()
