"""The mark that makes a function a kernel, and copies of a kernel that call others; no Numba here.

A kernel is a plain Python function in a small language: floats, NamedTuples of floats, ``math``, ``if``, bounded
``for``, calls of other kernels. ``@kernel`` leaves it as it is, so plain Python pays nothing for it.
"""

import dis
import functools
import types
from collections.abc import Callable, Iterator
from typing import Any, TypeGuard, TypeVar

KernelFunction = Callable[..., Any]  # Any: each kernel has its own parameters and result; late binding has neither
F = TypeVar("F", bound=KernelFunction)


def kernel(function: F) -> F:
    """Mark ``function`` as written in the kernel language; it is returned unchanged."""
    function.__kernel__ = True  # type: ignore[attr-defined]
    return function


def noinline(function: F) -> F:
    """Mark a kernel that few samples reach, or that many places use: compiled code calls it instead of having it
    inline, which keeps the code of every sample small."""
    function.__noinline__ = True  # type: ignore[attr-defined]
    return kernel(function)


def compiled_only(function: F) -> F:
    """Mark a function that is written for Numba alone.

    It uses features that the kernel language lacks, and a test searches for it: addresses, ``while``, two-dimensional
    arrays, ``raise``. Nothing translates it into C, and no kernel calls it.
    """
    function.__compiled_only__ = True  # type: ignore[attr-defined]
    return function


def primitive(meaning: KernelFunction) -> Callable[[F], F]:
    """Mark a word of the kernel language: plain Python runs it unchanged, compiled code the function of its name in
    ``compiler/intrinsics.py``; its meaning is the kernel ``meaning``, from which C is made."""

    def mark(function: F) -> F:
        function.__native__ = True  # type: ignore[attr-defined]
        function.__meaning__ = meaning  # type: ignore[attr-defined]
        return kernel(function)

    return mark


def is_compilable(value: object) -> TypeGuard[KernelFunction]:
    """Whether Numba compiles ``value``: a kernel, or a function that is marked ``compiled_only``."""
    return is_kernel(value) or bool(getattr(value, "__compiled_only__", False))


def is_kernel(value: object) -> TypeGuard[KernelFunction]:
    """Whether ``value`` is a plain-Python kernel."""
    return bool(getattr(value, "__kernel__", False))


def copy_kernel(
    function: KernelFunction, names: dict[str, object], suffix: str = "", inline: bool = False
) -> KernelFunction:
    """A copy of a kernel with other globals; marked as the kernel is, but inlined if ``inline``."""
    twin = types.FunctionType(function.__code__, names, function.__name__, function.__defaults__)
    twin.__module__ = function.__module__
    twin.__qualname__ = function.__qualname__ + suffix
    twin.__annotations__ = function.__annotations__
    twin.__dict__.update(function.__dict__)
    if inline:
        twin.__dict__.pop("__noinline__", None)
    return twin


def with_globals(function: KernelFunction, name: str, **kernels: object) -> KernelFunction:
    """A copy of a kernel in which the global names in ``kernels`` mean these kernels or numbers.

    ``name`` goes into the name of the copy, by which Numba's cache files differ.
    """
    return copy_kernel(function, function.__globals__ | kernels, f"_{name}")


def instance(function: KernelFunction, name: str, **kernels: object) -> KernelFunction:
    """The same with a name of its own, for a kernel of which one program has several copies."""
    twin = with_globals(function, name, **kernels)
    twin.__name__ = name
    return twin


def list_mentions(function: KernelFunction) -> Iterator[tuple[str, object]]:
    """The names in the function's byte code: globals, and members of modules that are globals, as (name, value).

    A field of a tuple may have the name of a global; only loaded globals count. The value is None where a
    namespace of hooks has no such member yet.

    Raises:
        TypeError: a module inside a module is mentioned, as in ``engine.driver.advance``; import the inner one.
    """
    module = ""
    for loads_global, loaded in _loads(function.__code__):
        if loads_global and loaded in function.__globals__:
            value = function.__globals__[loaded]
            if isinstance(value, types.ModuleType):
                module = loaded
            else:
                yield loaded, value
        elif module and not loads_global:
            name, value = f"{module}.{loaded}", getattr(function.__globals__[module], loaded, None)
            if isinstance(value, types.ModuleType):
                raise TypeError(f"{function.__module__}.{function.__qualname__} uses {name}.…; import {name} by itself")
            yield name, value
            module = ""


def global_names(function: KernelFunction) -> set[str]:
    """The names of the globals that the function's byte code loads."""
    return {loaded for loads_global, loaded in _loads(function.__code__) if loads_global}


@functools.cache
def _loads(code: types.CodeType) -> tuple[tuple[bool, str], ...]:
    """The names that byte code loads, in order: whether it is a global, else a member; and its name."""
    words = ("LOAD_GLOBAL", "LOAD_ATTR", "LOAD_METHOD")
    return tuple(
        (step.opname == "LOAD_GLOBAL", step.argval) for step in dis.get_instructions(code) if step.opname in words
    )


def list_reachable(function: KernelFunction) -> list[KernelFunction]:
    """The kernel itself and every kernel that it calls, directly or not."""
    found: dict[int, KernelFunction] = {}
    waiting = [function]
    while waiting:
        current = waiting.pop()
        if id(current) not in found:
            found[id(current)] = current
            waiting += [value for _, value in list_mentions(current) if is_compilable(value)]
    return list(found.values())


def replace_calls(function: KernelFunction, change: Callable[[KernelFunction], object]) -> dict[str, object]:
    """The function's globals, with each kernel that it calls (also those inside modules) replaced by ``change(it)``."""
    twins = dict(function.__globals__)
    for name, value in list_mentions(function):
        if not is_compilable(value):
            continue
        module, dot, member = name.partition(".")
        if not dot:
            twins[name] = change(value)
            continue
        if twins[module] is function.__globals__[module]:
            twins[module] = types.ModuleType(module)
            twins[module].__dict__.update(function.__globals__[module].__dict__)
        setattr(twins[module], member, change(value))
    return twins
