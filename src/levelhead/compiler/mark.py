"""What makes a function a kernel, and copies of a kernel that call others; no Numba here.

A kernel is a plain Python function in a small language: floats, NamedTuples of floats, ``math``, ``if``, bounded
``for``, calls of other kernels. ``@kernel`` leaves it as it is, so plain Python pays nothing for it.
"""

import dis
import types
from collections.abc import Callable, Iterator
from typing import Any, TypeGuard, TypeVar

WIDE = 28  # numbers of the rows that ``arrays.subtract_rows`` takes, which vector registers hold at once

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Mark ``function`` as written in the kernel language; it is returned unchanged."""
    function.__kernel__ = True  # type: ignore[attr-defined]
    return function


def noinline(function: F) -> F:
    """Mark a kernel that few samples reach, or that stands in many places: compiled code calls it instead of having it
    inline, which keeps what every sample runs through small."""
    function.__noinline__ = True  # type: ignore[attr-defined]
    return kernel(function)


def primitive(meaning: Callable[..., Any]) -> Callable[[F], F]:
    """Mark a word of the kernel language: plain Python runs it as it stands, compiled code what has its name in
    ``native``; what it means is the kernel ``meaning``, from which C is made."""

    def mark(function: F) -> F:
        function.__native__ = True  # type: ignore[attr-defined]
        function.__meaning__ = meaning  # type: ignore[attr-defined]
        return kernel(function)

    return mark


def is_kernel(value: object) -> TypeGuard[Callable[..., Any]]:
    """Whether ``value`` is a plain-Python kernel."""
    return bool(getattr(value, "__kernel__", False))


def bound(function: Callable[..., Any], name: str, **kernels: Any) -> Callable[..., Any]:
    """A copy of the kernel ``function`` in which the global names in ``kernels`` mean these kernels (or numbers).

    This is how one driver serves every filter, in plain Python as well as compiled. ``name`` goes into the name of
    the copy: Numba's cache files are told apart by it.
    """
    twin = types.FunctionType(
        function.__code__, function.__globals__ | kernels, function.__name__, function.__defaults__
    )
    twin.__module__ = function.__module__
    twin.__qualname__ = f"{function.__qualname__}_{name}"
    return kernel(twin)


def instance(function: Callable[..., Any], name: str, **kernels: Any) -> Callable[..., Any]:
    """The same with a name of its own, for a kernel of which one program has several copies."""
    twin = bound(function, name, **kernels)
    twin.__name__ = name
    return twin


def apart(function: Callable[..., Any]) -> Callable[..., Any]:
    """A copy of a kernel that is called, not inlined."""
    return noinline(bound(function, "apart"))


def mentioned(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """What the function's byte code mentions: globals, and members of modules that are globals, as (name, value).

    A field of a tuple may have the name of a global; only what is loaded as a global counts.
    """
    module = ""
    for step in dis.get_instructions(function):
        if step.opname == "LOAD_GLOBAL" and step.argval in function.__globals__:
            value = function.__globals__[step.argval]
            if isinstance(value, types.ModuleType):
                module = step.argval
            else:
                yield step.argval, value
        elif module and step.opname in ("LOAD_ATTR", "LOAD_METHOD"):
            yield f"{module}.{step.argval}", getattr(function.__globals__[module], step.argval)
            module = ""


def reached(function: Callable[..., Any]) -> list[Callable[..., Any]]:
    """The kernel itself and every kernel that it calls, directly or not."""
    found: dict[int, Callable[..., Any]] = {}
    waiting = [function]
    while waiting:
        current = waiting.pop()
        if id(current) not in found:
            found[id(current)] = current
            waiting += [value for _, value in mentioned(current) if is_kernel(value)]
    return list(found.values())
