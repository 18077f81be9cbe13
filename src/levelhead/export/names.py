"""The meaning of names in a kernel: the Python objects behind them, the arguments of calls, names read and written."""

import ast
import builtins
import functools
import types
from collections.abc import Container
from typing import Any

from levelhead.compiler.mark import KernelFunction

PythonObject = Any  # the value of a kernel's global: a number, a class, a module, a function
MISSING = object()
ALLOCATIONS = {"empty", "zeros"}  # of NumPy; ``arrays.zeros`` is marked


def resolve_name(function: KernelFunction, node: ast.AST, local: Container[str] = ()) -> PythonObject:
    """The Python object of a name or ``module.name``; ``MISSING`` where it is a value of the kernel."""
    found: object = MISSING
    if isinstance(node, ast.Name) and node.id not in local:
        found = function.__globals__.get(node.id, getattr(builtins, node.id, MISSING))
    elif isinstance(node, ast.Attribute):
        owner = resolve_name(function, node.value, local)
        if isinstance(owner, types.ModuleType):
            found = getattr(owner, node.attr, MISSING)
    return getattr(found, "__meaning__", found)


def allocation(function: KernelFunction, node: ast.AST, local: Container[str] = ()) -> ast.expr | None:
    """The shape in ``zeros(count)``, ``np.zeros(shape)`` or ``np.empty(shape)``; None for anything else."""
    if not isinstance(node, ast.Call) or len(node.args) != 1:
        return None
    called = resolve_name(function, node.func, local)
    if hasattr(called, "__memory__"):
        return node.args[0]
    of_numpy = str(getattr(called, "__module__", "")).partition(".")[0] == "numpy"
    return node.args[0] if of_numpy and getattr(called, "__name__", "") in ALLOCATIONS else None


def arguments(node: ast.Call, function: KernelFunction) -> list[ast.expr]:
    """The arguments of a call in the order of the parameters."""
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    return list((by_field(node, list(names)) or {}).values())


def by_field(node: ast.Call, names: list[str]) -> dict[str, ast.expr] | None:
    """Name -> value of a call's arguments, in order; None unless each is given once."""
    given = dict(zip(names, node.args, strict=False))
    for keyword in node.keywords:
        if keyword.arg is None or keyword.arg in given:
            return None
        given[keyword.arg] = keyword.value
    if len(node.args) > len(names) or set(given) != set(names):
        return None
    return {name: given[name] for name in names}


@functools.cache
def loaded_in(node: ast.AST) -> frozenset[str]:
    """Names that are read somewhere inside."""
    found = frozenset(
        part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Load)
    )
    added = (part.target for part in ast.walk(node) if isinstance(part, ast.AugAssign))
    return found | {target.id for target in added if isinstance(target, ast.Name)}


@functools.cache
def stored_in(node: ast.AST) -> frozenset[str]:
    """Names that get a value somewhere inside."""
    return frozenset(
        part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)
    )
