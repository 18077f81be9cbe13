"""Kernels as programs for NVIDIA GPUs, by numba-cuda: the device twin of a kernel, as ``compile`` makes the CPU's.

Bits in double precision are meant to be those of a processor: NVVM is told not to contract a product and a sum into one
operation (``fma=0``; it then writes ``mul.rn`` and ``add.rn``, which the driver's assembler leaves apart), quotients
and roots are those of IEEE 754, and sines are the kernels' own. numba-cuda has no such option, so it is added where
numba-cuda hands a program to NVVM; with its link-time optimisation another compiler would come after, so that is off.
"""

import functools
import importlib.util
import threading
import types
import warnings
from collections.abc import Callable

import numpy as np

from levelhead.compiler.borders import CompiledFunction, Cuda, Table
from levelhead.compiler.mark import KernelFunction, list_mentions, replace_calls
from levelhead.errors import LevelheadError

BLOCK = 128  # threads of a block
Rounding = Callable[[float], float]  # of a constant, to single precision
_one_at_a_time = threading.Lock()


def require_gpu() -> None:
    """Makes sure that there is a GPU to work with, or numba-cuda's simulator of one.

    Raises:
        LevelheadError: numba-cuda, NVIDIA's compiler or a GPU is missing.
    """
    if importlib.util.find_spec("numba_cuda") is None:
        raise LevelheadError(
            "the engine 'cuda' needs numba-cuda and NVIDIA's compiler: pip install 'levelhead[cuda]' 'numba-cuda[cu12]'"
        )
    if not _cuda().is_available():
        raise LevelheadError(
            "the engine 'cuda' needs an NVIDIA GPU with its driver, and there is none here; use the engine 'auto'"
        )


def _cuda() -> Cuda:
    from numba import cuda

    return cuda


def _is_simulated() -> bool:
    """Whether numba-cuda runs programs as plain Python."""
    from numba import config

    return bool(config.ENABLE_CUDASIM)  # type: ignore[attr-defined]


def _no_contraction(compile_ir: KernelFunction) -> KernelFunction:
    @functools.wraps(compile_ir)
    def strict(ir: object, **options: object) -> object:
        return compile_ir(ir, **(options | {"fma": 0}))

    return strict


def _single(value: object, rounding: Rounding) -> object:
    """A constant in single precision: a float, or those inside a tuple."""
    if isinstance(value, float):
        return np.float32(rounding(value))
    if isinstance(value, tuple):
        parts = [_single(part, rounding) for part in value]
        return type(value)._make(parts) if hasattr(value, "_make") else tuple(parts)
    return value


@functools.cache
def _device_twin(function: KernelFunction, rounding: Rounding | None) -> CompiledFunction:
    """The twin that other twins call."""
    if function.__name__ == "thread_number":
        from levelhead.compiler import gpu_words

        return gpu_words.thread_number
    inline = not hasattr(function, "__noinline__")
    meaning = getattr(function, "__meaning__", function)
    twin = _twin(meaning, rounding)
    return twin if _is_simulated() else _cuda().jit(twin, device=True, forceinline=inline, lto=False)


def _twin(function: KernelFunction, rounding: Rounding | None) -> KernelFunction:
    names = replace_calls(function, lambda called: _device_twin(called, rounding))
    code = function.__code__
    if rounding is not None:
        code = code.replace(co_consts=tuple(_single(constant, rounding) for constant in code.co_consts))
        for name, value in list_mentions(function):
            module, dot, member = name.partition(".")
            if not isinstance(value, float | tuple):
                continue
            if not dot:
                names[name] = _single(value, rounding)
                continue
            if names[module] is function.__globals__[module]:
                copied = types.ModuleType(module)
                copied.__dict__.update(function.__globals__[module].__dict__)
                names[module] = copied
            setattr(names[module], member, _single(value, rounding))
    twin = types.FunctionType(code, names, function.__name__, function.__defaults__)
    twin.__module__, twin.__qualname__ = function.__module__, function.__qualname__
    return twin


class GpuProgram:
    """A kernel of one argument list, run by many threads at once; ``thread_number`` says to each which it is."""

    def __init__(self, function: KernelFunction, rounding: Rounding | None) -> None:
        """``rounding``: what a constant is in single precision; None: double."""
        self._jit = _cuda().jit(_twin(function, rounding), **({} if _is_simulated() else {"lto": False}))

    def run(self, threads: int, *arguments: Cuda) -> None:
        """The program in that many threads, or a few more, on arrays of ``to_gpu`` and ``on_gpu``."""
        with _one_at_a_time, _strict(), warnings.catch_warnings():
            warnings.filterwarnings("ignore", category=_performance_warning())  # few threads are the user's choice
            self._jit[-(-threads // BLOCK), min(BLOCK, threads)](*arguments)
            _cuda().synchronize()

    def ptx(self, arguments: tuple[Table, ...], capability: tuple[int, int]) -> str:
        """The program as PTX for a GPU of that compute capability, from examples of its arguments; needs no GPU."""
        import numba

        with _one_at_a_time, _strict():
            kinds = tuple(map(numba.typeof, arguments))
            text: str = _cuda().compile_ptx(self._jit.py_func, kinds, cc=capability)[0]
        return text


def _performance_warning() -> type[Warning]:
    from numba.core.errors import NumbaPerformanceWarning

    return NumbaPerformanceWarning


class _strict:
    """While a program is compiled: no contraction."""

    def __enter__(self) -> None:
        self._module: Cuda = None
        if _is_simulated():
            return
        from numba.cuda.cudadrv import nvvm

        self._module, self._plain = nvvm, nvvm.compile_ir
        nvvm.compile_ir = _no_contraction(nvvm.compile_ir)

    def __exit__(self, *failure: object) -> None:
        if self._module is not None:
            self._module.compile_ir = self._plain


def to_gpu(values: Table) -> Cuda:
    """A copy on the GPU."""
    return _cuda().to_device(values)


def on_gpu(shape: tuple[int, ...], dtype: type[np.generic]) -> Cuda:
    """An array there, with whatever is in it."""
    return _cuda().device_array(shape, dtype)


def from_gpu(values: Cuda) -> Table:
    """A copy here."""
    copied: Table = values.copy_to_host()
    return copied
