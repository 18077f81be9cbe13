"""Kernels as machine code: ``compiled`` makes the twin of a kernel from the same byte code, with every kernel that it
calls replaced by that kernel's own twin.

Both twins give the same bits: strict IEEE arithmetic, no ``fastmath`` and no fused multiply-add, so compiled code is
the Python prototype. ``error_model="numpy"`` only drops the ZeroDivisionError branches; kernels never divide by zero.
``_nrt=False`` drops the counting of references to a state's memory, a third of the time of a filter that has some:
the caller of compiled code holds the memory, and compiled code allocates none.
"""

import functools
import types
from pathlib import Path

from levelhead.compiler.borders import CompiledFunction, NumbaOptions
from levelhead.compiler.cache import OPTIONS, code_hash, remove_stale
from levelhead.compiler.mark import KernelFunction, list_reachable, replace_calls


def _copy_twin(function: KernelFunction, qualname: str, lanes: bool) -> KernelFunction:
    inline = functools.partial(_compile_inline, lanes=lanes)
    twin = types.FunctionType(
        function.__code__, replace_calls(function, inline), function.__name__, function.__defaults__
    )
    twin.__module__ = function.__module__
    twin.__qualname__ = qualname
    return twin


@functools.cache
def _compile_inline(function: KernelFunction, lanes: bool) -> CompiledFunction:
    """The compiled twin of a kernel that other kernels call; forced inline, so LLVM can use SIMD."""
    import numba

    if hasattr(function, "__native__"):
        from levelhead.compiler import intrinsics

        return getattr(intrinsics, function.__name__)
    from levelhead.compiler.linking import LaneCompiler, LinkedCompiler

    twin = _copy_twin(function, function.__qualname__, lanes)
    inline = not hasattr(function, "__noinline__")
    # Python never calls it, so the code for that is not compiled.
    alone: NumbaOptions = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    compiler = LaneCompiler if lanes else LinkedCompiler
    return numba.njit(forceinline=inline, nogil=True, pipeline_class=compiler, **alone, **OPTIONS)(twin)


SECONDS_PER_BYTE = 3e-4  # of byte code that a function reaches: 5 to 10 s for a filter with its driver
_announced: dict[object, str] = {}  # outermost functions of Numba -> the notice when one is compiled


def compile_notice(function: KernelFunction) -> str:
    """The notice before a function is compiled: its name, and about how long that takes.

    The time is that of 16 to 27 kB of byte code, measured on two cores; a filter of an hour's work takes longer.
    """
    _, bound, owner = function.__qualname__.partition(f"{function.__name__}_")
    what = owner.removesuffix("_unguarded") if bound else function.__name__
    if bound and not function.__name__.startswith("run"):  # a stream has several, each announced
        what += f" ({function.__name__})"
    size = sum(len(kernel.__code__.co_code) for kernel in list_reachable(function))
    return f"compiling {what} for this machine, once, about {max(round(SECONDS_PER_BYTE * size), 1)} s"


@functools.cache
def _register_listener() -> None:
    """Has Numba's compilations announced in the log, which without other wishes is standard error.

    Code that Numba's cache holds raises no event.
    """
    import logging

    from numba.core import event

    class CompileListener(event.Listener):
        def on_start(self, event: event.Event) -> None:
            notice = _announced.pop(event.data["dispatcher"].py_func, None)
            if notice is not None:
                logging.getLogger("levelhead").warning(notice)

        def on_end(self, event: event.Event) -> None:
            pass

    event.register("numba:compile", CompileListener())  # type: ignore[no-untyped-call]


@functools.cache
def compile_kernel(function: KernelFunction, releases_gil: bool = True, lanes: bool = False) -> CompiledFunction:
    """The compiled twin of an outermost kernel (a driver), kept on disk where there is a place for it.

    Long work lets other Python threads run meanwhile; for one sample giving the lock away costs more than the sample.
    ``lanes``: the kernel has a loop over lanes that is to become SIMD.

    Numba looks for a writable cache beside the source, then in the user's cache folder; where neither can be written
    (a read-only install and no home) the twin is compiled anew in each process instead of failing.
    """
    import numba

    _register_listener()
    code = code_hash(function)
    twin = _copy_twin(function, f"{function.__qualname__}_{code}", lanes)
    _announced[twin] = compile_notice(function)
    options = OPTIONS | {"nogil": releases_gil}
    try:
        dispatcher: CompiledFunction = numba.njit(cache=True, **options)(twin)
        remove_stale(Path(dispatcher.stats.cache_path), function.__qualname__, code)
        return dispatcher
    except RuntimeError as error:
        if "cache" not in str(error):
            raise
        return numba.njit(**options)(twin)
