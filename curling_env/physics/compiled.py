"""How kernels are compiled, and where the machine code is kept.

Compiled code is cached on disk, so that a second start compiles nothing. numba notices a change
only in the file a kernel stands in, but a kernel may call others of the physics and of its own
folder. The name of its cache folder therefore holds a digest of all those sources, so that a
change in any of them compiles it anew.

An effect's kernel is called through its address, so that any set of effects, those a user registers
included, runs without compiling the engines again.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

from llvmlite import ir  # pyright: ignore[reportMissingTypeStubs]
from numba import cfunc, config, njit, types  # pyright: ignore[reportMissingTypeStubs]
from numba.extending import intrinsic  # pyright: ignore[reportMissingTypeStubs]

_compile: Any = njit
_DOUBLES = types.CPointer(types.float64)
_KERNEL_SIGNATURE = types.void(_DOUBLES, _DOUBLES, _DOUBLES)


_PHYSICS = Path(__file__).parent


@cache
def _cache_folder(folder: Path) -> Path:
    """Where the machine code of kernels is kept whose source stands in that folder."""
    sources = sorted(_PHYSICS.rglob("*.py"))
    if not folder.is_relative_to(_PHYSICS):
        sources += sorted(folder.glob("*.py"))
    content = hashlib.sha256()
    for source in sources:
        content.update(source.read_bytes())
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return (Path(chosen) if chosen else home / "curling-sheet") / content.hexdigest()[:16]


CACHE_FOLDER = _cache_folder(_PHYSICS)
"""Where the machine code of the physics' own kernels is kept."""


@contextmanager
def _cache_of(function: Callable[..., Any]) -> Generator[None]:
    """Make numba cache what is compiled meanwhile where it belongs."""
    settings: Any = config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = str(_cache_folder(Path(function.__code__.co_filename).parent))
    try:
        yield
    finally:
        settings.CACHE_DIR = before


def compiled(
    function: Callable[..., Any] | None = None,
    *,
    allocates: bool = False,
    inline: bool = False,
    fastmath: bool | set[str] = False,
) -> Any:
    """Compile a pure numeric function at its first call and keep the machine code.

    It may call compiled functions of the physics and of the folder it stands in. Arithmetic is
    IEEE's in the written order, so that results do not depend on the machine's vector width, and
    the interpreter lock is released while the function runs.

    Parameters
    ----------
    function : the function; without it, a decorator with these options is returned
    allocates : whether it makes arrays of its own. One that works only in arrays of its caller
        runs several times as fast, because numba then counts no references
    inline : put its code into the caller's, see `inlined`
    fastmath : numba's flags for arithmetic that may be reordered
    """
    if function is None:
        return partial(compiled, allocates=allocates, inline=inline, fastmath=fastmath)
    options: dict[str, Any] = {"_nrt": allocates, "forceinline": inline, "fastmath": fastmath}
    with _cache_of(function):
        return _compile(cache=True, nogil=True, error_model="numpy", **options)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Like `compiled`, for a small function in an inner loop: its code goes into the caller's.

    Passing a `Law` by value costs more than the arithmetic of a small function.
    """
    return compiled(function, inline=True)


def effect_kernel(function: Callable[..., None]) -> Any:
    """Compile the kernel of an effect, ``(motion, theta, push) -> None``; see `effects.motion`."""
    with _cache_of(function):
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
