"""Writing results: each appears complete under its name, and no file of the user is destroyed.

A file is written under a hidden name in its folder and renamed when it is complete; the files of
one result are renamed one after the other when all are complete. Hidden files of killed processes
are removed when the next file is written into the same folder. Files that a command has read are
never overwritten, folders that it made are removed again if it fails, and a file is replaced only
by a result of the same kind.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import secrets
import shutil
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

from curling_env.errors import OutputError
from curling_env.infrastructure.files.kinds import kind_of, other_kind, refuse_other_kind

Identity = tuple[int, int]
"""Device and number of a file, the same under all its names."""

_MACHINE = hashlib.sha256(platform.node().encode()).hexdigest()[:4]
_DRAFT = re.compile(rf"\..*~{_MACHINE}-(\d+)-[0-9a-f]{{8}}(\.[^.~]*)?", re.DOTALL)
"""Hidden name with the machine and process that writes, and a random part."""


@dataclass
class CommandFiles:
    """The files and folders of a running command.

    Parameters
    ----------
    inputs : files that were read, or will be
    rewritten : inputs that may be overwritten: its own results, and files it updates on purpose
    written : files that are complete under their names
    made : folders that did not exist before
    kept : message on the files that an interruption leaves and how to continue; empty if nothing is
        kept
    """

    inputs: set[Identity | None] = field(default_factory=set[Identity | None])
    rewritten: set[Identity | None] = field(default_factory=set[Identity | None])
    written: list[Path] = field(default_factory=list[Path])
    made: list[Path] = field(default_factory=list[Path])
    kept: str = ""


_RUNNING: ContextVar[CommandFiles | None] = ContextVar("_RUNNING", default=None)
_RESULT: ContextVar[dict[Path, Path] | None] = ContextVar("_RESULT", default=None)
"""Complete files of one result: final name and hidden name of each."""


@contextmanager
def command_files(files: CommandFiles | None = None) -> Generator[CommandFiles]:
    """Track the files of one command; folders that it made and left empty are removed again.

    Without a command, when called from Python, inputs are not protected.
    """
    files = CommandFiles() if files is None else files
    token = _RUNNING.set(files)
    try:
        yield files
    except BaseException:
        for folder in reversed(files.made):
            with suppress(OSError):
                folder.rmdir()  # fails for a folder with any content
        raise
    finally:
        _RUNNING.reset(token)


def note_input(path: Path) -> None:
    """Register a file as read by the running command."""
    _running().inputs.add(identity_of(path))


def note_rewritten(path: Path) -> None:
    """Register a file that the running command may overwrite although it reads it."""
    files, known = _running(), identity_of(path)
    if known not in files.inputs:
        files.rewritten.add(known)


def keep(what: str) -> None:
    """Set the message on what an interruption of the command leaves and how to continue.

    Parameters
    ----------
    what : such as ``3 films are tracked; repeat the command to continue``
    """
    _running().kept = what


def identity_of(path: str | Path) -> Identity | None:
    """Return the identity of a file under all its names and links; None if there is no file."""
    with suppress(OSError, ValueError):
        found = os.stat(path)
        return (found.st_dev, found.st_ino)
    return None


# --- writing -----------------------------------------------------------------------------------


@contextmanager
def atomic_path(path: str | Path) -> Generator[Path]:
    """Provide a temporary path, which becomes `path` only if the block succeeds.

    It is in the same directory and keeps the suffix, for writers that choose a format by suffix
    (video, pictures). A device or pipe is written to directly, never replaced.

    Raises
    ------
    OutputError : the directory is missing or not writable, the disk is full, the file is an input
        of the running command, or a file of another kind is there
    """
    path = Path(path)
    target, stream = _target_of(path)
    # Created at once: an unwritable directory is found before the long work, not after it.
    draft = _new_draft(Path(tempfile.gettempdir()) if stream else target.parent, target, path)
    result = None if stream else _RESULT.get()
    try:
        yield draft
        with draft.open("rb+") as file:
            os.fsync(file.fileno())  # a full disk may be noticed only now
        if stream:
            with draft.open("rb") as source, path.open("ab") as sink:
                shutil.copyfileobj(source, sink)
            return
        _refuse_input(target)
        refuse_other_kind(draft, target)
        if result is None:
            _give_names({target: draft})
        else:
            if target in result:
                _remove(result[target])
            result[target] = draft
    except OutputError:
        raise
    except OSError as error:
        if str(cast("object", error.filename)) in ("None", str(draft), str(path)):
            raise _not_written(path, error) from error
        raise
    finally:
        if result is None or result.get(target) != draft:
            _remove(draft)


@contextmanager
def together() -> Generator[None]:
    """Rename the files written in the block at its end, all of them or none.

    Nested blocks act as one.

    Raises
    ------
    OutputError : see `atomic_path`; the earlier files are then unchanged
    """
    if _RESULT.get() is not None:
        yield
        return
    result: dict[Path, Path] = {}
    token = _RESULT.set(result)
    try:
        yield
        _give_names(result)
    finally:
        _RESULT.reset(token)
        _remove(*result.values())


@contextmanager
def at_once() -> Generator[None]:
    """Rename the files written in the block immediately, even within `together`.

    For the files that an interrupted command keeps, so that the next run continues from there.
    """
    token = _RESULT.set(None)
    try:
        yield
    finally:
        _RESULT.reset(token)


@contextmanager
def folder_of_drafts(directory: str | Path) -> Generator[Path]:
    """Provide a hidden folder for a result, into which several processes may write.

    If the block succeeds, its files are renamed as in `together`.

    Parameters
    ----------
    directory : folder of the result, which contains the hidden one; made if it is missing

    Raises
    ------
    OutputError : see `atomic_path`
    """
    directory = make_directory(directory)
    drafts = _new_draft(directory, Path("result"), directory)
    try:
        drafts.unlink()
        drafts.mkdir()
        yield drafts
        with together():
            for made in sorted(path for path in drafts.rglob("*") if path.is_file()):
                target = directory / made.relative_to(drafts)
                make_directory(target.parent)
                with atomic_path(target) as draft:
                    made.replace(draft)
    except OutputError as error:
        raise OutputError(str(error).replace(str(drafts), str(directory))) from error
    finally:
        shutil.rmtree(drafts, ignore_errors=True)


def current_path(path: str | Path) -> Path:
    """Return the path that currently has the content of a file written within `together`."""
    return (_RESULT.get() or {}).get(_target_of(Path(path))[0], Path(path))


def check_writable(path: str | Path, *, kinds: tuple[str, ...] = ()) -> None:
    """Refuse an output before the work, if `atomic_path` would refuse it afterwards.

    Parameters
    ----------
    kinds : kinds of files that it may replace, see `kind_of`; empty for any

    Raises
    ------
    OutputError : see `atomic_path`
    """
    target, stream = _target_of(Path(path))
    there = kind_of(target) if kinds else None
    if there is not None and there not in kinds and identity_of(path) not in _running().rewritten:
        raise other_kind(path, there, *kinds)
    if not stream:
        _remove(_new_draft(target.parent, target, Path(path)))


def make_directory(path: str | Path) -> Path:
    """Make a directory for results, with its parents, if it does not exist.

    Raises
    ------
    OutputError : it cannot be made, or a file is in its place
    """
    path = Path(path)
    try:
        missing = [folder for folder in (path, *path.parents) if not folder.exists()]
        for folder in reversed(missing):
            folder.mkdir(exist_ok=True)
            _running().made.append(folder)
        path.mkdir(exist_ok=True)
    except (OSError, ValueError) as error:
        taken = isinstance(error, FileExistsError)
        reason = "a file is in its place" if taken else reason_of(error)
        raise OutputError(f"{path}: cannot make this directory: {reason}") from error
    return path


def fitted(name: str, ending: str = "") -> str:
    """Return a file name with an ending, cut to the 255 bytes of file systems."""
    encoded, room = os.fsencode(name), 255 - len(os.fsencode(ending))
    return (name if len(encoded) <= room else encoded[:room].decode(errors="ignore")) + ending


def reason_of(error: BaseException) -> str:
    """Return the system's reason for an error, in lower case."""
    given = error.strerror if isinstance(error, OSError) else None
    return (given or str(error) or type(error).__name__).lower()


# --- details -----------------------------------------------------------------------------------


def _running() -> CommandFiles:
    return _RUNNING.get() or CommandFiles()


def _refuse_input(path: Path) -> None:
    known, files = identity_of(path), _running()
    if known in files.inputs and known is not None and known not in files.rewritten:
        raise OutputError(
            f"{path}: is an input of this command and is not overwritten; give the result another "
            "name"
        )


def _target_of(path: Path) -> tuple[Path, bool]:
    """Return the file that will be replaced, and whether it is a stream."""
    try:
        # /dev/stdout may be a regular file, but one that the shell holds open.
        stream = path.exists() and (not path.is_file() or str(path.parent) in ("/dev", "/dev/fd"))
        if path.is_dir():
            raise OutputError(f"{path}: is a directory; expected a file name")
        # A link keeps its target; the target is replaced.
        target = Path(os.path.realpath(path)) if path.is_symlink() and not stream else path
        if target.is_symlink() and not stream:
            raise OutputError(f"{path}: cannot be written: a link that leads to itself")
        if not stream and not target.parent.is_dir():
            raise OutputError(f"{path}: cannot be written: no directory {target.parent}")
        _refuse_input(path)
    except OutputError:
        raise
    except (OSError, ValueError) as error:
        raise _not_written(path, error) from error
    return target, stream


def _new_draft(directory: Path, target: Path, path: Path) -> Path:
    """Create an empty file with a hidden name; remove those of killed processes in its folder.

    Parameters
    ----------
    target : final file
    path : path as given by the user, for the message
    """
    with suppress(OSError), os.scandir(directory) as entries:
        for entry in entries:
            found = _DRAFT.fullmatch(entry.name)
            if found is not None and not _is_running(int(found[1])):
                _remove(Path(entry.path))
                shutil.rmtree(entry.path, ignore_errors=True)
    suffix = target.suffix if len(target.suffix) < 16 else ""
    writer = f"~{_MACHINE}-{os.getpid()}-{secrets.token_hex(4)}"
    draft = directory / fitted(f".{target.stem[:40]}", f"{writer}{suffix}")
    try:
        draft.touch(exist_ok=False)
    except OSError as error:
        raise _not_written(path, error) from error
    return draft


def _is_running(process: int) -> bool:
    with suppress(PermissionError, OverflowError):  # of another user
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return False
    return True


def _give_names(names: dict[Path, Path]) -> None:
    """Rename all drafts, and undo all if one fails."""
    aside, target = dict[Path, Path | None](), Path()
    try:
        for target, draft in names.items():
            _refuse_input(target)
            if len(names) > 1:
                aside[target] = _kept_aside(target)
            draft.replace(target)
    except BaseException as error:
        for done, kept in aside.items():
            with suppress(OSError):
                if kept is not None:
                    kept.replace(done)
                elif not names[done].exists():
                    done.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, OutputError):
            raise _not_written(target, error) from error
        raise
    finally:
        _remove(*(kept for kept in aside.values() if kept is not None))
    files = _running()
    for target in names:
        files.written.append(target)
        files.inputs.discard(identity_of(target))
        files.rewritten.add(identity_of(target))


def _kept_aside(target: Path) -> Path | None:
    """Return a second name for the file that will be replaced, to restore it; None if there is
    none.
    """
    if not target.exists():
        return None
    aside = _new_draft(target.parent, Path("before"), target)
    try:
        aside.unlink()
        os.link(target, aside)
    except OSError:  # a disk without hard links
        shutil.copy2(target, aside)
    return aside


def _remove(*drafts: Path) -> None:
    for draft in drafts:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def _not_written(path: Path, error: BaseException) -> OutputError:
    return OutputError(f"{path}: cannot be written: {reason_of(error)}")
