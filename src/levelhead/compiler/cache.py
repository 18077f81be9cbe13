"""The key under which machine code is kept: the same in every process, another for every change of the code."""

import contextlib
import re
import sys
import types
from pathlib import Path

from levelhead.compiler.borders import NumbaOptions
from levelhead.compiler.mark import KernelFunction, is_compilable, list_mentions

OPTIONS: NumbaOptions = {"error_model": "numpy", "_nrt": False}


def _code_text(code: types.CodeType) -> str:
    """Byte code, constants and names as text that is the same in every process.

    ``repr`` of a nested code object (a comprehension before Python 3.12) holds its address in memory; its own text
    replaces it. Sets have no order of their own.
    """
    constants = [_code_text(c) if isinstance(c, types.CodeType) else _constant_text(c) for c in code.co_consts]
    names = [*code.co_names, *code.co_varnames, *code.co_freevars, *code.co_cellvars]
    return "\n".join([code.co_name, code.co_code.hex(), *constants, *names])


def _constant_text(value: object) -> str:
    return f"frozenset {sorted(map(repr, value))}" if isinstance(value, frozenset) else repr(value)


def fingerprint(function: KernelFunction) -> str:
    """A kernel's code and the constants and NamedTuples that it mentions, as text."""
    called = "called" if hasattr(function, "__noinline__") else "inline"
    parts = [f"{function.__module__}.{function.__qualname__} {called}", _code_text(function.__code__)]
    if hasattr(function, "__native__"):
        parts.append(Path(__file__).with_name("intrinsics.py").read_text(encoding="utf-8"))
    for name, value in list_mentions(function):
        if isinstance(value, type) and hasattr(value, "_fields"):
            parts.append(f"{name}: {value._fields}")
        elif isinstance(value, int | float | tuple):
            parts.append(f"{name} = {value!r}")
    return "\n".join(parts)


def code_hash(function: KernelFunction) -> str:
    """Sixteen hexadecimal digits of the code of all the kernels that ``function`` reaches, and of which calls which.

    Numba's own cache looks only at the file of the outermost function: an edited callee would be served stale. With
    this in the name of the outermost function it cannot be. It is the code as loaded that counts, not the file: the
    file may have been edited since.
    """
    import hashlib

    found: dict[int, str] = {}

    def digest(one: KernelFunction) -> str:
        if id(one) not in found:
            calls = [f"{name} {digest(value)}" for name, value in list_mentions(one) if is_compilable(value)]
            found[id(one)] = hashlib.sha256("\n".join([fingerprint(one), *calls, repr(OPTIONS)]).encode()).hexdigest()
        return found[id(one)]

    return digest(function)[:16]


def remove_stale(folder: Path, qualname: str, code: str) -> None:
    """Remove from a cache folder the machine code of ``qualname`` by this Python under another hash."""
    python = f"py{sys.version_info.major}{sys.version_info.minor}"
    name = re.compile(rf".*\.{re.escape(qualname)}_([0-9a-f]{{16}})-\d+\.{python}\..*nb[ic]")
    for path in folder.glob("*.nb?"):
        match = name.fullmatch(path.name)
        if match and match[1] != code:
            with contextlib.suppress(OSError):  # another process was first, or the folder is only to be read
                path.unlink()
