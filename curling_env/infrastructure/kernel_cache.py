"""Machine code kept between starts, which may be lost, damaged or forbidden and never stops anyone.

What numba keeps is a pickle, which can run code. So only a folder that nobody else can write is
used, and every file begins with a digest of the rest: one that was cut or changed is removed and
compiled again. Where nothing can be kept, kernels are compiled for this process alone.
"""

# numba comes without complete types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUntypedBaseClass=false, reportPrivateUsage=false
# pyright: reportMissingSuperCall=false, reportUnknownLambdaType=false

from __future__ import annotations

import hashlib
import os
import stat
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    NullCache,
)

_DIGEST = hashlib.sha256
_SAID: set[str] = set()


class KernelCacheWarning(UserWarning):
    """Kernels cannot be kept; they are compiled again at every start."""


def kernel_cache(function: Any, folder: Path | None) -> Any:
    """The cache of one function, for numba.

    Parameters
    ----------
    function : the Python function
    folder : where its machine code is kept; None for nowhere
    """
    if folder is None:
        _say_once("there is no folder for compiled code")
        return NullCache()
    return _KernelCache(function, folder / function.__module__.rpartition(".")[0])


def remarks() -> list[str]:
    """What there is to say about the cache of this process, once."""
    said = sorted(_SAID - {""})
    _SAID.clear()
    _SAID.add("")
    return said


FIRST_COMPILATION = (
    "curling: compiling the physics for this machine, once: about 6 s of one core now, and a few "
    "more for what is first used later"
)
"""What is said when a machine compiles for the first time."""
_LOOKED_INTO: set[Path] = set()
_TOLD: list[str] = []


def _say_that_it_compiles(folder: Path) -> None:
    """Say once on stderr that compiling takes a while, where nothing has been kept yet.

    Parameters
    ----------
    folder : where the code of all kernels of these sources is kept
    """
    if _TOLD or folder in _LOOKED_INTO:
        return
    _LOOKED_INTO.add(folder)
    if not any(folder.rglob("*.nbi")) and sys.stderr is not None:
        _TOLD.append(FIRST_COMPILATION)
        print(FIRST_COMPILATION, file=sys.stderr, flush=True)


def _say_once(why: str) -> None:
    text = f"compiled code is not kept, so that every start compiles again: {why}"
    if not _SAID:
        _SAID.add(text)
        warnings.warn(text, KernelCacheWarning, stacklevel=3)


class _Locator:
    """Where the code of a function lies, in numba's terms."""

    def __init__(self, folder: Path, function: Any) -> None:
        self._folder = folder
        self._py_file = function.__code__.co_filename

    def ensure_cache_path(self) -> None:
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return ""  # the name of the folder holds a digest of the sources

    def get_disambiguator(self) -> str:
        return ""


class _Implementation(CompileResultCacheImpl):
    """How results become bytes: numba's way, but at our place."""

    def __init__(self, function: Any, folder: Path) -> None:
        self._lineno = function.__code__.co_firstlineno
        self._locator = _Locator(folder, function)
        name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
        self._filename_base = self.get_filename_base(f"{name}-{self._lineno}", "")


class _KernelFile(IndexDataCacheFile):
    """Index and code of one function, each behind a digest of itself."""

    def _load_index(self) -> Any:
        return self._checked(Path(self._index_path), super()._load_index) or {}

    def _load_data(self, name: str) -> Any:
        load = super()._load_data
        return self._checked(Path(self._data_path(name)), lambda: load(name))

    def _checked(self, path: Path, load: Any) -> Any:
        """What a file holds; nothing where it is damaged, and then it is removed."""
        try:
            content = path.read_bytes()
        except OSError:
            return None
        size = _DIGEST().digest_size
        if _DIGEST(content[:-size]).digest() == content[-size:]:
            try:
                return load()
            except Exception:  # written by another version of numba or Python
                pass
        with suppress(OSError):
            path.unlink()
        return None

    def _open_for_write(self, filepath: str) -> Any:
        return _Signed(super()._open_for_write(filepath))


class _Signed:
    """A file that is being written, to which a digest of its content is added at the end.

    numba reads a file's pickle from its beginning and does not look at what follows.
    """

    def __init__(self, opened: Any) -> None:
        self._opened = opened
        self._digest = _DIGEST()

    def __enter__(self) -> _Signed:
        self._file = self._opened.__enter__()
        return self

    def write(self, content: Any) -> int:
        self._digest.update(content)
        return self._file.write(content)

    def __exit__(self, *fault: Any) -> Any:
        if fault[0] is None:
            self._file.write(self._digest.digest())
        return self._opened.__exit__(*fault)


class _KernelCache(FunctionCache):
    """The cache of one function, whose troubles are nobody's."""

    def __init__(self, function: Any, folder: Path) -> None:
        self._name = repr(function)
        self._py_func = function
        self._impl = _Implementation(function, folder)
        self._cache_path = str(folder)
        self._cache_file = _KernelFile(
            cache_path=str(folder),
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )
        self._folder = folder
        self.enable()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        if not self._is_ours():
            return None
        try:
            kept = super().load_overload(sig, target_context)
        except Exception:  # whatever a damaged file may lead numba to
            with suppress(OSError):
                Path(self._cache_file._index_path).unlink()
            return None
        if kept is None:
            _say_that_it_compiles(self._folder.parent)
        return kept

    def save_overload(self, sig: Any, data: Any) -> None:
        if not self._is_ours():
            return
        try:
            super().save_overload(sig, data)
        except OSError as error:
            self.disable()
            _say_once(f"{self._folder.parent} cannot be written ({error.strerror})")

    def _is_ours(self) -> bool:
        """Whether nobody else can put code into the folder."""
        for folder in (self._folder, self._folder.parent):
            try:
                found = folder.stat()
            except FileNotFoundError:
                continue  # made by us, for us alone, when there is something to keep
            except OSError as error:
                _say_once(f"{self._folder.parent} cannot be used ({error.strerror})")
                return False
            others = found.st_mode & stat.S_IWOTH or (
                found.st_mode & stat.S_IWGRP and found.st_gid != os.getegid()
            )
            if others or found.st_uid not in (0, os.geteuid()):
                _say_once(f"others can write to {folder}")
                return False
        return True
