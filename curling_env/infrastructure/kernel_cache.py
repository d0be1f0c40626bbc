"""On-disk cache of compiled kernels. A missing, corrupt or unwritable cache is never fatal.

numba stores pickles, which can run code, so a folder that other users can write to is not used. A
corrupt file is compiled again; without a usable folder, every start compiles.
"""

# numba comes without complete types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUntypedBaseClass=false

from __future__ import annotations

import hashlib
import os
import pickle
import sys
import warnings
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.serialize import dumps

FIRST_COMPILATION = (
    "curling: compiling the physics for this machine, once: about 10 s on one core now, and a few "
    "more at the first use of other functions"
)
"""Message on stderr if nothing is cached yet."""
_printed: list[str] = []
_uncached_reason: list[str] = []


class KernelCacheWarning(UserWarning):
    """Kernels cannot be cached; they are compiled again at every start."""


def remarks() -> list[str]:
    """Return remarks on the cache of this process."""
    return _uncached_reason[:1]


def _warn_once(why: str) -> None:
    if not _uncached_reason:
        remark = f"compiled code is not cached, so every start compiles again: {why}"
        _uncached_reason.append(remark)
        warnings.warn(remark, KernelCacheWarning, stacklevel=3)


@cache
def _objection(folder: Path) -> str:
    """Return the reason not to cache code in a folder, which is made if missing; empty if
    usable.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError as error:
        return f"{folder} cannot be used ({error.strerror})"
    is_shared = found.st_mode & 0o022 or found.st_uid not in (0, os.geteuid())
    return f"others can write to {folder}" if is_shared else ""


class _Locator:
    """Location of a function's machine code, in numba's terms."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def from_function(self, function: Any, file: str) -> _Locator:
        self._function, self._py_file = function, file
        return self

    def ensure_cache_path(self) -> None:
        """Do nothing: `_objection` has made the folder."""

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return ""  # the name of the folder is a digest of the sources

    def get_disambiguator(self) -> str:
        return f"{self._function.__module__}-{self._function.__code__.co_firstlineno}"


class _Contents(CompileResultCacheImpl):
    """Everything that numba caches for a function, with a digest of it."""

    def __init__(self, function: Any, folder: Path) -> None:
        self._locator_classes = [_Locator(folder)]
        super().__init__(function)

    def reduce(self, cres: Any) -> Any:
        content = dumps(super().reduce(cres))
        return hashlib.sha256(content).digest(), content

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        digest, content = payload
        if hashlib.sha256(content).digest() != digest:
            raise ValueError("damaged")
        return super().rebuild(target_context, pickle.loads(content))


class KernelCache(FunctionCache):
    """Cache of one function; its errors never stop a kernel.

    Parameters
    ----------
    function : the Python function
    folder : folder of its machine code
    """

    def __init__(self, function: Any, folder: Path) -> None:
        self._impl_class = partial(_Contents, folder=folder)
        self._folder = folder
        super().__init__(function)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature; None if it must be compiled."""
        if why := _objection(self._folder):
            return _warn_once(why)
        kept = None
        try:
            kept = super().load_overload(sig, target_context)
        except Exception:  # a corrupt file may make numba raise anything
            with suppress(OSError):
                self.flush()
        if kept is None and not _printed and not any(self._folder.glob("*.nbi")):
            _printed.append(FIRST_COMPILATION)
            if sys.stderr is not None:
                print(FIRST_COMPILATION, file=sys.stderr, flush=True)
        return kept

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the machine code for a signature, if possible."""
        if _objection(self._folder):
            return
        try:
            super().save_overload(sig, data)
        except Exception as error:
            why = getattr(error, "strerror", "") or error
            _warn_once(f"{self._folder} cannot be written ({why})")
