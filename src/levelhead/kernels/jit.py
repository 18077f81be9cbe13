"""What makes a function a kernel, and the only place with Numba options.

A kernel is a plain Python function in a small language: floats, NamedTuples of floats, ``math``, ``if``, bounded
``for``, calls of other kernels. ``@kernel`` leaves it as it is, so plain Python pays nothing for it and Numba is not
even imported. ``compiled`` makes its machine-code twin: the same byte code, with every kernel that it calls replaced
by that kernel's own twin.

Both twins give the same bits: strict IEEE arithmetic, no ``fastmath`` and no fused multiply-add, so what is
prototyped in Python is what runs compiled. ``error_model="numpy"`` only drops the ZeroDivisionError branches; kernels
never divide by zero. ``_nrt=False`` drops the counting of references to a state's memory, a third of the time of a
filter that has some: whoever calls compiled code holds the memory, and compiled code allocates none.
"""

import contextlib
import dis
import functools
import re
import sys
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar, TypeGuard, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}


def kernel(function: F) -> F:
    """Mark ``function`` as written in the kernel language; it is returned unchanged."""
    function.__kernel__ = True  # type: ignore[attr-defined]
    return function


def rare(function: F) -> F:
    """Mark a kernel that few samples reach, or that stands in many places: compiled code calls it instead of having it
    inline, which keeps what every sample runs through small."""
    function.__apart__ = True  # type: ignore[attr-defined]
    return kernel(function)


def word(meaning: Callable[..., Any]) -> Callable[[F], F]:
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


def apart(function: Callable[..., Any]) -> Callable[..., Any]:
    """A copy of a kernel that is ``rare``."""
    return rare(bound(function, "apart"))


def _mentioned(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
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
            waiting += [value for _, value in _mentioned(current) if is_kernel(value)]
    return list(found.values())


def _code_text(code: types.CodeType) -> str:
    """Byte code, constants and names as text that is the same in every process.

    ``repr`` of a nested code object (a comprehension before Python 3.12) holds its address in memory; its own text
    stands for it. Sets have no order of their own.
    """
    constants = [_code_text(c) if isinstance(c, types.CodeType) else _constant_text(c) for c in code.co_consts]
    names = [*code.co_names, *code.co_varnames, *code.co_freevars, *code.co_cellvars]
    return "\n".join([code.co_name, code.co_code.hex(), *constants, *names])


def _constant_text(value: object) -> str:
    return f"frozenset {sorted(map(repr, value))}" if isinstance(value, frozenset) else repr(value)


def _fingerprint(function: Callable[..., Any]) -> str:
    """A kernel's code and the constants and NamedTuples that it mentions, as text."""
    called = "apart" if hasattr(function, "__apart__") else "inline"
    parts = [f"{function.__module__}.{function.__qualname__} {called}", _code_text(function.__code__)]
    if hasattr(function, "__native__"):
        parts.append(Path(__file__).with_name("native.py").read_text(encoding="utf-8"))
    for name, value in _mentioned(function):
        if isinstance(value, type) and hasattr(value, "_fields"):
            parts.append(f"{name}: {value._fields}")
        elif isinstance(value, int | float | tuple):
            parts.append(f"{name} = {value!r}")
    return "\n".join(parts)


def code_hash(function: Callable[..., Any]) -> str:
    """Sixteen hexadecimal digits of the code of all the kernels that ``function`` reaches.

    Numba's own cache looks only at the file of the outermost function: an edited callee would be served stale. With
    this in the name of the outermost function it cannot be. It is the code as loaded that counts, not the file: the
    file may have been edited since.
    """
    import hashlib

    texts = sorted(map(_fingerprint, reached(function)))
    return hashlib.sha256("\n\n".join([*texts, repr(OPTIONS)]).encode()).hexdigest()[:16]


def _globals_with(function: Callable[..., Any], change: Callable[[Any], Any]) -> dict[str, Any]:
    """The function's globals, with each kernel that it calls (also those inside modules) replaced by ``change(it)``."""
    twins = dict(function.__globals__)
    for name, value in _mentioned(function):
        if not is_kernel(value):
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


@functools.cache
def swapped(function: Callable[..., Any], instead: tuple[tuple[Any, Any], ...]) -> Callable[..., Any]:
    """A copy of a kernel that, however deep, calls other kernels instead of some: ``instead`` are pairs (old, new).

    It is the kernel itself where it reaches none of them.
    """
    for old, new in instead:
        if function is old:
            return new  # type: ignore[no-any-return]
    if not {old for old, _ in instead} & set(reached(function)):
        return function
    twin = types.FunctionType(
        function.__code__,
        _globals_with(function, lambda called: swapped(called, instead)),
        function.__name__,
        function.__defaults__,
    )
    twin.__module__ = function.__module__
    twin.__qualname__ = function.__qualname__
    return kernel(twin)


def _rebuilt(function: Callable[..., Any], qualname: str) -> Callable[..., Any]:
    twin = types.FunctionType(
        function.__code__, _globals_with(function, _inlined), function.__name__, function.__defaults__
    )
    twin.__module__ = function.__module__
    twin.__qualname__ = qualname
    return twin


@functools.cache
def _inlined(function: Callable[..., Any]) -> Any:
    """The compiled twin of a kernel that other kernels call; forced inline, which is what lets LLVM use SIMD."""
    import numba

    if hasattr(function, "__native__"):
        from levelhead.kernels import native

        return getattr(native, function.__name__)
    twin = _rebuilt(function, function.__qualname__)
    inline = not hasattr(function, "__apart__")
    # Python never calls it, so that nothing of what that would need has to be compiled.
    alone: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return numba.njit(forceinline=inline, nogil=True, **alone, **OPTIONS)(twin)


class Compiling:
    """Who is told when machine code is to be made: for a large filter that takes half a minute, once per machine."""

    told: ClassVar[list[Callable[[], None]]] = []


@functools.cache
def _listen() -> None:
    """Has Numba say when it compiles; what it finds in its cache it does not say."""
    from numba.core import event

    class Begun(event.Listener):
        def on_start(self, event: Any) -> None:
            for tell in Compiling.told:
                tell()

        def on_end(self, event: Any) -> None:
            pass

    event.register("numba:compile", Begun())  # type: ignore[no-untyped-call]


def remove_stale(folder: Path, qualname: str, code: str) -> None:
    """Remove from a cache folder what this Python compiled of ``qualname`` when its code had another hash."""
    python = f"py{sys.version_info.major}{sys.version_info.minor}"
    name = re.compile(rf".*\.{re.escape(qualname)}_([0-9a-f]{{16}})-\d+\.{python}\..*nb[ic]")
    for path in folder.glob("*.nb?"):
        match = name.fullmatch(path.name)
        if match and match[1] != code:
            with contextlib.suppress(OSError):  # another process was first, or the folder is only to be read
                path.unlink()


@functools.cache
def compiled(function: Callable[..., Any], releases_gil: bool = True) -> Any:
    """The compiled twin of an outermost kernel (a driver), kept on disk where there is a place for it.

    Long work lets other Python threads run meanwhile; for one sample giving the lock away costs more than the sample.

    Numba looks for a writable cache beside the source, then in the user's cache folder; where neither can be written
    (a read-only install and no home) the twin is compiled anew in each process instead of failing.
    """
    import numba

    _listen()
    code = code_hash(function)
    twin = _rebuilt(function, f"{function.__qualname__}_{code}")
    options = OPTIONS | {"nogil": releases_gil}
    try:
        dispatcher = numba.njit(cache=True, **options)(twin)
        remove_stale(Path(dispatcher.stats.cache_path), function.__qualname__, code)
        return dispatcher
    except RuntimeError as error:
        if "cache" not in str(error):
            raise
        return numba.njit(**options)(twin)
