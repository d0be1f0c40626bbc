"""Parts of kernels, inside numba; `kernel_compiler` says why and uses it where numba is known."""

# numba comes without complete types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUntypedBaseClass=false, reportPrivateUsage=false
# pyright: reportMissingSuperCall=false, reportUnknownParameterType=false, reportAttributeAccessIssue=false
# pyright: reportIncompatibleMethodOverride=false

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.dispatcher import _FunctionCompiler
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering
from numba.core.types.functions import BaseFunction

from curling_env.infrastructure.kernel_compiler import quick_compilation

_NEEDLESS_PASSES = {"nopython_rewrites", "inline_closure_likes", "with_lifting"}
"""For expressions of whole arrays, closures and blocks of `with`, none of which a kernel has."""


_find_types = BaseFunction.get_call_type
_found: dict[tuple[int, tuple[Any, ...]], tuple[Any, Any]] = {}
"""The types of operations, by the operation's identity and its operands; and the operation, so that
its identity stays its own."""


def _remember_types(operation: Any, context: Any, args: Any, kws: Any) -> Any:
    """What numba's `get_call_type` says, which tries each way to read the operands each time."""
    if kws:
        return _find_types(operation, context, args, kws)
    key = id(operation), tuple(args)
    known = _found.get(key)
    if known is None:
        known = _found[key] = operation, _find_types(operation, context, args, kws)
    return known[1]


@contextmanager
def remembered_types() -> Generator[None]:
    """Let numba find once, and not for each operation anew, what types it has on such operands."""
    with global_compiler_lock:
        before = BaseFunction.get_call_type
        BaseFunction.get_call_type = _remember_types
        try:
            yield
        finally:
            BaseFunction.get_call_type = before


class _PartLibrary(JITCodeLibrary):
    """Code that waits to be linked into that of kernels, which then is optimised as a whole."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


def _needed(state: Any) -> PassManager:
    """Numba's passes without those that a kernel does not need."""
    passes = PassManager("kernel")
    stages = (
        DefaultPassBuilder.define_untyped_pipeline,
        DefaultPassBuilder.define_typed_pipeline,
        DefaultPassBuilder.define_nopython_lowering_pipeline,
    )
    for stage in stages:
        passes.passes += [
            entry for entry in stage(state).passes if entry[0].name() not in _NEEDLESS_PASSES
        ]
    return passes


class _Passes(CompilerBase):
    """How a kernel is compiled."""

    def define_pipelines(self) -> list[PassManager]:
        state: Any = self.state
        if state.flags.nrt:  # it has arrays of its own, and perhaps expressions of them
            return [DefaultPassBuilder.define_nopython_pipeline(state)]
        passes = _needed(state)
        passes.finalize()
        return [passes]


class _PartPasses(CompilerBase):
    """How a part is compiled."""

    def define_pipelines(self) -> list[PassManager]:
        state: Any = self.state
        state.flags.no_compile = True
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        passes = _needed(state)
        passes.add_pass_after(_DeclarePart, NativeLowering)
        passes.finalize()
        return [passes]


@register_pass(mutates_CFG=False, analysis_only=False)
class _DeclarePart(LoweringPass):
    """Let kernels call a part that has no machine code of its own."""

    _name = "declare_part"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        lowered = state["cr"]
        name = state.func_id.func_qualname

        def called(*_: Any, **__: Any) -> None:
            raise TypeError(f"{name} is part of kernels; from Python call {name}.py_func")

        state.targetctx.insert_user_function(called, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=called)
        return True


class _SharedFlags(Flags):
    """Options of a compilation, equal only to themselves: equal ones are made one by `_shared`.

    numba looks up how an operation is compiled by these among others, for each operation.
    """

    __slots__ = ()
    __hash__ = object.__hash__

    def __eq__(self, other: Any) -> bool:
        return self is other

    def copy(self) -> _SharedFlags:
        return self


_shared: dict[str, _SharedFlags] = {}


class _Compiler(_FunctionCompiler):
    """numba's compiler of a function, with shared options."""

    def _customize_flags(self, flags: Any) -> Any:
        if flags.nrt:  # numba copies and changes them where it compiles an expression of arrays
            return flags
        own = _SharedFlags(flags)
        return _shared.setdefault(repr(own), own)


class Kernel(CPUDispatcher):
    """A function in compiled code, called from Python and from other kernels."""

    _passes: Any = _Passes

    def __init__(
        self,
        py_func: Any,
        locals: Any = None,
        targetoptions: Any = None,
        pipeline_class: Any = None,
    ) -> None:
        passes = pipeline_class or self._passes
        super().__init__(py_func, locals, targetoptions, passes)
        self._compiler = _Compiler(py_func, self.targetdescr, targetoptions, {}, passes)

    def compile(self, sig: Any) -> Any:
        with quick_compilation():
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        # A constant is compiled as any other number of its kind.
        args = tuple(types.unliteral(arg) for arg in args)
        return super().get_call_template(args, {k: types.unliteral(v) for k, v in kws.items()})


class Part(Kernel):
    """A function in compiled code without an entry for Python."""

    _passes = _PartPasses

    def add_overload(self, cres: Any) -> None:
        # Not told to numba's C code, which would call an entry that is not there.
        self.overloads[tuple(cres.signature.args)] = cres
