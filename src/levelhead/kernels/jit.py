"""What makes a function a kernel, and the only place with Numba options.

A kernel is a plain Python function in a small language: floats, NamedTuples of floats, ``math``, ``if``, bounded
``for``, calls of other kernels. ``@kernel`` leaves it as it is, so plain Python pays nothing for it and Numba is not
even imported. ``compiled`` makes its machine-code twin: the same byte code, with every kernel that it calls replaced
by that kernel's own twin.

Both twins give the same bits: strict IEEE arithmetic, no ``fastmath`` and no fused multiply-add, so what is
prototyped in Python is what runs compiled. ``error_model="numpy"`` only drops the ZeroDivisionError branches; kernels
never divide by zero.
"""

import functools
import hashlib
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Mark ``function`` as written in the kernel language; it is returned unchanged."""
    function.__kernel__ = True  # type: ignore[attr-defined]
    return function


def is_kernel(value: object) -> TypeGuard[Callable[..., Any]]:
    """Whether ``value`` is a plain-Python kernel."""
    return bool(getattr(value, "__kernel__", False))


def bound(function: Callable[..., Any], name: str, **kernels: Callable[..., Any]) -> Callable[..., Any]:
    """A copy of the kernel ``function`` in which the global names in ``kernels`` mean these kernels.

    This is how one driver serves every filter, in plain Python as well as compiled. ``name`` goes into the name of
    the copy: Numba's cache files are told apart by it.
    """
    twin = types.FunctionType(
        function.__code__, function.__globals__ | kernels, function.__name__, function.__defaults__
    )
    twin.__module__ = function.__module__
    twin.__qualname__ = f"{function.__qualname__}_{name}"
    return kernel(twin)


def _called(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """Global names that the function's byte code mentions and that exist: (name, value)."""
    for name in function.__code__.co_names:
        if name in function.__globals__:
            yield name, function.__globals__[name]


def _reached(function: Callable[..., Any], seen: dict[int, Callable[..., Any]]) -> None:
    if id(function) in seen:
        return
    seen[id(function)] = function
    for _, value in _called(function):
        if isinstance(value, types.ModuleType):
            for name in function.__code__.co_names:
                member = getattr(value, name, None)
                if is_kernel(member):
                    _reached(member, seen)
        elif is_kernel(value):
            _reached(value, seen)


def source_hash(function: Callable[..., Any]) -> str:
    """Sixteen hexadecimal digits of the sources of all the kernels that ``function`` reaches.

    Numba's own cache looks only at the file of the outermost function: an edited callee would be served stale. With
    this in the name of the outermost function it cannot be.
    """
    seen: dict[int, Callable[..., Any]] = {}
    _reached(function, seen)
    digest = hashlib.sha256()
    for path in sorted({kernel_function.__code__.co_filename for kernel_function in seen.values()}):
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()[:16]


def _twin_globals(function: Callable[..., Any]) -> dict[str, Any]:
    """The function's globals, with kernels (also those inside modules) replaced by their compiled twins."""
    twins = dict(function.__globals__)
    for name, value in _called(function):
        if is_kernel(value):
            twins[name] = _inlined(value)
        elif isinstance(value, types.ModuleType):
            members = {
                member: _inlined(getattr(value, member))
                for member in function.__code__.co_names
                if is_kernel(getattr(value, member, None))
            }
            if members:
                twins[name] = types.ModuleType(value.__name__)
                twins[name].__dict__.update(value.__dict__ | members)
    return twins


def _rebuilt(function: Callable[..., Any], qualname: str) -> Callable[..., Any]:
    twin = types.FunctionType(function.__code__, _twin_globals(function), function.__name__, function.__defaults__)
    twin.__module__ = function.__module__
    twin.__qualname__ = qualname
    return twin


@functools.cache
def _inlined(function: Callable[..., Any]) -> Any:
    """The compiled twin of a kernel that other kernels call; forced inline, which is what lets LLVM use SIMD."""
    import numba

    return numba.njit(forceinline=True, error_model="numpy", nogil=True)(_rebuilt(function, function.__qualname__))


@functools.cache
def compiled(function: Callable[..., Any], releases_gil: bool = True) -> Any:
    """The compiled twin of an outermost kernel (a driver), kept on disk where there is a place for it.

    Long work lets other Python threads run meanwhile; for one sample giving the lock away costs more than the sample.

    Numba looks for a writable cache beside the source, then in the user's cache folder; where neither can be written
    (a read-only install and no home) the twin is compiled anew in each process instead of failing.
    """
    import numba

    twin = _rebuilt(function, f"{function.__qualname__}_{source_hash(function)}")
    options: dict[str, Any] = {"error_model": "numpy", "nogil": releases_gil}
    try:
        return numba.njit(cache=True, **options)(twin)
    except RuntimeError as error:
        if "cache" not in str(error):
            raise
        return numba.njit(**options)(twin)


def is_cached(dispatcher: Any) -> bool:
    """Whether everything that a compiled driver ran so far came out of the cache on disk (nothing was compiled)."""
    misses: int = sum(dispatcher.stats.cache_misses.values())
    return misses == 0
