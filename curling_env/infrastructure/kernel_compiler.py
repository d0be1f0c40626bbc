"""Kernels compiled in less time: their parts are not made into programs of their own.

numba makes of every function that another one calls machine code, an entry for Python and a file in
the cache, though only the outermost is ever called from Python. A `Part` ends as code that is
linked into the kernels that call it. Besides, a kernel is compiled once for integers, not once for
each constant that is passed for them; passes that find nothing in such kernels are left out; the
many objects of a compilation are not searched for garbage in between; what types an operation has
on the same kinds of operands is found once; and numba compares the options of a kernel with each
other by identity. What a kernel computes is the same to the last bit.

This reaches into numba. With a numba whose inside is not known here (`KNOWN`), kernels are compiled
in its ordinary way, which takes longer.
"""

# numba comes without complete types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportPrivateImportUsage=false
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import gc
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

import numba

KNOWN = numba.version_info[:2] in {(0, 68)}
"""Whether this numba's inside is known here."""
_OPTIONS: dict[str, Any] = {"nopython": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
_NO_WRAPPERS: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


@contextmanager
def quick_compilation() -> Generator[None]:
    """Compile without searching for garbage, and with the types of each operation found once."""
    with no_garbage_collection():
        if not KNOWN:
            yield
            return
        from curling_env.infrastructure.kernel_parts import remembered_types

        with remembered_types():
            yield


@contextmanager
def no_garbage_collection() -> Generator[None]:
    """Keep Python from searching for garbage; compiling makes many objects and little garbage."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def kernel(function: Callable[..., Any], **options: Any) -> Any:
    """A function that is compiled when it is first called, from Python or from another kernel.

    Parameters
    ----------
    function : pure and numeric; without arrays of its own unless `_nrt` is set
    options : of `numba.njit`, beside those that every kernel has
    """
    if not KNOWN or numba.config.DISABLE_JIT:
        return numba.jit(**_OPTIONS, **options)(function)
    from curling_env.infrastructure.kernel_parts import Kernel

    return Kernel(function, targetoptions=_OPTIONS | options)


def part(function: Callable[..., Any], **options: Any) -> Any:
    """A function that only kernels and other parts call; its code becomes part of theirs."""
    if not KNOWN or numba.config.DISABLE_JIT:
        return numba.jit(**_OPTIONS, **options)(function)
    from curling_env.infrastructure.kernel_parts import Part

    return Part(function, targetoptions=_OPTIONS | _NO_WRAPPERS | options)
