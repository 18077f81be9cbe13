"""Keeps a filter's state between two calls of a compiled function, outside of Python objects.

Handing a nested NamedTuple to machine code and back costs microseconds a call, because Python builds every tuple and
float anew. A ``Slot`` is a piece of memory that compiled code loads a value from and stores it to, unchanged.
"""

import struct
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from levelhead.compiler.borders import (
    Builder,
    CodeContext,
    CompiledFunction,
    Intrinsic,
    LlvmValue,
    NumbaType,
    TypingContext,
)
from levelhead.compiler.tree import Tree, leaves, native, plain, rebuild


class Slot(NamedTuple):
    """How compiled code loads and stores values of one type, and Python the same bytes."""

    load: Intrinsic  # load(address) -> value
    store: Intrinsic  # store(address, value)
    example: Tree
    words: struct.Struct

    @property
    def size(self) -> int:
        """Bytes that a value takes."""
        return self.words.size

    def read(self, memory: NDArray[np.uint64], at: int) -> Tree:
        """The value in ``memory`` from byte ``at`` on."""
        return rebuild(self.example, iter(self.words.unpack_from(memory.data, at)))

    def write(self, memory: NDArray[np.uint64], at: int, value: Tree) -> None:
        """Puts a value there."""
        self.words.pack_into(memory.data, at, *leaves(value))


def slot(example: Tree) -> Slot:
    """A slot for values like ``example``: floats, ints, bools, arrays of float64 and NamedTuples of these.

    Each number takes eight bytes, in order; arrays lie there as a whole, and a loaded value refers to them in place.
    """
    import numba
    from numba.core import types
    from numba.extending import intrinsic

    example = native(example)
    kind: NumbaType = numba.typeof(example)  # type: ignore[no-untyped-call]
    lengths = _lengths(example)

    @intrinsic
    def load(typing_context: TypingContext, address: NumbaType) -> Intrinsic:
        def code(context: CodeContext, builder: Builder, signature: NumbaType, args: LlvmValue) -> LlvmValue:
            return _load(context, builder, kind, args[0], iter(lengths), [0])

        return kind(types.intp), code

    @intrinsic
    def store(typing_context: TypingContext, address: NumbaType, value: NumbaType) -> Intrinsic:
        def code(context: CodeContext, builder: Builder, signature: NumbaType, args: LlvmValue) -> LlvmValue:
            _store(context, builder, kind, args[0], args[1], iter(lengths), [0])
            return context.get_dummy_value()

        return types.void(types.intp, kind), code

    return Slot(load, store, plain(example), struct.Struct("=" + _format(example)))


def _format(example: Tree) -> str:
    """The words of a value as ``struct`` names them; a truth value takes a whole one."""
    if isinstance(example, tuple):
        return "".join(map(_format, example))
    if isinstance(example, np.ndarray):
        return f"{len(example)}d"
    return "d" if isinstance(example, float) else "q"


def _lengths(example: Tree) -> list[int]:
    """Words that each leaf takes."""
    if isinstance(example, tuple):
        return [length for part in example for length in _lengths(part)]
    return [len(example)] if isinstance(example, np.ndarray) else [1]


def _pointer(builder: Builder, address: LlvmValue, word: int, kind: LlvmValue) -> LlvmValue:
    from llvmlite import ir

    place = builder.add(address, ir.Constant(address.type, 8 * word))
    return builder.inttoptr(place, kind.as_pointer())


def _load(
    context: CodeContext, builder: Builder, kind: NumbaType, address: LlvmValue, lengths: Iterator[int], at: list[int]
) -> LlvmValue:
    """Builds the value of that kind from the words at ``at[0]``, which moves on."""
    from llvmlite import ir
    from numba.core import types
    from numba.np.arrayobj import populate_array

    if isinstance(kind, types.BaseTuple):
        members = [_load(context, builder, member, address, lengths, at) for member in kind]  # type: ignore[attr-defined]
        return context.make_tuple(builder, kind, members)
    word, length = at[0], next(lengths)
    at[0] += length
    if isinstance(kind, types.Array):
        view = context.make_array(kind)(context, builder)
        populate_array(  # type: ignore[no-untyped-call]
            view,
            data=_pointer(builder, address, word, ir.DoubleType()),
            shape=[context.get_constant(types.intp, length)],
            strides=[context.get_constant(types.intp, 8)],
            itemsize=context.get_constant(types.intp, 8),
            meminfo=None,
        )
        return view._getvalue()
    value = builder.load(_pointer(builder, address, word, _word(kind)))
    return builder.icmp_unsigned("!=", value, ir.Constant(value.type, 0)) if kind == types.boolean else value


def _store(
    context: CodeContext,
    builder: Builder,
    kind: NumbaType,
    address: LlvmValue,
    value: LlvmValue,
    lengths: Iterator[int],
    at: list[int],
) -> None:
    from llvmlite import ir
    from numba.core import cgutils, types

    if isinstance(kind, types.BaseTuple):
        for i, member in enumerate(list(kind)):  # type: ignore[call-overload]
            _store(context, builder, member, address, builder.extract_value(value, i), lengths, at)
        return
    word, length = at[0], next(lengths)
    at[0] += length
    if isinstance(kind, types.Array):
        source = context.make_array(kind)(context, builder, value=value).data
        target = _pointer(builder, address, word, ir.DoubleType())
        with builder.if_then(builder.icmp_unsigned("!=", source, target)):  # mostly it was written in place
            cgutils.raw_memcpy(  # type: ignore[no-untyped-call]
                builder, target, source, ir.Constant(ir.IntType(64), length), 8
            )
        return
    if kind == types.boolean:
        value = builder.zext(value, ir.IntType(64))
    builder.store(value, _pointer(builder, address, word, _word(kind)))


def _word(kind: NumbaType) -> LlvmValue:
    from llvmlite import ir
    from numba.core import types

    return ir.DoubleType() if isinstance(kind, types.Float) else ir.IntType(64)


def allocate(size: int) -> tuple[NDArray[np.uint64], int]:
    """Zeroed, aligned memory for that many bytes (whole words), and its address; it lives as long as the array does."""
    memory = np.zeros(size // 8, np.uint64)
    return memory, int(memory.ctypes.data)


def entry_point(function: CompiledFunction, arguments: str) -> CompiledFunction:
    """The machine code of a compiled function behind no type dispatch: ``arguments`` is "i" (int), "f" (float) or "v"
    (tuple of three floats) for each."""
    from numba.core import types

    kinds = {"i": types.intp, "f": types.float64, "v": types.UniTuple(types.float64, 3)}  # type: ignore[no-untyped-call]
    return function.compile(tuple(kinds[letter] for letter in arguments))
