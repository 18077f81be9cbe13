"""Late binding: a kernel that calls a hook is written once, and bound to other functions for every filter.

    class Hooks(Protocol):                     declares each hook: signature, meaning, default
        @staticmethod
        def step(params: Params, ...) -> FilterState: ...

    hooks: Hooks = declare(Hooks)              the global through which kernels call: ``hooks.step(params, ...)``

    filled = fill(hooks, "Mahony", step=mahony.step)                 the same, with one filter's functions
    advance = rebind(driver.advance, ((hooks, filled),), "Mahony")   the kernel that calls these

A namespace is a module to Python, to Numba and to the translator into C, so each of them resolves ``hooks.step`` as it
resolves ``quat.rotate``: once, and not again for every sample. An editor and mypy see the declaration.
"""

import functools
import types
from collections.abc import Iterator
from typing import Any

from levelhead.compiler.mark import (
    KernelFunction,
    copy_kernel,
    global_names,
    is_kernel,
    list_mentions,
    list_reachable,
    replace_calls,
)
from levelhead.errors import nearest

Bindings = tuple[tuple[Any, Any], ...]  # (kernel or namespace, its replacement): either kind


class Namespace(types.ModuleType):
    """The members of a record of hooks; without them it is the declaration, which kernels are written against."""

    def __init__(self, record: type) -> None:
        super().__init__(record.__module__, record.__doc__)  # where its constants are defined
        self.__dict__["_record"] = record

    def __getattr__(self, name: str) -> Any:  # Any: whatever a record declares
        record = self._record.__name__
        raise AttributeError(f"{record}.{name} is not bound; engine.binding.bind binds a filter's functions")


def declare(record: type) -> Any:  # Any: mypy takes no Protocol for a type[T]
    """The namespace that a record of hooks declares, with nothing bound; annotate it with the record."""
    return Namespace(record)


def _declarations(record: type) -> Iterator[tuple[str, KernelFunction | None]]:
    """Name and declaration of each hook; None for a constant."""
    for name in record.__annotations__:
        yield name, None
    for name, member in vars(record).items():
        if isinstance(member, staticmethod):
            yield name, member.__func__


def fill(namespace: object, owner: str, **members: KernelFunction | int | None) -> Any:  # Any: a record, as ``declare``
    """A copy of a namespace with these members; None: an optional hook that is not given.

    A hook is optional if its declaration is a kernel: then that kernel runs.

    Raises:
        TypeError: a member is not bound, is not declared, or takes another number of arguments than its declaration.
    """
    assert isinstance(namespace, Namespace)
    record: type = namespace._record
    declared = dict(_declarations(record))
    for name in members:
        if name not in declared:
            raise TypeError(f"{record.__name__} of {owner}: there is no '{name}'; {nearest(name, list(declared))}")
    filled = Namespace(record)
    for name, declaration in declared.items():
        given = members.get(name)
        if given is None:
            if not is_kernel(declaration):
                raise TypeError(f"{record.__name__} of {owner}: '{name}' is not bound")
            given = declaration
        elif declaration is not None and isinstance(given, types.FunctionType):
            takes, wanted = given.__code__.co_argcount, declaration.__code__.co_argcount
            if takes != wanted:
                raise TypeError(
                    f"{record.__name__} of {owner}: '{name}' takes {wanted} arguments, "
                    f"but {given.__module__}.{given.__qualname__} takes {takes}"
                )
        setattr(filled, name, given)
    for name, declaration in declared.items():
        if getattr(filled, name) is declaration and declaration is not None:
            setattr(filled, name, rebind(declaration, ((namespace, filled),), owner))
    return filled


def _namespaces(function: KernelFunction) -> dict[str, Namespace]:
    """The namespaces that a kernel uses, by the name of the global."""
    found = {name: function.__globals__.get(name) for name in global_names(function)}
    return {name: value for name, value in found.items() if isinstance(value, Namespace)}


def _depends(function: KernelFunction, old: frozenset[int]) -> bool:
    """Whether a kernel reaches any of these kernels or namespaces, given by ``id``."""
    kernels = list_reachable(function)
    used = [*kernels, *(space for kernel in kernels for space in _namespaces(kernel).values())]
    return not old.isdisjoint(map(id, used))


@functools.cache
def rebind(function: KernelFunction, instead: Bindings, owner: str = "", inline: bool = False) -> KernelFunction:
    """A copy of a kernel that, however deep, uses other kernels and namespaces: ``instead`` are pairs (old, new).

    It is the kernel itself where it reaches none of them. ``owner`` goes into the copy's name, by which Numba's cache
    files differ; ``inline`` has it and the copies of its calls inlined whatever their mark. The calls have no owner:
    filters that bind them to the same functions share one copy, which Numba compiles once.
    """
    for old, new in instead:
        if function is old:
            return new  # type: ignore[no-any-return]
    if not _depends(function, frozenset(id(old) for old, _ in instead)):
        return function
    new_of = {id(old): new for old, new in instead}
    spaces = {name: new_of[id(space)] for name, space in _namespaces(function).items() if id(space) in new_of}
    twins = replace_calls(function, lambda called: rebind(called, instead, inline=inline)) | spaces
    twin = copy_kernel(function, twins, f"_{owner}" if owner else "", inline)
    mentions = tuple((name, id(value)) for name, value in list_mentions(twin))
    marks = (twin.__qualname__, twin.__defaults__, frozenset(twin.__dict__))
    return _copies.setdefault((twin.__code__, marks, mentions), twin)


_copies: dict[object, KernelFunction] = {}  # code, marks and mentions -> the one copy that has them
