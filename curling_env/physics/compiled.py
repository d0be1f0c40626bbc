"""Compilation of kernels, the location of their machine code, and a logarithm and exponential.

numba compiles them and stores the machine code on disk (`infrastructure.kernel_cache`), so that a
second start compiles nothing. A kernel may call others of the physics and of its folder. The
name of its cache folder is therefore a digest of all those sources, so that a change in any of them
compiles it again.

An effect's kernel is called through its address, so that any set of effects, those a user registers
included, runs without compiling the engines again.
"""

# numba comes without complete types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUntypedBaseClass=false
# pyright: reportPrivateUsage=false, reportMissingSuperCall=false, reportUnknownArgumentType=false

from __future__ import annotations

import gc
import hashlib
import os
import re
from collections.abc import Callable, Set
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, cast

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import event
from numba.core.caching import NullCache
from numba.core.ccallback import CFunc
from numba.extending import intrinsic

from curling_env.infrastructure.kernel_cache import KernelCache

_DOUBLES = types.CPointer(types.float64)
_PHYSICS = Path(__file__).parent


@cache
def _cache_folder(folder: Path) -> Path:
    """Return the folder for the machine code of kernels with sources in a given folder.

    Its name is a digest of all sources of such a kernel: the physics, its own folder, and other
    kernels of its package.
    """
    sources = set(_PHYSICS.rglob("*.py"))
    if not folder.is_relative_to(_PHYSICS):
        sources |= set(folder.glob("*.py"))
        package = folder
        while (package.parent / "__init__.py").exists():
            package = package.parent
        if (package / "__init__.py").exists():
            for path in package.rglob("*.py"):
                if re.search(b"compiled|njit", path.read_bytes()):
                    sources.add(path)
    content = hashlib.sha256()
    for source in sorted(sources):
        content.update(source.read_bytes())
    try:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # a user without a home
        home = Path(os.devnull)  # not writable
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return (Path(chosen) if chosen else home / "curling-sheet") / content.hexdigest()[:16]


CACHE_FOLDER = _cache_folder(_PHYSICS)
"""Folder for the machine code of the physics' own kernels."""


def _cache_of(function: Callable[..., Any]) -> Any:
    """Return the cache of a compiled function; a function without a file is not cached."""
    file = Path(function.__code__.co_filename)
    return KernelCache(function, _cache_folder(file.parent)) if file.exists() else NullCache()


class _Compilation(event.Listener):
    """Pause of garbage collection while numba compiles, which makes many objects and little
    garbage.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._collects = False

    def on_start(self, event: Any) -> None:
        if self._depth == 0:
            self._collects = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        if self._depth == 0 and self._collects:
            gc.enable()


event.register("numba:compile", _Compilation())


def _njit(function: Callable[..., Any], fastmath: bool | Set[str], **options: Any) -> Any:
    flags = fastmath if isinstance(fastmath, bool) else set(fastmath)
    options |= {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "fastmath": flags}
    return cast("Any", numba.njit)(function, **options)


FUSED = frozenset({"contract"})
"""Flags for arithmetic in the written order, in which a product and a sum may be rounded once."""


def compiled(
    function: Callable[..., Any] | None = None,
    *,
    allocates: bool = False,
    fastmath: bool | Set[str] = FUSED,
) -> Any:
    """Compile a pure numeric function at its first call and cache the machine code.

    It may call compiled functions of the physics and of its folder. Results have the same bits
    on one machine under any load. The interpreter lock is released while the function runs.

    Parameters
    ----------
    function : the function; without it, a decorator with these options is returned
    allocates : true if it makes arrays. A function that works only in its caller's arrays runs
        several times as fast, because numba then counts no references
    fastmath : numba's flags for arithmetic; False rounds every operation
    """
    if function is None:
        return partial(compiled, allocates=allocates, fastmath=fastmath)
    made = _njit(function, fastmath, _nrt=allocates)
    if made is not function:  # true if numba is switched off
        made._cache = _cache_of(function)
    return made


class _Part:
    """Function without an entry point for Python, which would double the compile time.

    Kernels call its machine code; Python runs it as it is written.
    """

    def __init__(self, compiled: Any) -> None:
        self.py_func = compiled.py_func
        self._compiled = compiled
        self._numba_type_ = compiled._numba_type_
        # One version for all whole numbers, not one for each constant.
        find: Any = compiled.get_call_template

        def find_widened(args: Any, kws: Any) -> Any:
            return find(tuple(types.unliteral(arg) for arg in args), kws)

        compiled.get_call_template = find_widened

    def __call__(self, *args: Any) -> Any:
        return self.py_func(*args)


def part(
    function: Callable[..., Any] | None = None,
    *,
    fastmath: bool | Set[str] = FUSED,
    **options: Any,
) -> Any:
    """Compile a function that only compiled functions call, like `compiled` but faster.

    Parameters
    ----------
    function : pure numeric function that makes no arrays
    fastmath : as in `compiled`
    options : further options of `numba.njit`
    """
    if function is None:
        return partial(part, fastmath=fastmath, **options)
    made = _njit(function, fastmath, _nrt=False, no_cpython_wrapper=True, **options)
    return made if made is function else _Part(made)


inlined = partial(part, forceinline=True)
"""Decorator like `part`, for a small function in an inner loop: its code is inlined at each call.

Passing a `Law` by value costs more than the arithmetic of a small function.
"""


class EffectKernel:
    """Kernel of an effect, compiled when its address is first requested.

    Parameters
    ----------
    function : ``(motion, theta, push) -> None``; see `physics.motion`
    """

    def __init__(self, function: Callable[..., None]) -> None:
        self.function = function

    @cached_property
    def _compiled(self) -> Any:
        signature = ((_DOUBLES, _DOUBLES, _DOUBLES), types.void)
        made: Any = CFunc(self.function, signature, locals={}, options={"error_model": "numpy"})
        made._cache = _cache_of(self.function)
        made.compile()
        return made

    @property
    def address(self) -> int:
        """Return the address of its machine code in memory."""
        return self._compiled.address


effect_kernel = EffectKernel
"""Decorator that makes an effect's kernel from a function."""


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


# --- logarithm and exponential for inner loops -------------------------------------------------
# Those of the C library are exact to the last bit but cost a call. These are exact to 1e-13 and are
# inlined into their loop, where the processor works on several at once; they also give the same
# bits on every machine.

_MANTISSA = np.int64(0x000FFFFFFFFFFFFF)
_ONE = np.int64(0x3FF0000000000000)
_LN2_HIGH = 6.93147180369123816490e-01
_LN2_LOW = 1.90821492927058770002e-10
_LOG2_E = 1.4426950408889634
_ROUNDER = 6755399441055744.0
"""Rounding constant 1.5·2^52: adding it rounds a small number to a whole one in the last bits."""
_SMALLEST, _LARGEST = -700.0, 700.0


@inlined
def quick_log(x: float) -> float:
    """Return the natural logarithm of a positive, normal number."""
    bits = np.float64(x).view(np.int64)
    exponent = float((bits >> 52) - 1023)
    m = np.int64((bits & _MANTISSA) | _ONE).view(np.float64)
    if m > 1.4142135623730951:
        m *= 0.5
        exponent += 1.0
    # 2·artanh(t) with |t| < 0.172, as a series to t^17.
    t = (m - 1.0) / (m + 1.0)
    w = t * t
    # In pairs, whose sums are independent.
    w2 = w * w
    low = (1 / 3 + w * (1 / 5)) + w2 * (1 / 7 + w * (1 / 9))
    high = (1 / 11 + w * (1 / 13)) + w2 * (1 / 15 + w * (1 / 17))
    series = w * (low + w2 * w2 * high)
    return exponent * _LN2_HIGH + (2.0 * t + (2.0 * t * series + exponent * _LN2_LOW))


@inlined
def quick_exp(x: float) -> float:
    """Return the exponential; beyond ±700 that of ±700."""
    x = min(max(x, _SMALLEST), _LARGEST)
    shifted = x * _LOG2_E + _ROUNDER
    whole = shifted - _ROUNDER
    r = (x - whole * _LN2_HIGH) - whole * _LN2_LOW
    # Taylor to r^11 with |r| < 0.347, in pairs, whose sums are independent.
    r2 = r * r
    r4 = r2 * r2
    low = (1.0 + r) + r2 * (1 / 2 + r * (1 / 6))
    middle = (1 / 24 + r * (1 / 120)) + r2 * (1 / 720 + r * (1 / 5040))
    high = (1 / 40320 + r * (1 / 362880)) + r2 * (1 / 3628800 + r * (1 / 39916800))
    scale = (np.float64(shifted).view(np.int64) + np.int64(1023)) << np.int64(52)
    return (low + r4 * (middle + r4 * high)) * np.int64(scale).view(np.float64)
