"""Keeps a filter's state between two calls of a compiled function, outside of Python objects.

Handing a nested NamedTuple to machine code and back costs microseconds a call, because Python builds every tuple and
float anew. A ``Slot`` is a piece of memory that compiled code loads a value from and stores it to, as it stands.
"""

import hashlib
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.engine.driver import unbound
from levelhead.kernels.jit import bound, compiled, kernel

load = store = unbound


class Slot(NamedTuple):
    """How compiled code loads and stores values of one type, and the bytes that one takes."""

    load: Any  # load(address) -> value
    store: Any  # store(address, value)
    peek: Any  # the same, callable from Python
    poke: Any
    size: int


@kernel
def peek(address: int) -> Any:
    """The value at an address."""
    return load(address)


@kernel
def poke(address: int, value: Any) -> None:
    """Puts a value at an address."""
    store(address, value)


def slot(example: Any, name: str) -> Slot:
    """A slot for values of the type of ``example`` (floats, ints, bools and NamedTuples of these)."""
    import numba
    from numba.core import types
    from numba.core.registry import cpu_target
    from numba.extending import intrinsic

    kind: Any = numba.typeof(example)  # type: ignore[no-untyped-call]

    @intrinsic
    def load(typing_context: Any, address: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            model = context.data_model_manager[kind]
            pointer = builder.inttoptr(args[0], model.get_data_type().as_pointer())
            return model.load_from_data_pointer(builder, pointer)

        return kind(types.intp), code

    @intrinsic
    def store(typing_context: Any, address: Any, value: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            model = context.data_model_manager[kind]
            pointer = builder.inttoptr(args[0], model.get_data_type().as_pointer())
            builder.store(model.as_data(builder, args[1]), pointer)
            return context.get_dummy_value()

        return types.void(types.intp, kind), code

    # Nothing that peek and poke call tells the type, so their names must: a cached one of another layout would crash.
    layout = f"{name}_{hashlib.sha256(str(kind).encode()).hexdigest()[:16]}"
    target = cpu_target.target_context
    size = target.get_abi_sizeof(target.data_model_manager[kind].get_data_type())
    return Slot(
        load,
        store,
        compiled(bound(peek, layout, load=load)),
        compiled(bound(poke, layout, store=store)),
        (size + 7) // 8 * 8,  # whole words, so that what stands behind is aligned as well
    )


def allocate(size: int) -> tuple[NDArray[np.uint64], int]:
    """Zeroed, aligned memory for that many bytes (whole words), and its address; it lives as long as the array does."""
    memory = np.zeros(size // 8, np.uint64)
    return memory, int(memory.ctypes.data)


def entry_point(function: Any, arguments: str) -> Any:
    """The machine code of a compiled function behind no type dispatch: ``arguments`` is "i" (int), "f" (float) or "v"
    (tuple of three floats) for each."""
    from numba.core import types

    kinds = {"i": types.intp, "f": types.float64, "v": types.UniTuple(types.float64, 3)}  # type: ignore[no-untyped-call]
    return function.compile(tuple(kinds[letter] for letter in arguments))
