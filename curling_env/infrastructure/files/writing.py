"""Writing: a result appears whole under its name, and nothing of the user's is destroyed.

A file is written under a hidden name beside its place and takes its name when it is complete; the
files of one result take theirs one after the other when all are complete. What killed processes
left under hidden names is removed when the next file is written into the same folder. Files that a
command has read are never written over, folders that it made vanish again if it fails, and a file
is replaced only by a result of its own kind.
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
"""A hidden name with the machine and the process that writes, and something random."""


@dataclass
class CommandFiles:
    """The files and folders of a running command.

    Parameters
    ----------
    inputs : what was read, or is named to be read
    rewritten : what may be written all the same: its own results, and what it updates on purpose
    written : files that have taken their names
    made : folders that did not exist before
    kept : what an interruption leaves, and how to go on from there; empty if nothing is kept
    """

    inputs: set[Identity | None] = field(default_factory=set[Identity | None])
    rewritten: set[Identity | None] = field(default_factory=set[Identity | None])
    written: list[Path] = field(default_factory=list[Path])
    made: list[Path] = field(default_factory=list[Path])
    kept: str = ""


_RUNNING: ContextVar[CommandFiles | None] = ContextVar("_RUNNING", default=None)
_RESULT: ContextVar[dict[Path, Path] | None] = ContextVar("_RESULT", default=None)
"""The complete files of one result: the name that each will take, and its hidden name."""


@contextmanager
def command_files(files: CommandFiles | None = None) -> Generator[CommandFiles]:
    """Watch over the files of one command; folders that it made and left empty vanish again.

    Used from Python, without a command, inputs are not protected.
    """
    files = CommandFiles() if files is None else files
    token = _RUNNING.set(files)
    try:
        yield files
    except BaseException:
        for folder in reversed(files.made):
            with suppress(OSError):
                folder.rmdir()  # refuses a folder that holds anything
        raise
    finally:
        _RUNNING.reset(token)


def note_input(path: Path) -> None:
    """Remember that the running command reads this file."""
    _running().inputs.add(identity_of(path))


def note_rewritten(path: Path) -> None:
    """Remember that the running command may write a file that it reads from now on."""
    files, known = _running(), identity_of(path)
    if known not in files.inputs:
        files.rewritten.add(known)


def keep(what: str) -> None:
    """Remember what an interruption of the running command leaves, and how to go on from there.

    Parameters
    ----------
    what : such as ``3 films are tracked; repeat the command to go on``
    """
    _running().kept = what


def identity_of(path: str | Path) -> Identity | None:
    """What identifies a file under all its names and links; None where there is none."""
    with suppress(OSError, ValueError):
        found = os.stat(path)
        return (found.st_dev, found.st_ino)
    return None


# --- writing -----------------------------------------------------------------------------------


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
    """Files written within it get their names at its end, all of them or none.

    Blocks within one another are one.

    Raises
    ------
    OutputError : see `atomic_path`; the files that were there before are then as they were
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
    """A hidden folder to make a result in, into which several processes may write.

    If the block succeeds, its files take their places `together`.

    Parameters
    ----------
    directory : the folder of the result, in which the hidden one lies; it is made if it is missing

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


def written_so_far(path: str | Path) -> Path:
    """Where the content of a file lies that was written within `together`."""
    return (_RESULT.get() or {}).get(_target_of(Path(path))[0], Path(path))


def check_writable(path: str | Path, *, kinds: tuple[str, ...] = ()) -> None:
    """Refuse an output before the work: what `atomic_path` would refuse after it.

    Parameters
    ----------
    kinds : kinds that it may replace, see `kind_of`; empty for any

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
            _running().made.append(folder)
        path.mkdir(exist_ok=True)
    except (OSError, ValueError) as error:
        taken = isinstance(error, FileExistsError)
        reason = "a file is in its place" if taken else reason_of(error)
        raise OutputError(f"{path}: cannot make this directory: {reason}") from error
    return path


def fitted(name: str, ending: str = "") -> str:
    """A file's name with an ending, of which the name is cut to the 255 bytes of file systems."""
    encoded, room = os.fsencode(name), 255 - len(os.fsencode(ending))
    return (name if len(encoded) <= room else encoded[:room].decode(errors="ignore")) + ending


def reason_of(error: BaseException) -> str:
    """The reason that the system gives for a fault, in small letters."""
    given = error.strerror if isinstance(error, OSError) else None
    return (given or str(error) or type(error).__name__).lower()


# --- details -----------------------------------------------------------------------------------


def _running() -> CommandFiles:
    return _RUNNING.get() or CommandFiles()


def _refuse_input(path: Path) -> None:
    known, files = identity_of(path), _running()
    if known in files.inputs and known is not None and known not in files.rewritten:
        raise OutputError(
            f"{path}: is read by this command and is not written over; give the result another name"
        )


def _target_of(path: Path) -> tuple[Path, bool]:
    """The file that is going to be replaced, and whether it is a stream that is written to."""
    try:
        # /dev/stdout may stand for a regular file, but one that the shell holds open.
        stream = path.exists() and (not path.is_file() or str(path.parent) in ("/dev", "/dev/fd"))
        if path.is_dir():
            raise OutputError(f"{path}: is a directory; expected the name of a file to write")
        # A link keeps pointing where it did: what it points at is replaced.
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
    """An empty file with a hidden name; those of killed processes in its folder are removed.

    Parameters
    ----------
    target : the file that it will be
    path : the result as the user named it, for the message
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
    with suppress(PermissionError, OverflowError):  # another user's
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return False
    return True


def _give_names(names: dict[Path, Path]) -> None:
    """Let every draft take its name, and undo all if one cannot."""
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
    """A second name of the file that is going to be replaced, to put it back; None for none."""
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
