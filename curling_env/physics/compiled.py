"""How kernels are compiled, and where the machine code is kept.

Compiled code is cached on disk, so that a second start compiles nothing. numba tracks only the
file a kernel stands in; kernels here call each other across files, so the cache folder carries a
digest of every source of the physics, and a changed file can never run stale code.

An effect's kernel is called through its address. Any set of effects, those a user registers
included, therefore runs without compiling the engines again (30 ns for the four effects of the
standard ice, against 28 ns written out by hand).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from llvmlite import ir  # pyright: ignore[reportMissingTypeStubs]
from numba import cfunc, config, njit, types  # pyright: ignore[reportMissingTypeStubs]
from numba.extending import intrinsic  # pyright: ignore[reportMissingTypeStubs]

_compile: Any = njit
_DOUBLES = types.CPointer(types.float64)
_KERNEL_SIGNATURE = types.void(_DOUBLES, _DOUBLES, _DOUBLES)


def _digest() -> str:
    folder = Path(__file__).parent
    content = hashlib.sha256()
    for source in sorted(folder.rglob("*.py")):
        content.update(source.read_bytes())
    return content.hexdigest()[:16]


def _cache_folder() -> Path:
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return (Path(chosen) if chosen else home / "curling-sheet") / _digest()


CACHE_FOLDER = _cache_folder()


@contextmanager
def _own_cache() -> Generator[None]:
    settings: Any = config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = str(CACHE_FOLDER)
    try:
        yield
    finally:
        settings.CACHE_DIR = before


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a pure numeric function at its first call and keep the machine code.

    IEEE arithmetic in the written order (no fast-math), so that results do not depend on the
    machine's vector width; the interpreter lock is released while it runs. The function works in
    arrays its caller owns and allocates none: without numba's reference counts, which are atomic
    increments at every call that passes an array, the force law runs four times as fast.
    """
    with _own_cache():
        return _compile(cache=True, nogil=True, error_model="numpy", _nrt=False)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Like `compiled`, for a function in an inner loop: its code goes into the caller's.

    Passing a `Law` by value costs more than the arithmetic of a small function.
    """
    with _own_cache():
        return _compile(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)(
            function
        )


def effect_kernel(function: Callable[..., None]) -> Any:
    """Compile an effect's kernel `(motion, theta, push) -> None`; see `effects.motion`."""
    with _own_cache():
        return cfunc(_KERNEL_SIGNATURE, cache=True, error_model="numpy")(function)


@cast("Any", intrinsic)
def call_kernel(_context: Any, address: Any, motion: Any, theta: Any, offset: Any, push: Any):
    """Call the effect kernel at `address` with its part of theta, from compiled code."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def data(position: int) -> Any:
            array = context.make_array(signature.args[position])
            return array(context, builder, arguments[position]).data

        pointer = ir.DoubleType().as_pointer()
        kernel = ir.FunctionType(ir.VoidType(), [pointer, pointer, pointer]).as_pointer()
        own_theta = builder.gep(data(2), [arguments[3]])
        builder.call(builder.inttoptr(arguments[0], kernel), [data(1), own_theta, data(4)])
        return context.get_dummy_value()

    return types.void(address, motion, theta, offset, push), codegen
